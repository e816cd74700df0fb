// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/grid.h"

#include <array>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/job/validate_placement.h"
#include "core/limit/support.h"

namespace ccslice {
namespace {

constexpr double kRelativeSlack = 1e-9;

void validate_axis_pitch(double pitch_mm, const std::string& field, const SliceLimits& limits) {
  const auto refuse = [&](ErrorCode code, const std::string& fault) {
    throw Error(code, field + ": " + number_text(pitch_mm) + fault, field);
  };
  if (pitch_mm == 0) refuse(ErrorCode::kPitchInvalid, " or missing; give a positive length, 600 dpi is 0.0423 mm");
  if (!(std::isfinite(pitch_mm) && pitch_mm > 0)) {
    refuse(ErrorCode::kPitchInvalid, " is not a positive length; 600 dpi is 0.0423 mm");
  }
  if (pitch_mm < limits.min_pitch_mm) {
    refuse(ErrorCode::kPitchOutOfRange, " mm is below the smallest pitch, " + number_text(limits.min_pitch_mm) + " mm");
  }
  if (pitch_mm > limits.max_pitch_mm) {
    refuse(ErrorCode::kPitchOutOfRange, " mm is above the largest pitch, " + number_text(limits.max_pitch_mm) + " mm");
  }
}

// One axis of an extent.
struct GridAxis {
  const char* field;
  const char* pitch_field;
  std::uint32_t SliceLimits::*limit;
  ErrorCode too_large;
};

constexpr std::array<GridAxis, 3> kGridAxes = {{
    {"grid.extent.columns", "grid.pitch.x_mm", &SliceLimits::max_columns, ErrorCode::kGridTooLarge},
    {"grid.extent.rows", "grid.pitch.y_mm", &SliceLimits::max_rows, ErrorCode::kGridTooLarge},
    {"grid.extent.layers", "grid.pitch.z_mm", &SliceLimits::max_layers, ErrorCode::kGridTooManyLayers},
}};

void validate_count(double count, const GridAxis& axis, const SliceLimits& limits, const std::string& remedy) {
  if (count <= limits.*axis.limit) return;
  throw Error(axis.too_large,
              std::string(axis.field) + ": " + number_text(count) + " is more than the limit of " +
                  std::to_string(limits.*axis.limit) + "; " + remedy,
              axis.field);
}

// Voxels along one axis as a double: it may be far beyond any integer type.
double count_of_centres(double length_mm, double pitch_mm) {
  return std::max(1.0, std::floor(length_mm / pitch_mm * (1 + kRelativeSlack) + 0.5));
}

void validate_origin(const Vec3& origin_mm, const SliceLimits& limits) {
  const std::array<const char*, 3> fields = {"grid.origin_mm.x", "grid.origin_mm.y", "grid.origin_mm.z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double coordinate = origin_mm[static_cast<Eigen::Index>(axis)];
    const std::string field = fields[axis];
    if (!std::isfinite(coordinate)) {
      throw Error(ErrorCode::kGridOriginNonFinite, field + ": NaN or infinite; leave it out to anchor at the part",
                  field);
    }
    if (std::abs(coordinate) > limits.max_abs_coordinate_mm) {
      throw Error(ErrorCode::kGridOriginOutOfRange,
                  field + ": " + number_text(coordinate) + " mm from the world's origin, the limit is " +
                      number_text(limits.max_abs_coordinate_mm) + " mm; leave it out to anchor at the part",
                  field);
    }
  }
}

// The extent that covers the box from the origin up.
GridExtent extent_of_box(const Vec3& origin_mm, const Box3& box, const VoxelPitch& pitch, const SliceLimits& limits) {
  const std::array<double, 3> pitches = {pitch.x_mm, pitch.y_mm, pitch.z_mm};
  std::array<std::uint32_t, 3> counts{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto coordinate = static_cast<Eigen::Index>(axis);
    const double length_mm = box.max()[coordinate] - origin_mm[coordinate];
    const double count = count_of_centres(length_mm, pitches[axis]);
    const std::string remedy = std::string("use a ") + kGridAxes[axis].pitch_field + " of at least " +
                               number_text(1.001 * length_mm / (limits.*kGridAxes[axis].limit), 4) +
                               ", or give the extent";
    validate_count(count, kGridAxes[axis], limits, remedy);
    counts[axis] = static_cast<std::uint32_t>(count);
  }
  return {counts[0], counts[1], counts[2]};
}

}  // namespace

void validate_pitch(const VoxelPitch& pitch, const SliceLimits& limits) {
  validate_axis_pitch(pitch.x_mm, "grid.pitch.x_mm", limits);
  validate_axis_pitch(pitch.y_mm, "grid.pitch.y_mm", limits);
  validate_axis_pitch(pitch.z_mm, "grid.pitch.z_mm", limits);
}

void validate_extent(const GridExtent& extent, const SliceLimits& limits) {
  const std::array<std::uint32_t, 3> counts = {extent.columns, extent.rows, extent.layers};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string field = kGridAxes[axis].field;
    if (counts[axis] == 0) {
      throw Error(ErrorCode::kGridExtentZero, field + ": 0 or missing; a grid has at least one voxel each way", field);
    }
    validate_count(counts[axis], kGridAxes[axis], limits, "split the job");
  }
  const std::uint64_t voxels = std::uint64_t{extent.columns} * extent.rows;
  if (voxels > limits.max_voxels_per_layer) {
    throw Error(ErrorCode::kGridLayerTooLarge,
                "grid.extent: " + std::to_string(extent.columns) + " x " + std::to_string(extent.rows) + " = " +
                    std::to_string(voxels) + " voxels a layer are more than the limit of " +
                    std::to_string(limits.max_voxels_per_layer) + "; use a larger pitch or split the job",
                "grid.extent");
  }
}

void validate_place(const Grid& grid, const SliceLimits& limits) {
  if (!grid.part_box.isEmpty()) validate_placed_box(grid.part_box, limits);
  validate_origin(grid.origin_mm, limits);
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
               const SliceLimits& limits, const CancellationToken& cancel) {
  validate_placement(placement, limits);
  return plan_grid(bounding_box(solid, placement, cancel), request, limits);
}

}  // namespace ccslice
