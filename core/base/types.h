// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The few value types that every stage shares. Lengths are millimetres in double precision throughout.

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/base/ids.h"

namespace ccslice {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// world = placement * mesh. May rotate, translate, scale, shear and mirror; never singular once validated.
using Placement = Eigen::Transform<double, 3, Eigen::AffineCompact>;

using Box3 = Eigen::AlignedBox3d;

/// A parameter of the limit volume: limit cell i and (u,v,w) in [0,1]^3, in the cell's own frame [Luu19, 3].
struct CellParam {
  LimitCellId cell;
  Vec3 uvw = Vec3::Zero();
};

}  // namespace ccslice
