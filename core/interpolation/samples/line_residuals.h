// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What interpolation at a block's nodes leaves out beside an irregular line: RESIDUALS.
//
// In a line cell, and in a line sub-cell of a vertex cell, the limit is a planar scheme in (u, v) times a cubic
// B-spline in w. (Of sub-cells this is asked only if all is to be proved.) Let I interpolate at a block's 5 x 5 x 5
// nodes. Along w it leaves nothing of a cubic out; so of any function f that the scheme makes of control points (a
// coordinate or a channel, or a sum of such)
//
//   f - I f = sum_j a_j(u, v) r_j(w),    r_j(w) = (f - I f)(u_j, v_j, w).
//
// For the residuals of a box span a space of few dimensions, whatever the points are: one to ten or so, as many as
// there are j. The functions a_j, each 1 at its own place (u_j, v_j) and 0 at those of the others, depend on the
// operator and on the box, r_j on the control points. Places are chosen by cross approximation with full pivots. It
// ends where a billionth is left.
//
// |a_j| is bounded in parts of the 4 x 4 squares between the nodes. What a patch has of a square has degree 4 in u and
// v, so Bernstein coefficients bound it there. Towards the line patches get ever smaller; after some levels the rest
// lies in the hull of the ring's points at that level (the limit) and of Bernstein coefficients (its interpolation).
//
// r_j is a cubic: Bezier coefficients bound it between two nodes along w.
//
// Boxes that lie within half of the cell at the line are those of the cell's child, so squares are bounded once for all
// boxes that are alike but for a power of two.
//
// Private to the core.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "core/base/lanes.h"
#include "core/interpolation/samples/block_nodes.h"
#include "core/interpolation/samples/block_stencils.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// Between a block's nodes, along an axis.
inline constexpr int kBlockIntervals = kBlockNodes - 1;

/// A box of a line cell's parameters, or of those of a line sub-cell, in its frame: the line is u = v = 0.
struct LineBox {
  std::uint32_t op = 0;  // Of the line.
  PatchPath path;        // Of the sub-cell.
  Vec3 low, high;
  std::array<std::uint8_t, 3> axis;  // The block's axes of u, v and w,
  std::array<bool, 3> mirrored;      // and whether they run the other way.
};

/// The line (sub-)cell's part that the box is, if it lies in one.
std::optional<LineBox> find_line_box(const LimitSolid::Data& data, LimitCellId cell, const ParamBox& box);

/// A rectangle of planar parameters.
struct Rectangle {
  Eigen::Array2d low, high;

  bool is_empty() const { return !(low < high).all(); }
  Rectangle intersection(const Rectangle& other) const { return {low.max(other.low), high.min(other.high)}; }
  /// The n-th of 5 x 5 nodes, first axis first.
  Eigen::Array2d node(Eigen::Index n) const {
    const Eigen::Array2d at(static_cast<double>(n % kBlockNodes), static_cast<double>(n / kBlockNodes));
    return low + (high - low) * at / kBlockIntervals;
  }
};

/// What boxes of a planar scheme share that have this part of (u, v): its places and what is known of a_j. Immutable.
class PlanarResiduals {
 public:
  /// REQUIRES: it isn't empty, and lies between 0 and 1.
  PlanarResiduals(const OperatorTable& operators, std::uint32_t op, const Rectangle& box);

  /// False if the box is too thin to be told; then nothing else is known.
  bool known() const noexcept { return known_; }
  /// How many a_j there are.
  std::size_t count() const noexcept { return static_cast<std::size_t>(rows_.rows()); }
  /// What each of a ring's points weighs in the residual at each place.
  const Eigen::MatrixXd& rows() const noexcept { return rows_; }
  /// A part of the square between the nodes (i, k) and (i + 1, k + 1) of u and v.
  struct Part {
    std::size_t i, k;
    Eigen::Array2d low, high;  // As shares of the square.
    std::vector<double> most;  // |a_j| is no larger here, by j.
    bool small = false;        // It may be made of several patches' parts.
  };
  /// Together they cover the box.
  const std::vector<Part>& parts() const noexcept { return parts_; }
  std::size_t memory_bytes() const noexcept;

 private:
  void add_part(Eigen::Index square, const Rectangle& whole, const Rectangle& part, const std::vector<double>& most);

  bool known_ = false;
  Eigen::MatrixXd rows_;
  std::vector<Part> parts_;
};

/// A block's residuals.
struct BlockResiduals {
  /// r_j between two neighbouring nodes along w, its four Bezier coefficients; by interval.
  using AlongLine = std::array<Lanes, kBlockIntervals>;

  LineBox box;
  std::shared_ptr<const PlanarResiduals> planar;
  std::array<std::vector<AlongLine>, 3> position;  // By j. In mm, mesh frame.
  std::vector<std::vector<AlongLine>> values;      // By channel, then by j.
};

/// One thread. What is made for a box is kept as far as memory allows; results don't depend on it.
class LineResiduals {
 public:
  /// `most_bytes`: of what is kept, about. REQUIRES: data outlives this.
  LineResiduals(const LimitSolid::Data& data, std::vector<std::uint32_t> channels, std::size_t most_bytes = 8 << 20);

  /// False if the box doesn't lie in one line (sub-)cell, or is too thin.
  bool find(LimitCellId cell, const ParamBox& box, BlockResiduals& residuals);

 private:
  struct Known {
    std::shared_ptr<const PlanarResiduals> planar;
    Eigen::MatrixXd rows;  // Weights of the ring of the cell itself.
  };
  using Key = std::tuple<std::uint32_t, std::array<double, 4>>;

  const Known& known(const LineBox& box);
  std::shared_ptr<const PlanarResiduals> planar(std::uint32_t op, const Rectangle& box);
  void forget_beyond_most(std::size_t bytes);

  const LimitSolid::Data& data_;
  const std::vector<std::uint32_t> channels_;
  PatchBuilder builder_;
  std::map<Key, Known> known_;
  std::map<Key, std::shared_ptr<const PlanarResiduals>> planar_;
  const std::size_t most_bytes_;
  std::size_t bytes_ = 0;
};

}  // namespace ccslice
