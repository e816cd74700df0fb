// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a parameter lies in the tree of regular patches that tiles an irregular cell [Luu19, 3; after Stam].
//
// A line cell: level n from max(u,v), then one of three patches over [2^-(n+1), 2^-n]-sized boxes, full length along
// the line. A vertex cell: level n from max(u,v,w), then one of seven sub-cells, which is a patch or a line cell in
// turn. u = 1/2 belongs to the outer sub-cell.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/limit/lane_box.h"
#include "core/limit/patch.h"
#include "core/limit/solid_data.h"
#include "core/limit/vertex_walk.h"

namespace ccslice {

/// Deepest level told apart. Beyond it (parameters under 2^-(kMaxPatchLevel + 1)) positions and channels come from
/// limit rows.
inline constexpr int kMaxPatchLevel = 40;

struct PatchPath {
  std::uint8_t level = 0;       // Vertex cells: levels descended at the irregular corner.
  std::uint8_t child = 0;       // Vertex cells: the outer sub-cell (1 to 7).
  std::uint8_t line_level = 0;  // Line cells and line sub-cells: levels descended at the line.
  std::uint8_t line_child = 0;  // Line cells and line sub-cells: the outer patch (1 to 3); 0 in regular sub-cells.

  std::uint32_t packed() const {
    return static_cast<std::uint32_t>(level) | static_cast<std::uint32_t>(child) << 8 |
           static_cast<std::uint32_t>(line_level) << 16 | static_cast<std::uint32_t>(line_child) << 24;
  }
};

/// A patch, the parameter within it, and how its parameters depend on the cell's: local a = factor[a] * cell axis[a] +
/// const.
struct PatchPlace {
  PatchPath path;
  Vec3 local;
  std::array<std::uint8_t, 3> axis;
  Vec3 factor;
  bool at_vertex = false;  // Beyond kMaxPatchLevel, beside the irregular vertex.
  bool at_line = false;    // Likewise beside the irregular line: `local`'s third coordinate still counts.
};

/// A sample of the patch, in the cell's parameters.
LimitSample in_cell(const PatchPlace& place, const LimitSample& local) noexcept;

/// The outer sub-cell of a vertex cell at the path's level and child.
const CornerOperator::Child& sub_cell_of(const LimitSolid::Data& data, const LimitCell& cell,
                                         const PatchPath& path) noexcept;

PatchPlace find_patch(const LimitSolid::Data& data, const LimitCell& cell, const Vec3& uvw) noexcept;

/// Doubles a point when only positions count: padded by one, so that a point is one register.
inline constexpr std::size_t kPositionDimension = 4;

/// What visit_patches() leaves out: of a line (sub-)cell, or of a vertex cell beside its vertex.
struct PatchRest {
  PatchPath path;                  // Path to a sub-cell; `level`, `line_level`: how many were visited before it.
  std::uint32_t op = 0;            // That goes on, of a line.
  VertexWalk* vertex = nullptr;    // The walk that may go on, unless a line does.
  std::span<const double> points;  // Points of the ring, or of its four layers, kPositionDimension doubles each.

  /// Calls visit(point) for points, padded, whose hull holds the limit of what is left.
  template <typename Visit>
  void visit_hull(Visit visit) const noexcept {
    for (std::size_t i = 0; i < points.size(); i += kPositionDimension) visit(load_unaligned(&points[i]));
  }
};

/// Walks the operators and writes patches as 4 x 4 x 4 grids (phantoms filled) of `dimension` doubles a point:
/// positions alone, padded (kPositionDimension), or all that a control point holds (data.dimension).
class PatchBuilder {
 public:
  PatchBuilder(const LimitSolid::Data& data, std::size_t dimension);

  /// REQUIRES: `grid` holds 64 * dimension doubles.
  void build(const LimitCell& cell, const PatchPath& path, double* grid) noexcept;
  /// The limit at the irregular vertex of a vertex cell: `dimension` doubles. REQUIRES: dimension == data.dimension.
  void limit_at_vertex(const LimitCell& cell, double* out) noexcept;
  /// The limit at w on the irregular line of a line cell, or of the line sub-cell at the path.
  void limit_at_line(const LimitCell& cell, const PatchPath& path, double w, double* out) noexcept;

  /// The four layers of a line cell, or of the line sub-cell at the path: `dimension` doubles a point. Valid until the
  /// next call.
  std::span<const double> line_layers(const LimitCell& cell, const PatchPath& path) noexcept;

