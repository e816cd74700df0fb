// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Volumes within limit surfaces. By the divergence theorem a volume is the integral of z dx dy over its surface. Over a
// bicubic patch the integrand is a polynomial of degree 8 along s and t: 5 x 5 Gauss points integrate it exactly.
// Irregular faces are nests of such patches (boundary_surface.h), integrated down to kVolumeLevels levels. What remains
// at the origin is replaced by the cone from the irregular vertex's limit point over the two outer sides of what
// remains. A cone shares its other sides with those beside it, so the surface stays closed, and only the sliver between
// the cone and the limit is missing. On all tiny meshes and samples that is less than 2e-6 of the volume, and nothing
// where all faces are regular. A place that the solid covers twice counts twice, one that is turned inside out counts
// as negative.

#pragma once

#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// Levels of patches that are integrated towards an irregular vertex.
inline constexpr int kVolumeLevels = 6;

/// What each face adds to the volume within the faces that it closes with others, mm^3, in their order: whoever adds
/// them up does it in that order, whatever thread found which. `faces`: of the surface, from the first one on.
/// `levels`: at least 1. Takes about half a microsecond for a regular face and ten for an irregular one. Throws
/// Error{kCancelled}.
std::vector<double> face_fluxes_mm3(const BoundarySurface& surface, std::span<const BoundaryFace> faces, int levels,
                                    int threads, const CancellationToken& cancel);

/// Volume within the limit surface, mm^3; the same for any number of threads. A twentieth of what preparing the samples
/// takes, and less where there are many cells inside. Throws Error{kCancelled}.
double limit_volume_mm3(const BoundarySurface& surface, int levels = kVolumeLevels, int threads = 1,
                        const CancellationToken& cancel = {});

}  // namespace ccslice
