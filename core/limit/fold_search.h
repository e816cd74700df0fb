// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The sign of det J all over a regular patch: proved, or disproved with a place.
//
// 1. J = J0 (I + E), with J0 taken at the middle and ||E|| bounded by the hulls of the derivative nets. If ||E|| < 1,
//    det J keeps the sign of det J0. This takes a microsecond and settles nearly every patch of a sane mesh, or its
//    eight halves.
// 2. For the other patches, det J itself is a polynomial of degree (8,8,8), in Bernstein form. Positive coefficients
//    prove that it is positive. Its corner coefficients are values, so a negative one is a fold with its place.
//    Otherwise it is halved where it varies most; the coefficients approach the values quadratically.
//
// A patch whose polynomial has been halved down to 1/kFinest along each axis, or for which the work granted has run
// out, stays undecided. So a fold that goes unreported is smaller than that, and lies in a patch that is undecided.

#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/types.h"

namespace ccslice {

/// Tricubic Bezier net, points padded to one register; index i + 4 j + 16 k. mm, mesh frame.
using BezierVolume = std::array<Eigen::Vector4d, 64>;

/// Writes the nets of the two halves along an axis.
void halve_net(const BezierVolume& net, std::size_t axis, BezierVolume& low, BezierVolume& high);
/// The Jacobian, about: columns from one end of the net to the other.
Mat3 edges_of(const BezierVolume& net) noexcept;

enum class FoldVerdict : std::uint8_t { kUnfolded, kUndecided, kFolds };

/// The place of the smallest determinant met. kFolds: it isn't positive.
struct FoldFinding {
  FoldVerdict verdict = FoldVerdict::kUnfolded;
  double determinant =
      std::numeric_limits<double>::infinity();  // The least determinant of the patch's own Jacobian, mm^3.
  Vec3 position = Vec3::Zero();                 // mm.
};

/// Reusable memory and the work that is left. One thread.
class FoldSearch {
 public:
  static constexpr int kFinest = 64;             // Parts along each axis.
  static constexpr int kHalvingsPerPatch = 512;  // Some hundred microseconds.
  static constexpr int kSetUpHalvings = 24;      // What a polynomial costs, in halvings.

  /// `halvings`: for all patches together; no more are spent.
  explicit FoldSearch(std::uint64_t halvings) : halvings_left_(halvings) {}
  /// Replaces what is left.
  void grant(std::uint64_t halvings) { halvings_left_ = halvings; }

  /// Noexcept but for memory.
  FoldFinding examine(const BezierVolume& net);
  /// The middle only: for a cell that is known to fold.
  static FoldFinding sample(const BezierVolume& net) noexcept;

 private:
  static constexpr std::size_t kCoefficients = 9 * 9 * 9;
  /// det J over a dyadic box of the patch.
  struct Part {
    std::array<double, kCoefficients> b;
    Vec3 low = Vec3::Zero(), size = Vec3::Ones();
    double least = 0;  // Coefficient.
  };
  void set_up(const BezierVolume& net);
  static void look_at_corners(const BezierVolume& net, const Part& part, double rounding, FoldFinding& finding);
  void search_polynomial(const BezierVolume& net, FoldFinding& finding);
  [[nodiscard]] bool halve_top();

  std::uint64_t halvings_left_;
  std::vector<Part> parts_;                             // A stack, deep as the halvings along all axes at most.
  std::array<std::array<double, 7 * 6 * 6>, 3> cross_;  // J_v x J_w by component.
};

}  // namespace ccslice
