// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour.h"

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"

namespace ccslice {

Contours intersect(const LimitSolid& solid, const Placement& placement, const SlicePlane& plane,
                   const ContourOptions& options) {
  const Vec3 normal = plane.x_axis.cross(plane.y_axis);
  ContourTracer tracer(solid, std::make_shared<const ContourIndex>(solid, placement, normal));
  return tracer.trace(plane, options);
}

}  // namespace ccslice
