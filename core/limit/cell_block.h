// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Forward samples of a limit cell: geo and mat at the 5 x 5 x 5 nodes of a box of its parameters, no inversion needed.
//
// Nodes are kept in two halves, as the fields of a three-dimensional chessboard: those with even indices (corners and
// middle among them), which a fit is made of, and the odd ones, which check it. Each half takes 64 slots, of which the
// last repeat a node.
//
// Errors of the fifth degree along an axis vanish at five equidistant nodes. Between the outer ones they are largest,
// so places there, on the box's edges, check a fit once more.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/block_nodes.h"
#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/patch_path.h"

namespace ccslice {

/// A box of a cell's parameters.
struct ParamBox {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Ones();
};

inline constexpr std::size_t kEvenBlockNodes = 63;  // Slots 0 to 62.
inline constexpr std::size_t kBlockSlots = 128;
inline constexpr std::size_t kBlockGroups = kBlockSlots / kLanes;

/// Where a node is kept: even nodes before slot 64, odd ones from it on.
constexpr std::size_t block_slot(std::size_t node) noexcept { return node / 2 + (node % 2) * (kBlockSlots / 2); }

/// One number at every slot.
using BlockValues = std::array<Lanes, kBlockGroups>;

/// The nodes' parameters as shares of their box, by axis.
const std::array<BlockValues, 3>& block_shares();

inline constexpr std::size_t kGroupsBetweenNodes = 6;  // By the edges' axis, two each.

struct CellBlock {
  std::array<BlockValues, 3> position;  // mm, mesh frame.
  std::vector<BlockValues> values;      // Of the channels asked for.
};

/// Samples one solid on one thread. Memory is kept from block to block; so are the last blocks that lie in many
/// patches, as the halves of a box share nodes with it. Results don't depend on what is kept.
class CellBlockSampler {
 public:
  /// REQUIRES: evaluator outlives this.
  CellBlockSampler(LimitEvaluator& evaluator, std::vector<std::uint32_t> channels);

  void sample(std::uint32_t cell, const ParamBox& box, CellBlock& block);
  /// Fills the first kGroupsBetweenNodes groups: on each edge of the box half way between its first and its last two
  /// nodes.
  void sample_between_nodes(std::uint32_t cell, const ParamBox& box, CellBlock& block);

 private:
  struct Sampled {
    std::uint32_t cell;
    ParamBox box;
    CellBlock block;
  };

  void place_parameters(const ParamBox& box, const std::array<BlockValues, 3>& shares, std::size_t groups);
  void sample_nodes(const Patch& patch, const PatchPlace& place, const ParamBox& box, CellBlock& block) const noexcept;
  void copy_known(std::uint32_t cell, const ParamBox& box, CellBlock& block);
  void keep(std::uint32_t cell, const ParamBox& box, const CellBlock& block);
  void sample_patch(const Patch& patch, const PatchPlace& place, const Vec3& middle, std::size_t groups,
                    CellBlock& block) const noexcept;
  void sample_patches(std::uint32_t cell, std::size_t slots, CellBlock& block) noexcept;
  void sample_slots(const Patch& patch, const std::array<std::size_t, kLanes>& slots, CellBlock& block) const noexcept;
  void sample_singular(std::uint32_t cell, std::size_t slot, CellBlock& block) noexcept;
  Vec3 parameter(std::size_t slot) const noexcept;

  LimitEvaluator* evaluator_;
  const std::vector<std::uint32_t> channels_;
  std::array<BlockValues, 3> parameters_;
  std::vector<double> values_;  // All channels at one node.
  std::array<PatchPlace, kBlockSlots> places_;
  std::array<bool, kBlockSlots> known_;                                   // Slots that needn't be sampled.
  std::array<std::pair<std::uint64_t, std::size_t>, kBlockSlots> order_;  // The others by patch.
  std::vector<Sampled> kept_;                                             // Each in the one before, so many of them:
  std::size_t kept_count_ = 0;
};

}  // namespace ccslice
