// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_evaluator.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <memory>
#include <new>
#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"

namespace ccslice {

namespace {

constexpr std::uint64_t kNoKey = ~std::uint64_t{0};

/// As many patches as fit, a power of two: one slot each, found by hashing. Pages stay untouched until a patch comes.
class PatchCache {
 public:
  PatchCache(std::size_t channels, std::size_t bytes)
      : doubles_(doubles_of(channels)),
        slots_(slots_of(channels, bytes)),
        storage_(static_cast<double*>(::operator new(slots_* doubles_ * sizeof(double), kAlignment))),
        patches_(slots_, Slot{kNoKey, {}}) {
    for (std::size_t s = 0; s < slots_; ++s) {
      double* points = storage_.get() + s * doubles_;
      patches_[s].patch = {points, points + kPatchPoints};
    }
  }

  static std::size_t bytes_of(std::size_t channels, std::size_t bytes) {
    return slots_of(channels, bytes) * (doubles_of(channels) * sizeof(double) + sizeof(Slot));
  }

  /// load(points, channels) fills a patch that isn't there.
  template <typename Load>
  const Patch& get(std::uint64_t key, Load load) noexcept {
    Slot& slot = patches_[(key * 0x9e3779b97f4a7c15ull) >> 32 & (slots_ - 1)];
    if (slot.key != key) {
      double* points = storage_.get() + static_cast<std::size_t>(&slot - patches_.data()) * doubles_;
      load(points, points + kPatchPoints);
      slot.key = key;
    }
    return slot.patch;
  }

 private:
  static constexpr std::align_val_t kAlignment{32};
  static std::size_t doubles_of(std::size_t channels) { return (kPatchPoints + 64 * channels + 3) / 4 * 4; }
  static std::size_t slots_of(std::size_t channels, std::size_t bytes) {
    return std::bit_floor(std::max<std::size_t>(1, bytes / (doubles_of(channels) * sizeof(double))));
  }
  struct Slot {
    std::uint64_t key;
    Patch patch;
  };
  struct Free {
    void operator()(double* p) const { ::operator delete(p, kAlignment); }
  };

  std::size_t doubles_;  // A patch.
  std::size_t slots_;
  std::unique_ptr<double, Free> storage_;
  std::vector<Slot> patches_;
};

}  // namespace

std::size_t patch_cache_bytes(std::size_t channels, std::size_t most_bytes) {
  return PatchCache::bytes_of(channels, most_bytes);
}

struct LimitEvaluator::State {
  const LimitSolid& solid;
  const LimitSolid::Data& data;
  PatchBuilder builder;
  std::vector<double> grid;
  std::vector<double> limit;
  PatchCache patches;

  State(const LimitSolid& s, std::size_t patch_cache_bytes)
      : solid(s),
        data(s.data()),
        builder(data, data.dimension),
        grid(64 * data.dimension),
        limit(data.dimension),
        patches(data.dimension - 3, patch_cache_bytes) {}

  const Patch& patch(LimitCellId cell, const PatchPath& path) noexcept {
    return patches.get(std::uint64_t{cell} << 32 | path.packed(), [&](double* points, double* channels) {
      builder.build(data.cells[cell], path, grid.data());
      load_patch(grid.data(), data.dimension, points, channels);
    });
  }

  /// Position and channels on an irregular line or vertex itself, by the limit rows.
  const std::vector<double>& singular(LimitCellId cell, const PatchPlace& place) noexcept {
    if (place.at_vertex) {
      builder.limit_at_vertex(data.cells[cell], limit.data());
    } else {
      builder.limit_at_line(data.cells[cell], place.path, place.local[2], limit.data());
    }
    return limit;
  }
};

LimitEvaluator::LimitEvaluator(const LimitSolid& solid, std::size_t patch_cache_bytes)
    : state_(std::make_unique<State>(solid, patch_cache_bytes)) {}
LimitEvaluator::~LimitEvaluator() = default;
LimitEvaluator::LimitEvaluator(LimitEvaluator&&) noexcept = default;
LimitEvaluator& LimitEvaluator::operator=(LimitEvaluator&&) noexcept = default;

const LimitSolid& LimitEvaluator::solid() const noexcept { return state_->solid; }

Vec3 LimitEvaluator::geo(const CellParam& at) noexcept {
  const PatchPlace place = find_patch(state_->data, state_->data.cells[at.cell], at.uvw);
  if (place.at_vertex || place.at_line) return Vec3::Map(state_->singular(at.cell, place).data());
  return patch_position(state_->patch(at.cell, place.path), place.local);
}

LimitSample LimitEvaluator::sample(const CellParam& at) noexcept {
  const PatchPlace place = find_patch(state_->data, state_->data.cells[at.cell], at.uvw);
  // On the line or vertex itself the Jacobian is that of the patch beside it.
  LimitSample result = in_cell(place, patch_sample(state_->patch(at.cell, place.path).points, place.local));
  if (place.at_vertex || place.at_line) result.position = Vec3::Map(state_->singular(at.cell, place).data());
  return result;
}

void LimitEvaluator::mat(const CellParam& at, std::span<double> out) noexcept {
  const PatchPlace place = find_patch(state_->data, state_->data.cells[at.cell], at.uvw);
  if (place.at_vertex || place.at_line) {
    const auto& values = state_->singular(at.cell, place);
    std::copy(values.begin() + 3, values.end(), out.begin());
    return;
  }
  patch_channels(state_->patch(at.cell, place.path), place.local, out);
}

Vec3 LimitEvaluator::geo_and_mat(const CellParam& at, std::span<double> channels) noexcept {
  const PatchPlace place = find_patch(state_->data, state_->data.cells[at.cell], at.uvw);
  if (place.at_vertex || place.at_line) {
    const auto& values = state_->singular(at.cell, place);
    std::copy(values.begin() + 3, values.end(), channels.begin());
    return Vec3::Map(values.data());
  }
  const Patch& patch = state_->patch(at.cell, place.path);
  patch_channels(patch, place.local, channels);
  return patch_position(patch, place.local);
}

const Patch* LimitEvaluator::patch_at(const CellParam& at, PatchPlace& place) noexcept {
  place = find_patch(state_->data, state_->data.cells[at.cell], at.uvw);
  return place.at_vertex || place.at_line ? nullptr : &state_->patch(at.cell, place.path);
}

const Patch& LimitEvaluator::patch(LimitCellId cell, const PatchPlace& place) noexcept {
  return state_->patch(cell, place.path);
}

}  // namespace ccslice
