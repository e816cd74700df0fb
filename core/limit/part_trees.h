// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Proof, made closer where it is asked for, that a point isn't in a cell.
//
// Where cells fold or parts overlap, the cells that come first are searched for a point before the one that holds it,
// and a search in vain takes as long as ten others. So after one the boxes around the cell's parts that couldn't rule
// the point out are divided: a patch by its Bezier net, along its longer axes, and what is left beside an irregular
// line or vertex into the patches of its next level. The next point there is ruled out at the cost of a few
// comparisons. Each box is sheared as its part is in the middle, where parts are nearly cubes: it is closer by the
// square for halves, and a few hundred parts follow a cell's faces to a thousandth of it.
//
// What is ruled out holds for certain, whatever was asked before: the memory decides about time alone.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/limit/fold_search.h"
#include "core/limit/limit_solid.h"
#include "core/limit/patch_path.h"

namespace ccslice {

/// One solid, one thread.
class PartTrees {
 public:
  static constexpr std::size_t kMostNodes = 1 << 15;  // Of all cells: 5 MB.

  /// REQUIRES: the solid outlives this; distance_mm is more than doubles are off at the size of the solid.
  PartTrees(const LimitSolid& solid, double distance_mm);

  /// False only if the cell's limit is nowhere within distance_mm of the point, mesh frame.
  [[nodiscard]] bool may_hold(LimitCellId cell, const Vec3& point) const noexcept;
  /// Divides the parts of the cell that may hold the point, until none does or they are as small as the distance: to be
  /// called after a search in vain. Forgets all parts where they would take more memory.
  void refine(LimitCellId cell, const Vec3& point) noexcept;

  std::size_t size() const { return nodes_.size(); }

 private:
  /// Part of a patch: piece index[a] of 2^halvings[a] along each axis. Or what is left beside a line or a vertex.
  struct Part {
    PatchPath path;
    std::array<std::uint8_t, 3> halvings{}, index{};
    bool is_rest = false;
  };
  /// A box around a part, grown by the distance: points p for which map (p - origin) is within 1 of `middle`, by axis.
  struct Node {
    Mat3 map;
    Vec3 origin;  // mm.
    Vec3 middle;
    Part part;
    std::uint16_t children = 0;  // kWhole: it can't be divided any further.
    std::uint32_t first_child = 0;
  };
  static constexpr std::uint16_t kWhole = 0xffff;
  static constexpr std::size_t kMostLeaves = 8;  // Divided at once.

  template <typename Accept>
  bool any_leaf(std::uint32_t root, const Vec3& point, Accept accept) const noexcept;
  void divide(LimitCellId cell, std::uint32_t node);
  void divide_rest(LimitCellId cell, std::uint32_t node);
  void divide_patch(LimitCellId cell, std::uint32_t node);
  void append_root(LimitCellId cell);
  void append_patch(LimitCellId cell, const PatchPath& path);
  void append_rest(LimitCellId cell, const PatchPath& path);
  void append_net(const BezierVolume& net, const Mat3& of_parent, const Part& part);
  void append(std::span<const Vec3> hull, const Mat3& map, const Part& part);

  const LimitSolid& solid_;
  double distance_mm_;
  PatchBuilder builder_;
  std::vector<double> grid_;
  std::vector<Vec3> hull_;
  std::unordered_map<std::uint32_t, std::uint32_t> roots_;  // By cell.
  std::vector<Node> nodes_;
};

}  // namespace ccslice
