// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/cell_block.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "core/limit/patch_lanes.h"
#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr std::size_t kMostKept = 12;

void copy_slot(const CellBlock& from, std::size_t from_slot, CellBlock& to, std::size_t to_slot) {
  const auto copy = [&](const BlockValues& source, BlockValues& target) {
    target[to_slot / kLanes][to_slot % kLanes] = source[from_slot / kLanes][from_slot % kLanes];
  };
  for (std::size_t a = 0; a < 3; ++a) copy(from.position[a], to.position[a]);
  for (std::size_t c = 0; c < from.values.size(); ++c) copy(from.values[c], to.values[c]);
}

/// The node at the n-th place in the order of the patch's axes.
std::size_t node_of(std::size_t n, const PatchPlace& place) {
  return n % kBlockNodes * kBlockStride[place.axis[0]] + n / kBlockNodes % kBlockNodes * kBlockStride[place.axis[1]] +
         n / (kBlockNodes * kBlockNodes) * kBlockStride[place.axis[2]];
}

/// For each of a box's nodes along an axis, the node at the same parameter of a box that holds it.
using SharedNodes = std::array<std::size_t, kBlockNodes>;
constexpr std::size_t kNotShared = kBlockNodes;

/// An interval in the parameters of another one that holds it: exact if both are dyadic.
SharedNodes shared_nodes(double low, double high, double whole_low, double whole_high) {
  SharedNodes nodes;
  nodes.fill(kNotShared);
  const double size = high - low, whole = whole_high - whole_low;
  const std::size_t stride = size == whole ? 1 : 2;
  if (static_cast<double>(stride) * size != whole) return nodes;
  const double offset = (kBlockNodes - 1) * (low - whole_low) / whole;
  const auto first = static_cast<std::size_t>(offset);
  if (static_cast<double>(first) != offset) return nodes;
  for (std::size_t n = 0; n < kBlockNodes; n += stride) nodes[n] = first + n / stride;
  return nodes;
}

/// The patch that holds the whole box, if one does: patches are boxes of parameters, too.
std::optional<PatchPlace> patch_of_box(const LimitSolid::Data& data, LimitCellId cell, const ParamBox& box) {
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

CellBlockSampler::CellBlockSampler(LimitEvaluator& evaluator, std::vector<std::uint32_t> channels,
                                   std::shared_ptr<BlockStencils> stencils)
    : evaluator_(&evaluator),
      channels_(std::move(channels)),
      stencils_(stencils ? std::move(stencils) : std::make_shared<BlockStencils>(evaluator.solid().data())),
      values_(evaluator.solid().channel_count()) {}

bool CellBlockSampler::is_in_one_patch(LimitCellId cell, const ParamBox& box) const {
  return patch_of_box(evaluator_->solid().data(), cell, box).has_value();
}

void CellBlockSampler::sample(LimitCellId cell, const ParamBox& box, CellBlock& block) {
  sample_box(cell, box, BlockPlaces::kNodes, block);
  for (const std::size_t slot : kRepeatingSlots) copy_slot(block, block_slot(repeated_node(slot)), block, slot);
}

void CellBlockSampler::sample_between_nodes(LimitCellId cell, const ParamBox& box, CellBlock& block) {
  sample_box(cell, box, BlockPlaces::kBetweenNodes, block);
}

void CellBlockSampler::sample_box(LimitCellId cell, const ParamBox& box, BlockPlaces places, CellBlock& block) {
  block.values.resize(channels_.size());
  const LimitSolid::Data& data = evaluator_->solid().data();
  const bool at_nodes = places == BlockPlaces::kNodes;
  if (const std::optional<PatchPlace> place = patch_of_box(data, cell, box)) {
    const Patch& patch = evaluator_->patch(cell, *place);
    return at_nodes ? sample_patch_at_nodes(patch, *place, box, block)
                    : sample_patch_between_nodes(patch, *place, box, block);
  }
  if (stencils_->are_worth_it(data.cells[cell], box)) return sample_ring(data.cells[cell], box, places, block);
  place_parameters(box, places);
  known_.fill(false);
  if (at_nodes) {
    for (const std::size_t slot : kRepeatingSlots) known_[slot] = true;
    copy_known(cell, box, block);
  }
  sample_patches(cell, slots_at(places), block);
  if (at_nodes) keep(cell, box, block);
}

void CellBlockSampler::place_parameters(const ParamBox& box, BlockPlaces places) {
  const std::array<BlockValues, 3>& shares = block_shares(places);
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    for (std::size_t g = 0; g < slots_at(places) / kLanes; ++g) {
      parameters_[i][g] = box.low[a] + shares[i][g] * (box.high[a] - box.low[a]);
    }
  }
}