  /// Points whose hull holds what is left of a cell at a path: beside the irregular line of a line cell, or of the line
  /// sub-cell at the path, from level `line_level` on; or, if `child` is 0, of a vertex cell from level `level` on.
  /// kPositionDimension doubles each. Valid until the next call. REQUIRES: dimension == kPositionDimension.
  std::span<const double> points_of_rest(const LimitCell& cell, const PatchPath& path) noexcept;

  /// Tiles a cell down to `levels` levels at its irregular vertex, and `line_levels` along irregular lines, in one
  /// walk. Calls on_patch(path, grid) for each patch (`grid` may be overwritten), and on_rest(rest) for each part that
  /// remains. REQUIRES: dimension == kPositionDimension.
  template <typename OnPatch, typename OnRest>
  void visit_patches(const LimitCell& cell, int levels, int line_levels, OnPatch on_patch, OnRest on_rest);

  /// Looks for a part of the cell: true once on_patch(grid) is (`grid` may be overwritten), or once `levels` levels are
  /// left behind. Leaves out what depends on points for which may_hold(points, layers) is false: kPositionDimension
  /// doubles each; of a line (sub-)cell 4 layers, or else 1. REQUIRES: dimension == kPositionDimension.
  template <typename MayHold, typename OnPatch>
  bool any_patch(const LimitCell& cell, int levels, MayHold may_hold, OnPatch on_patch);

 private:
  /// The points that the cell's limit depends on; zeros in phantom layers.
  void gather(const LimitCell& cell, double* out) const noexcept;
  /// Has `walk_` at a level of a vertex cell. Goes on from the level met last.
  void walk_to(const LimitCell& cell, int level) noexcept;
  /// The sub-cell of a vertex cell: fills `a_` with its grid or layers.
  const CornerOperator::Child& descend_vertex(const LimitCell& cell, const PatchPath& path) noexcept;
  void fill_layers(std::uint32_t layer_points, PhantomMask phantoms) noexcept;
  std::uint32_t descend_line(std::uint32_t op, int levels) noexcept { return descend_line(op, levels, a_); }
  /// The four layers in `layers` -> those `levels` levels on. Returns their operator. Overwrites `b_`.
  std::uint32_t descend_line(std::uint32_t op, int levels, std::vector<double>& layers) noexcept;
  void finish_line(std::uint32_t op, std::uint8_t child, const std::vector<double>& layers, double* grid) noexcept;
  /// Copies a child's four layers from those of all children, which are in `b_`.
  void pick_layers(const PlanarOperator& line, const ChildRows& child, double* out) const noexcept;
  /// Has the four layers of a line cell or sub-cell in `line_layers_`; returns its operator.
  std::uint32_t load_line(const LimitCell& cell, const PatchPath& path) noexcept;
  /// Has the layers at a level of a line cell or sub-cell in `deep_layers_`; returns their operator. Goes on from the
  /// level met last.
  std::uint32_t walk_line_to(const LimitCell& cell, const PatchPath& path) noexcept;
  /// Does as load_line() does, and copies the layers to `a_`.
  std::uint32_t copy_line(const LimitCell& cell, const PatchPath& path) noexcept;
  /// The line cell or sub-cell whose layers are in `a_`.
  template <typename OnPatch, typename OnRest>
  void visit_line(PatchPath path, std::uint32_t op, int line_levels, OnPatch on_patch, OnRest on_rest);
  template <typename MayHold, typename OnPatch>
  bool any_patch_of_line(std::uint32_t op, int levels, MayHold may_hold, OnPatch on_patch);
  /// The points in `a_` of the layers of a line cell or sub-cell.
  std::span<const double> layers_of(std::uint32_t op) const noexcept {
    return std::span(a_).first(4 * data_.operators.lines()[op].points * dimension_);
  }

  const LimitSolid::Data& data_;
  std::size_t dimension_;
  std::vector<double> a_, b_;  // Ring points, ping and pong.
  // visit_patches():
  VertexWalk visited_;
  std::vector<double> grid_;

