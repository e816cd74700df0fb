// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/point_probe.h"

#include <Eigen/SVD>
#include <utility>

#include "core/field/material_field.h"

namespace ccslice {
namespace {

InversionOptions probe_options(const Vec3& scales, double outside_mm) {
  InversionOptions result = inversion_options_of(scales, outside_mm);
  result.proves_outside = true;
  return result;  // Patches are used cell by cell: a small cache, which stays near, serves better than a large one.
}

}  // namespace

PointProbe::PointProbe(std::shared_ptr<const LimitSolid> solid, const Placement& placement, double outside_mm)
    : solid_(std::move(solid)),
      placement_(placement),
      mesh_of_world_(placement.inverse(Eigen::Affine)),
      scales_(Eigen::JacobiSVD<Mat3>(placement.linear()).singularValues()),
      inverter_(*solid_, probe_options(scales_, outside_mm)),
      channels_(solid_->channel_count()) {}

void PointProbe::probe(std::span<const Vec3> world, const OnFound& on_found, const CancellationToken& cancel) {
  points_.clear();
  for (const Vec3& point : world) points_.push_back(mesh_of_world_ * point);
  const auto add = [&](std::size_t point, const InversionResult& found) {
    const Vec3 position = placement_ * inverter_.evaluator().geo_and_mat(found.at, channels_);
    on_found(point, {found.at, (position - world[point]).norm(), scales_[0] * found.residual_mm, channels_});
  };
  inverter_.invert(points_, add, cancel);
}

}  // namespace ccslice