/// All nodes of a box in one patch, axis by axis.
void CellBlockSampler::sample_patch_at_nodes(const Patch& patch, const PatchPlace& place, const ParamBox& box,
                                             CellBlock& block) const noexcept {
  std::array<std::array<std::array<double, 4>, kBlockNodes>, 3> basis;
  for (std::size_t n = 0; n < kBlockNodes; n += kLanes) {
    std::array<Lanes, 3> local;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double size = box.high[place.axis[a]] - box.low[place.axis[a]];
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const double share = static_cast<double>(n + lane) / (kBlockNodes - 1);
        local[a][lane] = place.local[axis] + place.factor[axis] * (share - 0.5) * size;
      }
    }
    const LaneBasis lanes(local);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t lane = 0; lane < kLanes && n + lane < kBlockNodes; ++lane) {
        for (std::size_t i = 0; i < 4; ++i) basis[a][n + lane][i] = lanes.value[a][i][lane];
      }
    }
  }
  std::array<Lanes, 64> points;
  std::array<Lanes, std::tuple_size_v<BlockPoints>> found;
  for_each_four_numbers(channels_.size(), [&](std::size_t first_lane, std::size_t c, std::size_t count) {
    for (std::size_t p = 0; p < points.size(); ++p) {
      for (std::size_t lane = 0; lane < first_lane; ++lane) points[p][lane] = patch.points[4 * p + lane];
      for (std::size_t k = 0; k < count; ++k) {
        points[p][first_lane + k] = patch.channels[p * values_.size() + channels_[c + k]];
      }
    }
    contract(points, basis, found);
    for (std::size_t n = 0; n < found.size(); ++n) {
      const std::size_t slot = block_slot(node_of(n, place)), group = slot / kLanes, at = slot % kLanes;
      for (std::size_t lane = 0; lane < first_lane; ++lane) block.position[lane][group][at] = found[n][lane];
      for (std::size_t k = 0; k < count; ++k) block.values[c + k][group][at] = found[n][first_lane + k];
    }
  });
}

void CellBlockSampler::sample_patch_between_nodes(const Patch& patch, const PatchPlace& place, const ParamBox& box,
                                                  CellBlock& block) const noexcept {
  const std::array<BlockValues, 3>& shares = block_shares(BlockPlaces::kBetweenNodes);
  const std::size_t channel_count = evaluator_->solid().channel_count();
  for (std::size_t g = 0; g < kGroupsBetweenNodes; ++g) {
    std::array<Lanes, 3> local;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      const double size = box.high[place.axis[i]] - box.low[place.axis[i]];
      local[i] = place.local[a] + place.factor[a] * size * (shares[place.axis[i]][g] - 0.5);
    }
    const LaneBasis basis(local);
    const std::array<Lanes, 3> position = patch_positions(patch, basis);
    for (std::size_t a = 0; a < 3; ++a) block.position[a][g] = position[a];
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      block.values[c][g] = patch_channel(patch, channels_[c], channel_count, basis);
    }
  }
}

