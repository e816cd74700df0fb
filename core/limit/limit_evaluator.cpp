// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_evaluator.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"

namespace ccslice {

namespace {

constexpr std::size_t kCachedPatches = 512;  // A power of two; about 1 MiB without channels.
constexpr std::uint64_t kNoKey = ~std::uint64_t{0};

std::size_t slot_of(std::uint64_t key) {
  return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ull) >> 40) & (kCachedPatches - 1);
}

}  // namespace

struct LimitEvaluator::State {
  const LimitSolid& solid;
  const LimitSolid::Data& data;
  PatchBuilder builder;
  std::vector<double> grid;
  std::vector<double> limit;
  std::vector<std::uint64_t> keys;
  std::vector<Patch> patches;

  explicit State(const LimitSolid& s)
      : solid(s),
        data(s.data()),
        builder(data, data.dimension),
        grid(64 * data.dimension),
        limit(data.dimension),
        keys(kCachedPatches, kNoKey),
        patches(kCachedPatches) {
    for (Patch& patch : patches) patch.channels.resize(64 * (data.dimension - 3));
  }

  const Patch& patch(std::uint32_t cell, const PatchPath& path) noexcept {
    const std::uint64_t key = std::uint64_t{cell} << 32 | path.packed();
    const std::size_t slot = slot_of(key);
    if (keys[slot] != key) {
      builder.build(data.cells[cell], path, grid.data());
      load_patch(grid.data(), data.dimension, patches[slot]);
      keys[slot] = key;
    }
    return patches[slot];
  }

  /// Position and channels on an irregular line or vertex itself, by the limit rows.
  const std::vector<double>& singular(std::uint32_t cell, const PatchPlace& place) noexcept {
    if (place.at_vertex) {
      builder.limit_at_vertex(data.cells[cell], limit.data());
    } else {
      builder.limit_at_line(data.cells[cell], place.path, place.local[2], limit.data());
    }
    return limit;
  }
};

LimitEvaluator::LimitEvaluator(const LimitSolid& solid) : state_(std::make_unique<State>(solid)) {}
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
  const LimitSample local = patch_sample(state_->patch(at.cell, place.path), place.local);
  LimitSample result;
  result.position = local.position;
  if (place.at_vertex || place.at_line) result.position = Vec3::Map(state_->singular(at.cell, place).data());
  for (int a = 0; a < 3; ++a) {
    result.jacobian.col(place.axis[static_cast<std::size_t>(a)]) = place.factor[a] * local.jacobian.col(a);
  }
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

}  // namespace ccslice
