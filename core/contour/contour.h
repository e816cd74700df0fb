// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours: the closed loops in which a plane cuts the limit surface [Luu19, 3.1], by the paper's adaptive method with
// a bound where the paper has a flatness threshold.
//
// A face is subdivided locally (its control net halved by de Casteljau's algorithm) until every leaf that the plane may
// meet is RESOLVED: each of its edges meets the plane at most once (its Bernstein coefficients have one sign, or are
// monotone) and its inside holds no closed loop (the height above the plane is monotone in some parameter direction);
// or until it is smaller than half a voxel. So no loop wider than a voxel is lost, at tops and saddles too. Where the
// height is monotone along s or t, the contour's arc through the leaf is followed in as many steps as the tolerance
// asks for (arc_tracer.h); other leaves are halved until the chord bound (|S_ss| + 2 |S_st| + |S_tt|) / 8 is below the
// tolerance. So every point of a polygon lies within the tolerance of the limit surface.
//
// The plane counts as infinitesimally above where it is asked for: a limit point whose height is zero is below. Faces
// in the plane, and vertices on it, thus give the contour of the solid just above. So that rounding can't contradict
// this, the plane is lifted by 1e-10 of the placed box's diagonal (contour_index.h).
//
// Every contour point is ON the limit surface and in the plane. Where contours pass from leaf to leaf it is the root of
// the height along the leaf's edge, found once per edge between two vertices of the leaf mesh, T-vertices of finer
// neighbours included, and shared by the leaves that meet there: loops are closed by construction.
//
// Interfaces of cell regions are traced with the boundary, each once for both regions. They share edges with it where
// they meet it, so that the contours of each region close as well.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// An oriented plane with 2-D coordinates: points origin + x * x_axis + y * y_axis. Axes orthonormal, world mm. Height
/// of a point = (point - origin) . (x_axis cross y_axis).
struct SlicePlane {
  Vec3 origin = Vec3::Zero();
  Vec3 x_axis = Vec3::UnitX();
  Vec3 y_axis = Vec3::UnitY();
};

struct ContourPoint {
  BoundaryFaceId face;  // The limit patch.
  double s = 0;         // Parameters of the point in that face's frame: the paper's (u,v).
  double t = 0;
  Vec2 xy = Vec2::Zero();  // In the plane's coordinates, mm.
};

/// Closed: the last point joins the first. Counter-clockwise round material when seen from above the plane, clockwise
/// round holes (mirrored placements included). At least three points.
struct ContourLoop {
  std::vector<ContourPoint> points;
  std::uint32_t part = 0;  // Of a layer of several parts: whose it is.
};

/// An edge of the contours of cell regions: of a loop or of an interface.
struct RegionEdge {
  Vec2 from = Vec2::Zero(), to = Vec2::Zero();  // In the plane's coordinates, mm.
  std::uint8_t left = kNoCellRegion;            // Seen along the edge from above the plane; kNoCellRegion outside.
  std::uint8_t right = kNoCellRegion;
};

struct Contours {
  std::vector<ContourLoop> loops;        // In a canonical order: same bytes on every run.
  std::vector<RegionEdge> region_edges;  // In no particular order; each region's close loops, to the last bit. Empty if
                                         // only one region has cells.
  std::size_t leaves = 0;                // Leaves that the plane meets.
  std::size_t unresolved_leaves = 0;     // Leaves that were accepted for their size only.
};

struct ContourOptions {
  double tolerance_mm = 1e-3;         // Largest distance polygon - limit surface, world mm.
  double smallest_feature_mm = 0.03;  // Loops wider than this are never lost: the smaller in-plane voxel pitch.
  CancellationToken cancel = {};
};

/// Intersects placement * limit surface with the plane. For many parallel planes: ContourTracer. Pure; the solid isn't
/// prepared again for any plane or placement. REQUIRES: placement invertible, tolerance and feature size positive.
/// Throws Error{kCancelled}, and {kInternal} if the surface contradicts itself so that no closed loops exist.
Contours intersect(const LimitSolid& solid, const Placement& placement, const SlicePlane& plane,
                   const ContourOptions& options);

}  // namespace ccslice
