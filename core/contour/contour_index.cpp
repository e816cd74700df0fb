// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_index.h"

#include <algorithm>
#include <limits>

#include "core/limit/boundary_surface.h"
#include "core/limit/support.h"

namespace ccslice {

double rounding_scale_mm(const LimitSolid& solid, const Placement& placement, const CancellationToken& cancel) {
  const Box3 box = bounding_box(solid, placement, cancel);
  const Box3& mesh_box = solid.summary().bounding_box;
  const double mesh_reach = mesh_box.min().cwiseAbs().cwiseMax(mesh_box.max().cwiseAbs()).norm();
  const double reach = placement.linear().norm() * mesh_reach + placement.translation().norm();
  return std::max(box.diagonal().norm(), 0.01 * reach);
}

ContourIndex::ContourIndex(const LimitSolid& solid, const Placement& placement, const Vec3& normal,
                           const CancellationToken& cancel)
    : ContourIndex(solid, placement, normal, rounding_scale_mm(solid, placement, cancel), cancel) {}

ContourIndex::ContourIndex(const LimitSolid& solid, const Placement& placement, const Vec3& normal, double scale_mm,
                           const CancellationToken& cancel)
    : placement_(placement), normal_(normal), mirrored_(placement.linear().determinant() < 0), scale_mm_(scale_mm) {
  PeriodicPoll poll(cancel);
  const BoundarySurface surface(solid);
  const Vec3 direction = placement.linear().transpose() * normal;
  const double offset = placement.translation().dot(normal);
  const IdRange<BoundaryFaceId> faces(surface.faces_and_interfaces().size());
  intervals_.reserve(faces.size());
  for (const BoundaryFaceId face : faces) {
    poll();
    const Box3& box = surface.hull_box(face);
    const double middle = direction.dot(box.center()) + offset;
    const double half = 0.5 * direction.cwiseAbs().dot(box.sizes());
    const double room = lift_mm() + 2 * margin_mm();
    intervals_.push_back({middle - half - room, middle + half + room, 0, face});
  }
  std::sort(intervals_.begin(), intervals_.end(),
            [](const Interval& a, const Interval& b) { return a.low != b.low ? a.low < b.low : a.face < b.face; });
  set_reach(0, intervals_.size());
}

double ContourIndex::set_reach(std::size_t begin, std::size_t end) {
  if (begin == end) return -std::numeric_limits<double>::infinity();
  const std::size_t middle = begin + (end - begin) / 2;
  const double below = set_reach(begin, middle), above = set_reach(middle + 1, end);
  return intervals_[middle].reach = std::max({below, above, intervals_[middle].high});
}

void ContourIndex::faces_at(double height_mm, std::vector<BoundaryFaceId>& faces) const {
  faces.clear();
  find(0, intervals_.size(), height_mm, faces);
  std::sort(faces.begin(), faces.end());
}

void ContourIndex::find(std::size_t begin, std::size_t end, double height_mm,
                        std::vector<BoundaryFaceId>& faces) const {
  if (begin == end) return;
  const std::size_t middle = begin + (end - begin) / 2;
  const Interval& interval = intervals_[middle];
  if (interval.reach < height_mm) return;
  find(begin, middle, height_mm, faces);
  if (interval.low > height_mm) return;
  if (interval.high >= height_mm) faces.push_back(interval.face);
  find(middle + 1, end, height_mm, faces);
}

}  // namespace ccslice
