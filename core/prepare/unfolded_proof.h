// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Proves of nearly all cells of a sane mesh that they don't fold, eight at a time, before the others are searched one
// by one (find_folds.cpp): the same patches, and the same limits beside irregular lines and vertices.
//
// Cells with the same operator go through the same stencils, so eight of them fill the lanes of a register. Each is
// seen in the parameters of its own control points first, in floats: there all Jacobians of a sane cell are near to
// unit matrices, so one box holds those of the three patches of a level beside a line, or of a patch. If no matrix
// within such boxes is singular (net_lanes.h), all coefficients of det J are positive, as they are averages of
// determinants of these: a search would find the cell unfolded. What a float may lose widens the boxes.
//
// A cell that isn't proved to be unfolded may still be so. Cells with a sharp edge that the limit bends, beside which
// det J depends on the level, aren't tried.
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/limit/lane_box.h"
#include "core/limit/solid_data.h"
#include "core/prepare/line_folds.h"
#include "core/prepare/net_lanes.h"
#include "core/prepare/prepare_options.h"
#include "core/prepare/vertex_folds.h"

namespace ccslice {

/// One solid, one thread.
class UnfoldedProof {
 public:
  /// How many levels of patches are looked at: towards an irregular line or vertex, and along the lines of a vertex
  /// cell.
  struct Levels {
    int line, vertex, sub_line;
    int beside_vertex;  // The level that shows what all others there are like.
  };
  UnfoldedProof(const LimitSolid::Data& data, LineFolds& lines, const VertexFolds& vertices, const Levels& levels);

  /// Sets `proved`, by limit cell, of those of these cells that are proved to be unfolded, and counts them. The more
  /// cells there are, the fuller are the registers; those at one vertex should come together. Throws Error{kCancelled}.
  void examine(std::span<const LimitCellId> cells, const PrepareOptions& options, std::span<std::uint8_t> proved);

 private:
  /// At most one for each lane, of one class, with the same operator and phantom layers.
  using Batch = std::span<const LimitCellId>;

  /// Millimetres to a cell's parameters, about.
  struct View {
    Lanes origin{};
    LaneMap map{Mat3::Zero()};
  };
  /// Less the star's vertex, mm.
  using StarPoint = std::array<float, 3>;
  /// Where the points of a star are, level by level.
  struct StarLevels {
    std::uint32_t ring_begin;
    std::size_t begin;  // In star_points_.
  };

  std::uint64_t kind_of(const LimitCell& cell) const;
  void step_stars(std::span<const LimitCellId> cells);
  StarPoint* step_star(const LimitCell& cell, std::size_t levels, StarPoint* out);
  std::span<const StarPoint> star_points(const LimitCell& cell, int level) const;

  unsigned prove(Batch batch);
  unsigned prove_regular(Batch batch);
  unsigned prove_line(Batch batch);
  unsigned prove_vertex(Batch batch);
  /// The outer sub-cells of a level, whose points are in made_.
  unsigned prove_children(const CornerOperator& corner);
  /// The line cell or sub-cell whose four layers are in layers_: layers_[4 * p + layer].
  unsigned prove_line(std::uint32_t op, PhantomMask phantoms, int levels);
  unsigned prove_line_level(const PlanarOperator& line);
  unsigned prove_beside_line(std::uint32_t op);
  std::array<PointLanes, 4> line_curve(const Eigen::VectorXd& weights) const;
  unsigned prove_net(std::span<PointLanes> grid, PhantomMask phantoms) const;
  unsigned prove_middle(std::span<PointLanes> grid, PhantomMask phantoms) const;

  /// `origin(n)`: a control point of the n-th cell.
  template <typename Origin>
  void set_views(Batch batch, Origin origin);
  /// Has `count` points of the cells' rings, phantoms at the origin: out[p] is number index(p).
  template <typename Index>
  void load_rings(Batch batch, std::size_t count, Index index, PointLanes* out);
  /// `offset`: from the view's origin.
  void see(std::size_t lane, Lanes offset, PointLanes& out) const;
  /// What floats lose of these points, and of what is made of them, widens boxes.
  void set_slack(std::span<const PointLanes> points);

  // At a level of vertex cells columns_ holds the corner operator's shared points, its own, and the next shared ones.
  void load_shared(Batch batch, int level, PointLanes* out);
  void add_slack_of_stars(Batch batch);
  void load_next_shared(Batch batch, const CornerOperator& corner, int level);
  void descend(const CornerOperator& corner, bool made);

  const LimitSolid::Data& data_;
  LineFolds& lines_;
  const VertexFolds& vertices_;
  Levels levels_;
  std::vector<std::pair<std::uint64_t, LimitCellId>> order_;  // By kind.
  std::vector<StarLevels> stars_;                             // Ascending.
  std::vector<StarPoint> star_points_;
  std::vector<double> star_, next_star_;  // kLanes doubles a point.
  // What follows belongs to the batch at hand:
  std::array<View, kFloatLanes> views_;
  FloatLanes slack_{};
  std::array<std::vector<std::uint32_t>, kFloatLanes> shared_;  // Their numbers in the star.
  std::vector<std::uint32_t> next_shared_;
  std::vector<PointLanes> columns_, next_columns_, made_, layers_, made_layers_;
};

}  // namespace ccslice
