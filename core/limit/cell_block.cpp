// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_block.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "core/limit/patch_lanes.h"
#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

std::array<BlockValues, 3> make_shares() {
  std::array<BlockValues, 3> shares{};
  const auto put = [&](std::size_t slot, std::size_t node) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t place = node / kBlockStride[a] % kBlockNodes;
      shares[a][slot / kLanes][slot % kLanes] = static_cast<double>(place) / (kBlockNodes - 1);
    }
  };
  const std::size_t last = std::tuple_size_v<BlockPoints> - 1;
  for (std::size_t slot = kEvenBlockNodes; slot < kBlockSlots; ++slot) put(slot, last - slot / (kBlockSlots / 2));
  for (std::size_t node = 0; node <= last; ++node) put(block_slot(node), node);
  return shares;
}

std::array<BlockValues, 3> make_shares_between_nodes() {
  constexpr double kHalfWay = 0.5 / (kBlockNodes - 1);
  std::array<BlockValues, 3> shares{};
  for (std::size_t slot = 0; slot < kGroupsBetweenNodes * kLanes; ++slot) {
    const std::size_t axis = slot / (2 * kLanes), bits = slot % (2 * kLanes);
    for (std::size_t a = 0; a < 3; ++a) {
      const bool high = (bits >> ((a + 3 - axis) % 3) & 1) != 0;
      const double near = a == axis ? kHalfWay : 0;
      shares[a][slot / kLanes][slot % kLanes] = high ? 1 - near : near;
    }
  }
  return shares;
}

/// Of the patch that holds the whole box, if one does: patches are boxes of parameters, too.
std::optional<PatchPlace> patch_of_box(const LimitSolid::Data& data, std::uint32_t cell, const ParamBox& box) {
  constexpr double kInwards = 1e-6;
  const LimitCell& limit_cell = data.cells[cell];
  const Vec3 middle = 0.5 * (box.low + box.high), half = (0.5 - kInwards) * (box.high - box.low);
  const PatchPlace place = find_patch(data, limit_cell, middle);
  if (place.at_vertex || place.at_line) return std::nullopt;
  if (limit_cell.cell_class == CellClass::kRegular) return place;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    if (find_patch(data, limit_cell, middle + half.cwiseProduct(side)).path.packed() != place.path.packed()) {
      return std::nullopt;
    }
  }
  return place;
}

/// Equal for places in the same patch; patches that are made in much the same way come together.
std::uint64_t order_of(const PatchPlace& place) {
  const PatchPath& path = place.path;
  const std::uint64_t sub_cell = std::uint64_t{path.level} << 8 | path.child;
  return sub_cell << 24 | std::uint64_t{path.line_level} << 16 | std::uint64_t{path.line_child} << 8 |
         std::uint64_t{place.at_line || place.at_vertex};
}

}  // namespace

const std::array<BlockValues, 3>& block_shares() {
  static const std::array<BlockValues, 3> kShares = make_shares();
  return kShares;
}

CellBlockSampler::CellBlockSampler(LimitEvaluator& evaluator, std::vector<std::uint32_t> channels)
    : evaluator_(&evaluator), channels_(std::move(channels)), values_(evaluator.solid().channel_count()) {}

void CellBlockSampler::sample(std::uint32_t cell, const ParamBox& box, CellBlock& block) {
  sample_shares(cell, box, block_shares(), kBlockGroups, block);
}

void CellBlockSampler::sample_between_nodes(std::uint32_t cell, const ParamBox& box, CellBlock& block) {
  static const std::array<BlockValues, 3> kShares = make_shares_between_nodes();
  sample_shares(cell, box, kShares, kGroupsBetweenNodes, block);
}

