// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/validate_placement.h"

#include <Eigen/SVD>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace ccslice {
namespace {

constexpr double kSmallestScaleRatio = 1e-9;
constexpr int kShownDigits = 6;

std::string entry_name(int row, int column) { return "placement.matrix[" + std::to_string(4 * row + column) + "]"; }

[[noreturn]] void refuse(ErrorCode code, const std::string& field, const std::string& what) {
  throw Error(code, field + ": " + what, field);
}

void validate_entries(const Placement& placement) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      if (std::isfinite(placement(row, column))) continue;
      refuse(ErrorCode::kPlacementNonFinite, entry_name(row, column), "NaN or infinite; give finite numbers");
    }
  }
}

void validate_translation(const Vec3& translation_mm, const SliceLimits& limits) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(translation_mm[axis]) <= limits.max_abs_coordinate_mm) continue;
    refuse(ErrorCode::kPlacementOutOfRange, entry_name(axis, 3),
           "a translation of " + number_text(translation_mm[axis]) + " mm, the limit is " +
               number_text(limits.max_abs_coordinate_mm) + " mm; move the part closer");
  }
}

void validate_scales(const Mat3& linear, const SliceLimits& limits) {
  const double low = limits.min_placement_scale, high = limits.max_placement_scale;
  const std::string field = "placement.matrix";
  const std::string range = "scales run from " + number_text(low) + " to " + number_text(high);
  // Entries are no larger than the largest scale; what is far beyond would overflow in the decomposition.
  const double largest_entry = linear.cwiseAbs().maxCoeff();
  if (largest_entry > high) {
    refuse(ErrorCode::kPlacementOutOfRange, field, "scales by " + number_text(largest_entry) + "; " + range);
  }
  const Vec3 scales = Eigen::JacobiSVD<Mat3>(linear).singularValues();
  const std::string found =
      "smallest scale " + number_text(scales[2], kShownDigits) + ", largest " + number_text(scales[0], kShownDigits);
  if (!(scales[0] > 0 && scales[2] > kSmallestScaleRatio * scales[0])) {
    refuse(ErrorCode::kPlacementSingular, field, "singular (" + found + "); use an invertible affine transform");
  }
  if (scales[2] < low || scales[0] > high) {
    refuse(ErrorCode::kPlacementOutOfRange, field, "out of range (" + found + "); " + range);
  }
}

}  // namespace

void validate_placement(const Placement& placement, const SliceLimits& limits) {
  validate_entries(placement);
  validate_translation(placement.translation(), limits);
  validate_scales(placement.linear(), limits);
}

void validate_placed_box(const Box3& placed_box, const SliceLimits& limits) {
  const double largest = placed_box.min().cwiseAbs().cwiseMax(placed_box.max().cwiseAbs()).maxCoeff();
  if (largest <= limits.max_abs_coordinate_mm) return;
  refuse(ErrorCode::kPlacementOutOfRange, "placement",
         "puts the part " + number_text(largest) + " mm from the world's origin, the limit is " +
             number_text(limits.max_abs_coordinate_mm) + " mm; move it closer");
}

void validate_placement(const Placement& placement, const Box3& solid_box, const SliceLimits& limits) {
  validate_placement(placement, limits);
  Box3 placed;
  for (int corner = 0; corner < 8; ++corner) {
    placed.extend(placement * solid_box.corner(static_cast<Box3::CornerType>(corner)));
  }
  validate_placed_box(placed, limits);
}

}  // namespace ccslice
