// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a placed solid is thinner than a printer's smallest feature.
//
// THICKNESS at a place of the boundary is how far one gets from there straight inwards before one is outside again. The
// solid is THIN there if that is less than `least` of the normal n, and if four more ways that lean from it by
// kLeanDeg are as short for their lean: a plate, a fin and a rod are thin in all of these directions, the flank of a
// blunt wedge beside its edge isn't. With
//
//   least(n) = max(mm, max over axes d of |n_d| voxels_mm_d)
//
// one number of mm stands for every direction; twice the pitch as voxels_mm means fewer than two voxels across, along
// the axis that sees least of them.
//
// Places are spread over the boundary's faces, kMostThinSamples of them at most: of a boundary of more faces every
// second or third is looked at, and so on, so a tiny feature there may be missed. What is inside is what point
// inversion finds, so the answers are those of the limit volume itself.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

inline constexpr std::uint32_t kMostThinSamples = 2048;
inline constexpr double kLeanDeg = 30;

/// The smallest feature that comes out right. Both 0: any.
struct SmallestFeature {
  double mm = 0;
  Vec3 voxels_mm = Vec3::Zero();

  /// `normal`: world frame, of length 1.
  double least_mm(const Vec3& normal) const;
};

struct ThinPlace {
  Vec3 position = Vec3::Zero();  // On the boundary, world mm.
  double thickness_mm = 0;       // To a thousandth of least_mm.
  double least_mm = 0;
  std::uint32_t control_cell = 0;
};

struct ThinFeatures {
  std::uint32_t samples = 0;      // Places that were looked at.
  std::vector<ThinPlace> places;  // The thin ones, the thinnest for its least first.
};

/// Throws Error{kCancelled}. REQUIRES: placement passes validate_placement().
ThinFeatures find_thin_features(const LimitSolid& solid, const Placement& placement, const SmallestFeature& smallest,
                                const CancellationToken& cancel = {});

}  // namespace ccslice