void CellBlockSampler::sample_shares(std::uint32_t cell, const ParamBox& box, const std::array<BlockValues, 3>& shares,
                                     std::size_t groups, CellBlock& block) {
  groups_ = groups;
  block.values.resize(channels_.size());
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    for (std::size_t g = 0; g < groups; ++g) {
      parameters_[i][g] = box.low[a] + shares[i][g] * (box.high[a] - box.low[a]);
    }
  }
  const Vec3 middle = 0.5 * (box.low + box.high);
  if (const std::optional<PatchPlace> place = patch_of_box(evaluator_->solid().data(), cell, box)) {
    return sample_patch(evaluator_->patch(cell, *place), *place, middle, block);
  }
  sample_patches(cell, block);
}

void CellBlockSampler::sample_patch(const Patch& patch, const PatchPlace& place, const Vec3& middle,
                                    CellBlock& block) const noexcept {
  const std::size_t channel_count = values_.size();
  for (std::size_t g = 0; g < groups_; ++g) {
    std::array<Lanes, 3> local;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      local[i] = place.local[a] + place.factor[a] * (parameters_[place.axis[i]][g] - middle[place.axis[i]]);
    }
    const LaneBasis basis(local);
    const std::array<Lanes, 3> position = patch_positions(patch, basis);
    for (std::size_t a = 0; a < 3; ++a) block.position[a][g] = position[a];
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      block.values[c][g] = patch_channel(patch, channels_[c], channel_count, basis);
    }
  }
}

void CellBlockSampler::sample_patches(std::uint32_t cell, CellBlock& block) noexcept {
  const LimitSolid::Data& data = evaluator_->solid().data();
  const std::size_t slots = groups_ * kLanes;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    places_[slot] = find_patch(data, data.cells[cell], parameter(slot));
    order_[slot] = {order_of(places_[slot]), slot};
  }
  std::sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(slots));
  for (std::size_t begin = 0, end = 0; begin < slots; begin = end) {
    const std::size_t first = order_[begin].second;
    if (places_[first].at_line || places_[first].at_vertex) {
      sample_singular(cell, first, block);
      ++end;
      continue;
    }
    while (end < slots && end < begin + kLanes && order_[end].first == order_[begin].first) ++end;
    std::array<std::size_t, kLanes> slots;
    for (std::size_t lane = 0; lane < kLanes; ++lane) slots[lane] = order_[std::min(begin + lane, end - 1)].second;
    sample_slots(evaluator_->patch(cell, places_[first]), slots, block);
  }
}

void CellBlockSampler::sample_slots(const Patch& patch, const std::array<std::size_t, kLanes>& slots,
                                    CellBlock& block) const noexcept {
  std::array<Lanes, 3> local;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    for (std::size_t a = 0; a < 3; ++a) local[a][lane] = places_[slots[lane]].local[static_cast<Eigen::Index>(a)];
  }
  const LaneBasis basis(local);
  const auto put = [&](const Lanes& values, BlockValues& out) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) out[slots[lane] / kLanes][slots[lane] % kLanes] = values[lane];
  };
  const std::array<Lanes, 3> position = patch_positions(patch, basis);
  for (std::size_t a = 0; a < 3; ++a) put(position[a], block.position[a]);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    put(patch_channel(patch, channels_[c], values_.size(), basis), block.values[c]);
  }
}

void CellBlockSampler::sample_singular(std::uint32_t cell, std::size_t slot, CellBlock& block) noexcept {
  const std::size_t group = slot / kLanes, lane = slot % kLanes;
  const Vec3 position = evaluator_->geo_and_mat({cell, parameter(slot)}, values_);
  for (int a = 0; a < 3; ++a) block.position[static_cast<std::size_t>(a)][group][lane] = position[a];
  for (std::size_t c = 0; c < channels_.size(); ++c) block.values[c][group][lane] = values_[channels_[c]];
}

Vec3 CellBlockSampler::parameter(std::size_t slot) const noexcept {
  const std::size_t group = slot / kLanes, lane = slot % kLanes;
  return {parameters_[0][group][lane], parameters_[1][group][lane], parameters_[2][group][lane]};
}

}  // namespace ccslice
