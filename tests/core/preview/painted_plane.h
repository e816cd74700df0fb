// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A plane through a solid as PlanePainter makes a layer of it, for the tests of what evaluates it.

#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "core/contour/contour.h"
#include "core/field/material_field.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_solid.h"
#include "core/preview/preview_plane.h"
#include "core/raster/occupancy.h"
#include "core/raster/region_runs.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/part_planes.h"

namespace ccslice {

/// All channels at `share` of the part's extent along a normal, to a share of their ranges.
struct PaintedPlane {
  PaintedPlane(std::shared_ptr<const LimitSolid> of, const Vec3& normal, double share, std::uint32_t pixels,
               double tolerance)
      : solid(std::move(of)) {
    const Box3& box = solid->summary().bounding_box;
    const Vec3 n = normal.normalized();
    PreviewPlane plane;
    plane.across = n.unitOrthogonal();
    plane.up = n.cross(plane.across);
    plane.middle_mm = box.center() + (share - 0.5) * n.cwiseAbs().dot(box.sizes()) * n;
    plane.across_mm = plane.up_mm = box.diagonal().norm() / pixels;
    plane.columns = plane.rows = pixels;
    layer.placement = under_plane(plane, Placement::Identity());
    layer.grid = grid_of(plane);
    layer.contour_tolerance_mm = 0.1 * plane.across_mm;
    layer.channel_tolerance = tolerance;
    for (std::uint32_t c = 0; c < solid->channel_count(); ++c) {
      PlaneSpec& spec_of_channel = layer.planes.emplace_back();
      spec_of_channel.content = PlaneContent::kChannel;
      spec_of_channel.sample_type = SampleType::kFloat32;
      spec_of_channel.channel = solid->summary().channels[c].name;
    }
    SlicePlane cut;
    cut.origin = Vec3(0, 0, layer.grid.layer_z_mm(0));
    const Contours contours =
        intersect(*solid, layer.placement, cut, {layer.contour_tolerance_mm, plane.across_mm, {}});
    lattice = layer.grid.lattice();
    spans = rasterize(contours, lattice);
    if (solid->has_several_regions()) regions = find_regions(contours.region_edges, spans, lattice);
    spec = interpolation_spec_of(layer, solid->summary().channels);
    field = make_material_field(solid, layer.placement, spec.outside_mm);
  }

  LayerTarget target(PartPlanes& planes) {
    planes.clear(window_of(lattice), {});
    return {lattice, layer.grid.layer_z_mm(0), planes.channels(), stats,
            cancel,  window_of(lattice),       window_of(lattice)};
  }

  std::shared_ptr<const LimitSolid> solid;
  SliceJob layer;
  LayerLattice lattice;
  std::vector<VoxelRun> spans;
  std::vector<RegionRun> regions;
  InterpolationSpec spec;
  std::unique_ptr<MaterialField> field;
  LayerStats stats;
  CancellationToken cancel;
};

}  // namespace ccslice
