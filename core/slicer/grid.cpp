// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/grid.h"

#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/slicer/number_text.h"

namespace ccslice {
namespace {

constexpr double kRelativeSlack = 1e-9;
constexpr double kSmallestScaleRatio = 1e-9;

void validate_axis_pitch(double pitch_mm, const std::string& field, const SliceLimits& limits) {
  std::string fault;
  if (!(std::isfinite(pitch_mm) && pitch_mm > 0)) {
    fault = " is not a positive length; 600 dpi is 0.0423 mm";
  } else if (pitch_mm < limits.min_pitch_mm) {
    fault = " mm is below the smallest pitch, " + number_text(limits.min_pitch_mm) + " mm";
  } else if (pitch_mm > limits.max_pitch_mm) {
    fault = " mm is above the largest pitch, " + number_text(limits.max_pitch_mm) + " mm";
  }
  if (!fault.empty()) throw Error(ErrorCode::kPitchInvalid, field + ": " + number_text(pitch_mm) + fault, field);
}

void validate_count(double count, double limit, const std::string& field, const std::string& remedy) {
  if (count <= limit) return;
  throw Error(ErrorCode::kGridTooLarge,
              field + ": " + number_text(count) + " is more than the limit of " + number_text(limit) + "; " + remedy,
              field);
}

// Voxels along one axis as a double: it may be far beyond any integer type.
double count_of_centres(double length_mm, double pitch_mm) {
  return std::max(1.0, std::floor(length_mm / pitch_mm * (1 + kRelativeSlack) + 0.5));
}

void validate_coordinates(const Vec3& point, const std::string& field, const std::string& remedy,
                          const SliceLimits& limits) {
  if (!point.allFinite()) throw Error(ErrorCode::kParameterInvalid, field + ": not finite; " + remedy, field);
  const double largest = point.cwiseAbs().maxCoeff();
  if (largest > limits.max_abs_coordinate_mm) {
    throw Error(ErrorCode::kGridTooLarge,
                field + ": " + number_text(largest) + " mm from the world's origin, the limit is " +
                    number_text(limits.max_abs_coordinate_mm) + " mm; " + remedy,
                field);
  }
}

// The extent that covers the box from the origin up.
GridExtent extent_of_box(const Vec3& origin_mm, const Box3& box, const VoxelPitch& pitch, const SliceLimits& limits) {
  const std::array<double, 3> pitches = {pitch.x_mm, pitch.y_mm, pitch.z_mm};
  const std::array<const char*, 3> fields = {"grid.extent.columns", "grid.extent.rows", "grid.extent.layers"};
  const std::array<const char*, 3> axes = {"x", "y", "z"};
  const std::array<std::uint32_t, 3> maxima = {limits.max_columns, limits.max_rows, limits.max_layers};
  std::array<std::uint32_t, 3> counts{};
  for (int axis = 0; axis < 3; ++axis) {
    const double length_mm = box.max()[axis] - origin_mm[axis];
    const double count = count_of_centres(length_mm, pitches[axis]);
    const std::string remedy = std::string("use a grid.pitch.") + axes[axis] + "_mm of at least " +
                               number_text(1.001 * length_mm / maxima[axis], 4) + ", or give the extent";
    validate_count(count, maxima[axis], fields[axis], remedy);
    counts[axis] = static_cast<std::uint32_t>(count);
  }
  return {counts[0], counts[1], counts[2]};
}

}  // namespace

void validate_placement(const Placement& placement) {
  const auto refuse = [](const std::string& what) {
    throw Error(ErrorCode::kPlacementSingular, "placement: " + what + "; use a finite, invertible affine transform",
                "placement");
  };
  if (!placement.matrix().allFinite()) refuse("an entry is not finite");
  const Vec3 scales = Eigen::JacobiSVD<Mat3>(placement.linear()).singularValues();
  if (!(scales[0] > 0 && std::isfinite(scales[0]) && scales[2] > kSmallestScaleRatio * scales[0])) {
    refuse("singular (its smallest scale is " + number_text(scales[2]) + ", its largest " + number_text(scales[0]) +
           ")");
  }
}

void validate_pitch(const VoxelPitch& pitch, const SliceLimits& limits) {
  validate_axis_pitch(pitch.x_mm, "grid.pitch.x_mm", limits);
  validate_axis_pitch(pitch.y_mm, "grid.pitch.y_mm", limits);
  validate_axis_pitch(pitch.z_mm, "grid.pitch.z_mm", limits);
}

void validate_extent(const GridExtent& extent, const SliceLimits& limits) {
  const auto validate_axis = [](std::uint32_t count, std::uint32_t limit, const std::string& field) {
    if (count == 0)
      throw Error(ErrorCode::kParameterInvalid, field + ": 0; a grid has at least one voxel each way", field);
    validate_count(count, limit, field, "split the job");
  };
  validate_axis(extent.columns, limits.max_columns, "grid.extent.columns");
  validate_axis(extent.rows, limits.max_rows, "grid.extent.rows");
  validate_axis(extent.layers, limits.max_layers, "grid.extent.layers");
  const std::uint64_t voxels = std::uint64_t{extent.columns} * extent.rows;
  if (voxels > limits.max_voxels_per_layer) {
    throw Error(ErrorCode::kGridTooLarge,
                "grid.extent: " + std::to_string(extent.columns) + " x " + std::to_string(extent.rows) + " = " +
                    std::to_string(voxels) + " voxels a layer are more than the limit of " +
                    std::to_string(limits.max_voxels_per_layer) + "; use a larger pitch or split the job",
                "grid.extent");
  }
}

void validate_place(const Grid& grid, const SliceLimits& limits) {
  if (!grid.part_box.isEmpty()) {
    validate_coordinates(grid.part_box.min(), "placement", "move the part closer", limits);
    validate_coordinates(grid.part_box.max(), "placement", "move the part closer", limits);
  }
  validate_coordinates(grid.origin_mm, "grid.origin_mm", "anchor the grid at the part", limits);
}

Grid plan_grid(const Box3& part_box, const GridRequest& request, const SliceLimits& limits) {
  validate_pitch(request.pitch, limits);
  Grid grid;
  grid.part_box = part_box;
  grid.pitch = request.pitch;
  grid.origin_mm = request.origin_mm.value_or(part_box.min());
  validate_place(grid, limits);
  grid.extent = request.extent ? *request.extent : extent_of_box(grid.origin_mm, part_box, request.pitch, limits);
  validate_extent(grid.extent, limits);
  return grid;
}

Grid plan_grid(const LimitSolid& solid, const Placement& placement, const GridRequest& request,
               const SliceLimits& limits) {
  validate_placement(placement);
  validate_pitch(request.pitch, limits);
  return plan_grid(solid.placed_bounding_box(placement), request, limits);
}

}  // namespace ccslice
