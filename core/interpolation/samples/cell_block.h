// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Forward samples of a limit cell: geo and mat at the 5 x 5 x 5 nodes of a box of its parameters, no inversion needed.
//
// A box within one patch is sampled axis by axis. Others, of irregular cells, are products of stencils and the cell's
// ring where many cells share them (block_stencils.h), or else sampled patch by patch.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/base/types.h"
#include "core/interpolation/samples/block_slots.h"
#include "core/interpolation/samples/block_stencils.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/patch_path.h"

namespace ccslice {

struct CellBlock {
  std::array<BlockValues, 3> position;  // mm, mesh frame.
  std::vector<BlockValues> values;      // Values of the channels asked for.
};

/// A point's numbers by fours, for as many lanes: x, y, z and a channel at first, then four channels each. Calls
/// visit(lanes before them, first channel, channels).
template <typename Visit>
void for_each_four_numbers(std::size_t channels, Visit visit) {
  visit(3, 0, std::min<std::size_t>(1, channels));
  for (std::size_t c = 1; c < channels; c += kLanes) visit(0, c, std::min(kLanes, channels - c));
}

/// Samples one solid on one thread. Memory is kept from block to block; so are the last blocks that were sampled patch
/// by patch, as the halves of a box share nodes with it. Results don't depend on what is kept.
class CellBlockSampler {
 public:
  /// `stencils`: of the evaluator's solid, or its own. REQUIRES: evaluator outlives this.
  CellBlockSampler(LimitEvaluator& evaluator, std::vector<std::uint32_t> channels,
                   std::shared_ptr<BlockStencils> stencils = nullptr);

  void sample(LimitCellId cell, const ParamBox& box, CellBlock& block);
  /// Position and channels are tricubic in the box's parameters.
  bool is_in_one_patch(LimitCellId cell, const ParamBox& box) const;
  /// Fills the first kGroupsBetweenNodes groups, at the places between nodes (block_slots.h).
  void sample_between_nodes(LimitCellId cell, const ParamBox& box, CellBlock& block);

 private:
  struct Sampled {
    LimitCellId cell;
    ParamBox box;
    CellBlock block;
  };

  void sample_box(LimitCellId cell, const ParamBox& box, BlockPlaces places, CellBlock& block);
  // A block in one patch.
  void sample_patch_at_nodes(const Patch& patch, const PatchPlace& place, const ParamBox& box,
                             CellBlock& block) const noexcept;
  void sample_patch_between_nodes(const Patch& patch, const PatchPlace& place, const ParamBox& box,
                                  CellBlock& block) const noexcept;
  // A block by stencils.
  void sample_ring(const LimitCell& cell, const ParamBox& box, BlockPlaces places, CellBlock& block);
  // A block patch by patch.
  void place_parameters(const ParamBox& box, BlockPlaces places);
  void copy_known(LimitCellId cell, const ParamBox& box, CellBlock& block);
  void keep(LimitCellId cell, const ParamBox& box, const CellBlock& block);
  void sample_patches(LimitCellId cell, std::size_t slots, CellBlock& block) noexcept;
  void sample_slots(const Patch& patch, const std::array<std::size_t, kLanes>& slots, CellBlock& block) const noexcept;
  void sample_singular(LimitCellId cell, std::size_t slot, CellBlock& block) noexcept;

  LimitEvaluator* evaluator_;
  const std::vector<std::uint32_t> channels_;
  const std::shared_ptr<BlockStencils> stencils_;
  std::vector<Lanes> ring_;  // Four numbers of each of a ring's points.
  std::array<BlockValues, 3> parameters_;
  std::vector<double> values_;  // All channels at one node.
  std::array<PatchPlace, kBlockSlots> places_;
  std::array<bool, kBlockSlots> known_;                                   // Slots that needn't be sampled.
  std::array<std::pair<std::uint64_t, std::size_t>, kBlockSlots> order_;  // The others by patch.
  std::vector<Sampled> kept_;                                             // Each in the one before, so many of them:
  std::size_t kept_count_ = 0;
};

}  // namespace ccslice