/// Samples by the ring of control points, in its own frame.
void CellBlockSampler::sample_ring(const LimitCell& cell, const ParamBox& box, BlockPlaces places, CellBlock& block) {
  const LimitSolid::Data& data = evaluator_->solid().data();
  const std::shared_ptr<const LimitStencils> stencils = stencils_->at(cell, box, places);
  const SlotsInFrame& slots = slots_in_frame(cell.frame, places);
  const auto put = [&](const BlockValues& in_frame, BlockValues& out) {
    for (std::size_t slot = 0; slot < slots_at(places); ++slot) {
      out[slot / kLanes][slot % kLanes] = in_frame[slots[slot] / kLanes][slots[slot] % kLanes];
    }
  };
  std::array<BlockValues, kLanes> found;
  for_each_four_numbers(channels_.size(), [&](std::size_t first_lane, std::size_t c, std::size_t count) {
    ring_.assign(data.point_count(cell), Lanes{});
    data.for_each_point(cell, [&](std::size_t p, std::uint32_t id) {
      if (id == kNone) return;
      const double* point = data.point(id);
      for (std::size_t lane = 0; lane < first_lane; ++lane) ring_[p][lane] = point[lane];
      for (std::size_t k = 0; k < count; ++k) ring_[p][first_lane + k] = point[3 + channels_[c + k]];
    });
    stencils->apply(ring_.data(), [&](std::size_t strip, const auto& first, const auto& last) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        found[lane][2 * strip] = first[lane];
        found[lane][2 * strip + 1] = last[lane];
      }
    });
    for (std::size_t lane = 0; lane < first_lane; ++lane) put(found[lane], block.position[lane]);
    for (std::size_t k = 0; k < count; ++k) put(found[first_lane + k], block.values[c + k]);
  });
}

void CellBlockSampler::sample_patches(LimitCellId cell, std::size_t slots, CellBlock& block) noexcept {
  const LimitSolid::Data& data = evaluator_->solid().data();
  std::size_t wanted = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    if (known_[slot]) continue;
    places_[slot] = find_patch(data, data.cells[cell], at_slot(parameters_, slot));
    order_[wanted++] = {order_of(places_[slot]), slot};
  }
  std::sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(wanted));
  for (std::size_t begin = 0, end = 0; begin < wanted; begin = end) {
    const std::size_t first = order_[begin].second;
    if (places_[first].at_line || places_[first].at_vertex) {
      sample_singular(cell, first, block);
      ++end;
      continue;
    }
    while (end < wanted && end < begin + kLanes && order_[end].first == order_[begin].first) ++end;
    std::array<std::size_t, kLanes> slots;
    for (std::size_t lane = 0; lane < kLanes; ++lane) slots[lane] = order_[std::min(begin + lane, end - 1)].second;
    sample_slots(evaluator_->patch(cell, places_[first]), slots, block);
  }
}

/// Copies the nodes that the last kept block which holds the box has, too: the same parameters, sampled alike.
void CellBlockSampler::copy_known(LimitCellId cell, const ParamBox& box, CellBlock& block) {
  const auto holds = [&](const Sampled& whole) {
    return whole.cell == cell && (whole.box.low.array() <= box.low.array()).all() &&
           (whole.box.high.array() >= box.high.array()).all();
  };
  while (kept_count_ > 0 && !holds(kept_[kept_count_ - 1])) --kept_count_;
  if (kept_count_ == 0) return;
  const Sampled& whole = kept_[kept_count_ - 1];
  std::array<SharedNodes, 3> shared;
  for (int a = 0; a < 3; ++a) {
    shared[static_cast<std::size_t>(a)] = shared_nodes(box.low[a], box.high[a], whole.box.low[a], whole.box.high[a]);
  }
  for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
    std::size_t from = 0;
    bool known = true;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t node = shared[a][n / kBlockStride[a] % kBlockNodes];
      known = known && node != kNotShared;
      from += node * kBlockStride[a];
    }
    if (!known) continue;
    known_[block_slot(n)] = true;
    copy_slot(whole.block, block_slot(from), block, block_slot(n));
  }
}

/// Keeps the block for the box's halves.
void CellBlockSampler::keep(LimitCellId cell, const ParamBox& box, const CellBlock& block) {
  if (kept_count_ == kMostKept) return;
  if (kept_.size() == kept_count_) kept_.emplace_back();
  kept_[kept_count_++] = {cell, box, block};
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

void CellBlockSampler::sample_singular(LimitCellId cell, std::size_t slot, CellBlock& block) noexcept {
  const std::size_t group = slot / kLanes, lane = slot % kLanes;
  const Vec3 position = evaluator_->geo_and_mat({cell, at_slot(parameters_, slot)}, values_);
  for (int a = 0; a < 3; ++a) block.position[static_cast<std::size_t>(a)][group][lane] = position[a];
  for (std::size_t c = 0; c < channels_.size(); ++c) block.values[c][group][lane] = values_[channels_[c]];
}

}  // namespace ccslice