  // What was met last: patches of a cell, and of a line sub-cell, come together, by level.
  VertexWalk walk_;
  const LimitCell* walked_ = nullptr;
  int walked_level_ = 0;
  struct LoadedLine {
    const LimitCell* cell = nullptr;
    std::uint8_t level = 0, child = 0;
    std::uint32_t op = 0;
    std::uint32_t deep_op = 0;
    std::uint8_t deep_level = 0;
  };
  LoadedLine line_;
  std::vector<double> line_layers_;
  std::vector<double> deep_layers_;  // At deep_level. If that is 0, only line_layers_ counts.
};

template <typename OnPatch, typename OnRest>
void PatchBuilder::visit_line(PatchPath path, std::uint32_t op, int line_levels, OnPatch on_patch, OnRest on_rest) {
  for (int level = 0; level < line_levels; ++level) {
    const PlanarOperator& line = data_.operators.lines()[op];
    line.stencils.apply_to_layers(0, line.stencils.rows(), a_.data(), line.points, dimension_, b_.data());
    path.line_level = static_cast<std::uint8_t>(level);
    for (path.line_child = 1; path.line_child < 4; ++path.line_child) {
      const ChildRows& child = line.children[path.line_child];
      pick_layers(line, child, grid_.data());
      fill_phantoms(grid_.data(), 3, dimension_, child.phantoms);
      on_patch(path, grid_.data());
    }
    pick_layers(line, line.children[0], a_.data());
    op = line.children[0].op;
  }
  path.line_level = static_cast<std::uint8_t>(line_levels);
  path.line_child = 0;
  on_rest(PatchRest{path, op, nullptr, layers_of(op)});
}

template <typename OnPatch, typename OnRest>
void PatchBuilder::visit_patches(const LimitCell& cell, int levels, int line_levels, OnPatch on_patch, OnRest on_rest) {
  if (cell.cell_class == CellClass::kRegular) {
    build(cell, {}, grid_.data());
    on_patch(PatchPath{}, grid_.data());
    return;
  }
  if (cell.cell_class == CellClass::kLine) {
    visit_line({}, copy_line(cell, {}), line_levels, on_patch, on_rest);
    return;
  }
  gather(cell, visited_.start(cell.op).data());
  for (int level = 0; level < levels; ++level, visited_.descend()) {
    visited_.make_children();
    PatchPath path{static_cast<std::uint8_t>(level), 0, 0, 0};
    for (path.child = 1; path.child < 8; ++path.child) {
      const CornerOperator::Child& child = visited_.make_child(path.child, a_.data());
      if (child.cell_class == CellClass::kLine) {
        fill_layers(child.layer_points, child.phantoms);
        visit_line(path, child.op, line_levels, on_patch, on_rest);
      } else {
        fill_phantoms(a_.data(), 3, dimension_, child.phantoms);
        on_patch(path, a_.data());
      }
    }
  }
  on_rest(PatchRest{{static_cast<std::uint8_t>(levels), 0, 0, 0}, kNone, &visited_, visited_.points()});
}

template <typename MayHold, typename OnPatch>
bool PatchBuilder::any_patch_of_line(std::uint32_t op, int levels, MayHold may_hold, OnPatch on_patch) {
  for (int level = 0; may_hold(layers_of(op), 4); ++level, op = descend_line(op, 1)) {
    if (level == levels) return true;
    for (std::uint8_t child = 1; child < 4; ++child) {
      finish_line(op, child, a_, grid_.data());
      if (on_patch(grid_.data())) return true;
    }
  }
  return false;
}

template <typename MayHold, typename OnPatch>
bool PatchBuilder::any_patch(const LimitCell& cell, int levels, MayHold may_hold, OnPatch on_patch) {
  if (cell.cell_class == CellClass::kRegular) {
    build(cell, {}, grid_.data());
    return on_patch(grid_.data());
  }
  if (cell.cell_class == CellClass::kLine) return any_patch_of_line(copy_line(cell, {}), levels, may_hold, on_patch);
  gather(cell, visited_.start(cell.op).data());
  for (int level = 0; may_hold(visited_.points(), 1); ++level, visited_.descend()) {
    if (level == levels) return true;
    for (std::size_t number = 1; number < 8; ++number) {
      const CornerOperator::Child& child = visited_.make_child(number, a_.data());
      if (child.cell_class == CellClass::kLine) {
        fill_layers(child.layer_points, child.phantoms);
        if (any_patch_of_line(child.op, levels, may_hold, on_patch)) return true;
      } else {
        fill_phantoms(a_.data(), 3, dimension_, child.phantoms);
        if (on_patch(a_.data())) return true;
      }
    }
  }
  return false;
}

}  // namespace ccslice
