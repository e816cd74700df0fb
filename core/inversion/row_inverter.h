// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Point inversion of a row of equally spaced points, and the channels there.
//
// Within one regular patch the parameters along the row are a smooth curve q(t). Newton finds it at every eighth point
// (nodes), where the inverse Jacobian also gives its slope. Between two nodes q is guessed by the cubic Hermite
// polynomial, and corrected, four points at once, by q += N(t) (point - geo(q)) until the residual is accepted, where
// N is the inverse Jacobian interpolated between the nodes. One such correction usually does: the cost of a point is
// about two evaluations of the position. The patch's polynomials are followed a little beyond the patch; points that
// turn out to lie there are solved anew, in the cell and patch that hold them (point_inverter.h). So are all points
// near folds and overlaps, and beside irregular lines, where patches are smaller than the points' distance.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/inversion/point_inverter.h"
#include "core/limit/acceptance.h"
#include "core/limit/patch_lanes.h"
#include "core/limit/patch_path.h"

namespace ccslice {

/// Points from node to node.
inline constexpr std::uint32_t kRowStride = 8;

/// How a point was solved.
enum class RowPoint : std::uint8_t { kUnresolved, kCoherent, kFull };

/// A point of a row, numbered from its first one, where a patch was entered.
struct RowEntry {
  std::int64_t point;
  CellParam at;
};

/// What is known of each point of a row.
struct SolvedRow {
  std::vector<RowPoint> points;
  std::vector<double> values;     // channel_count a point; undefined where unresolved.
  std::optional<CellParam> last;  // The last resolved point's parameter.
  std::vector<RowEntry> entries;  // Ascending. The first one is the first resolved point.
  double max_residual_mm = 0;

  void reset(std::size_t count, std::size_t channels);
};

/// One solid, one thread, mesh frame.
class RowInverter {
 public:
  /// REQUIRES: inverter outlives this.
  RowInverter(PointInverter& inverter, const LimitSolid& solid, const InversionOptions& options);

  /// The points first + k * step, 0 <= k < count. `hint`: a parameter solved for a point near the first. `beside`:
  /// entries of a row beside this one, points numbered alike, ascending: where that one went on, so will this one.
  /// Throws Error{kCancelled}.
  void solve(const Vec3& first, const Vec3& step, std::uint32_t count, const std::optional<CellParam>& hint,
             std::span<const RowEntry> beside, const CancellationToken& cancel, SolvedRow& row);

 private:
  using LanePoint = std::array<Lanes, 3>;
  struct Node {
    std::uint32_t point;
    double residual_mm;
    Vec3 local;              // In the patch.
    Mat3 jacobian, inverse;  // By the patch's parameters.
    Vec3 slope;              // Change of `local` from point to point.
  };
  /// The patch at a place, and the inverse of its Jacobian there.
  struct Sample {
    LimitSample at;
    Mat3 inverse;
  };
  struct Guess {
    LanePoint point;  // To solve.
    LanePoint local;
    std::array<LanePoint, 3> inverse;
  };

  Sample sample(const Vec3& local) const;
  Vec3 point(std::uint32_t k) const { return first_ + static_cast<double>(k) * step_; }
  [[nodiscard]] std::optional<CellParam> enter(std::uint32_t k, const std::optional<CellParam>& hint, Node& node);
  void keep(const Node& node);
  [[nodiscard]] std::optional<CellParam> solve_alone(std::uint32_t k, const std::optional<CellParam>& hint);
  /// Solves from a node at the parameter `at` on, as far as its patch goes. Returns the number of points solved after
  /// it; `next` guesses the parameter of the point that follows.
  std::uint32_t march(Node from, const CellParam& at, CellParam& next);
  bool make_node(std::uint32_t k, const Vec3& guess, Node& node) const;
  bool make_node_from(std::uint32_t k, Sample sample, Vec3 local, Node& node) const;
  [[nodiscard]] bool solve_between(const Node& from, const Node& to);
  Guess guess_between(const Node& from, const Node& to, std::uint32_t begin) const;
  [[nodiscard]] bool correct(const Guess& guess, LanePoint& local);
  std::uint32_t keep_inside(std::uint32_t first, std::uint32_t count);
  Vec3 curve_point(std::uint32_t i) const;
  bool is_ambiguous(std::uint32_t from, std::uint32_t to) const;
  CellParam in_cell(const CellParam& at, const Vec3& local) const;
  CellParam hint_after(std::uint32_t k, const CellParam& at, const Vec3& local);

  PointInverter* inverter_;
  const LimitSolid* solid_;
  const InversionOptions options_;
  const Acceptance acceptance_;
  std::size_t channels_;
  std::uint32_t points_ = 0;  // That were begun with, ever.
  // The row at hand.
  Vec3 first_ = Vec3::Zero(), step_ = Vec3::Zero();
  std::uint32_t count_ = 0;
  SolvedRow* row_ = nullptr;
  std::span<const RowEntry> beside_;  // What is left of it.
  const Patch* patch_ = nullptr;
  PatchPlace place_;
  double accept_mm_ = 0;                              // In the patch.
  std::array<LanePoint, kRowStride / kLanes> curve_;  // Parameters in the patch of the points after a node.
};

}  // namespace ccslice
