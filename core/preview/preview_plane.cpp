// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/preview_plane.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace ccslice {
namespace {

constexpr double kAxisSlack = 1e-6;

void require_size(std::uint32_t pixels, const char* field) {
  if (pixels >= 1 && pixels <= kMaxPreviewPixels) return;
  throw Error(ErrorCode::kPictureTooLarge,
              std::string(field) + ": a picture of " + std::to_string(pixels) + " pixels; give 1 to " +
                  std::to_string(kMaxPreviewPixels) + ", and larger ones by SliceRange",
              field);
}

void require_unit(const Vec3& axis, const char* field) {
  const double length = axis.norm();
  if (std::abs(length - 1) <= kAxisSlack) return;  // False for NaN.
  throw Error(ErrorCode::kPlaneInvalid,
              std::string(field) + ": a vector of length " + number_text(length) + "; give a unit vector", field);
}

}  // namespace

void validate_plane(const PreviewPlane& plane, const SliceLimits& limits) {
  require_size(plane.columns, "width");
  require_size(plane.rows, "height");
  if (!(plane.middle_mm.cwiseAbs().maxCoeff() <= limits.max_abs_coordinate_mm) || !plane.middle_mm.allFinite()) {
    throw Error(ErrorCode::kPlaneInvalid,
                "plane.free.middle_mm: not finite, or farther than " + number_text(limits.max_abs_coordinate_mm) +
                    " mm from the origin; move it to the part",
                "plane.free.middle_mm");
  }
  require_unit(plane.across, "plane.free.across");
  require_unit(plane.up, "plane.free.up");
  if (std::abs(plane.across.dot(plane.up)) > kAxisSlack) {
    throw Error(ErrorCode::kPlaneInvalid, "plane.free.up: not at right angles to plane.free.across; make it so",
                "plane.free.up");
  }
  validate_pitch({plane.across_mm, plane.up_mm, std::min(plane.across_mm, plane.up_mm)}, limits);
}

Mat3 frame_of(const PreviewPlane& plane) {
  Mat3 frame;
  frame.col(0) = plane.across.normalized();
  frame.col(1) = (plane.up - frame.col(0).dot(plane.up) * frame.col(0)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

Placement under_plane(const PreviewPlane& plane, const Placement& placement) {
  return Placement(frame_of(plane).transpose()) * placement;
}

Grid grid_of(const PreviewPlane& plane) {
  Grid grid;
  grid.pitch = {plane.across_mm, plane.up_mm, std::min(plane.across_mm, plane.up_mm)};
  grid.extent = {plane.columns, plane.rows, 1};
  const Vec3 size(plane.columns * grid.pitch.x_mm, plane.rows * grid.pitch.y_mm, grid.pitch.z_mm);
  grid.origin_mm = frame_of(plane).transpose() * plane.middle_mm - 0.5 * size;
  return grid;
}

PreviewPlane coarser(const PreviewPlane& plane, std::uint32_t times) {
  PreviewPlane result = plane;
  result.columns = (plane.columns + times - 1) / times;
  result.rows = (plane.rows + times - 1) / times;
  result.across_mm *= times;
  result.up_mm *= times;
  const double right = 0.5 * (result.columns * result.across_mm - plane.columns * plane.across_mm);
  const double down = 0.5 * (result.rows * result.up_mm - plane.rows * plane.up_mm);
  const Mat3 frame = frame_of(plane);
  result.middle_mm += right * frame.col(0) - down * frame.col(1);
  return result;
}

}  // namespace ccslice
