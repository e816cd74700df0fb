// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cut_estimates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/contour/contour_tracer.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/limit/cell_index.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/channel_tolerances.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

using CellBoxes = std::vector<std::pair<LimitCellId, Box3>>;

Solid sample(const std::string& name) { return prepare_solid(find_sample_model(name)->make()); }

SliceJob fine_job_of(const Solid& solid, double columns) {
  const double length = solid->summary().bounding_box.sizes().x() / columns;
  return job_of(solid, {length, length, length});
}

/// Leaves of a kind of cell, and runs of their pieces.
struct Whole {
  double leaves = 0, runs = 0;
};

/// Cuts every cell to the end.
Whole cut_all(const Solid& solid, const InterpolationSpec& spec, const CellBoxes& cells) {
  CellFitter fitter(solid, spec);
  BlockRaster raster;
  std::vector<BlockRun> scanned;
  Whole whole;
  for (const auto& [cell, box] : cells) {
    std::vector<CellNode> nodes(1);
    nodes[0].bounds = Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
    for (std::uint32_t at = 0; at < nodes.size(); ++at) {
      fitter.examine(cell, nodes, at);
      if (nodes[at].kind == CellNode::Kind::kHalved) continue;
      ++whole.leaves;
      if (nodes[at].kind != CellNode::Kind::kPiece) continue;
      const GridExtent& extent = spec.grid.extent;
      scanned.clear();
      raster.scan(nodes[at].piece->points, nodes[at].piece->step, {extent.columns, extent.rows, 0, extent.layers},
                  scanned);
      whole.runs += static_cast<double>(scanned.size());
    }
  }
  return whole;
}

TEST(CutCells, TellsAboutWhatCuttingAllCellsMakes) {
  for (const char* name : {"ring", "engine", "grid"}) {
    const Solid solid = sample(name);
    const SliceJob job = fine_job_of(solid, 150);
    const InterpolationSpec spec = interpolation_spec_of(job, solid->summary().channels);
    CutCells cutter(solid, spec);
    for (const bool regular : {true, false}) {
      CellBoxes cells;
      double rows = 0;
      for (const LimitCellId cell : solid->cells()) {
        if ((solid->cell_class(cell) == CellClass::kRegular) != regular || cells.size() == 400) continue;
        const Box3 box = solid->index().cell_boxes.box(cell).transformed(voxel_of_mesh(job.placement, job.grid));
        cells.emplace_back(cell, box);
        rows += box.sizes().cwiseMax(1).y() * box.sizes().cwiseMax(1).z();
      }
      const CutCells::Cut told = cutter.cut(cells, {});
      const Whole whole = cut_all(solid, spec, cells);
      const double count = static_cast<double>(cells.size());
      EXPECT_NEAR(told.leaves * count, whole.leaves, 0.5 * whole.leaves) << name;
      EXPECT_NEAR(told.runs * rows, whole.runs, 0.5 * whole.runs + 0.02 * rows) << name;
    }
  }
}

TEST(CutCells, TellsNothingOfNoCells) {
  const Solid solid = sample("ring");
  const SliceJob job = fine_job_of(solid, 60);
  CutCells cutter(solid, interpolation_spec_of(job, solid->summary().channels));
  const CutCells::Cut told = cutter.cut({}, {});
  EXPECT_EQ(told.leaves, 0);
  EXPECT_EQ(told.runs, 0);
}

TEST(CutFaces, TellsAboutWhatAllLayersMake) {
  for (const char* name : {"ring", "coyote", "engine"}) {
    const Solid solid = sample(name);
    const SliceJob job = fine_job_of(solid, 100);
    const BoundarySurface surface(*solid);
    CutFaces cutter(*solid, job);
    double points = 0, nodes = 0, crossings = 0;
    for (const bool regular : {true, false}) {
      std::vector<BoundaryFaceId> faces;
      double planes = 0, rows = 0;
      for (const BoundaryFaceId face : surface.face_ids()) {
        if (surface.faces()[face].regular != regular) continue;
        faces.push_back(face);
        const Vec3 size = surface.hull_box(face).transformed(job.placement).sizes();
        planes += size.z() / job.grid.pitch.z_mm;
        rows += size.z() / job.grid.pitch.z_mm * (size.y() / job.grid.pitch.y_mm + 1);
      }
      const CutFaces::Cut told = cutter.cut(faces, {});
      points += told.points * planes;
      crossings += told.rows * rows;
      nodes += told.nodes * static_cast<double>(faces.size());
      EXPECT_LE(told.visited, told.nodes + (regular ? 1 : 64)) << name;
    }
    double traced = 0, crossed = 0;
    ContourTracer tracer(*solid, std::make_shared<const ContourIndex>(*solid, job.placement, Vec3::UnitZ()));
    ContourOptions options;
    options.tolerance_mm = job.contour_tolerance_mm;
    options.smallest_feature_mm = job.grid.pitch.x_mm;
    for (std::uint32_t layer = 0; layer < job.grid.extent.layers; ++layer) {
      SlicePlane plane;
      plane.origin = Vec3(0, 0, job.grid.layer_z_mm(layer));
      const Contours contours = tracer.trace(plane, options);
      for (const ContourLoop& loop : contours.loops) traced += static_cast<double>(loop.points.size());
      crossed += 2.0 * static_cast<double>(rasterize(contours, job.grid.lattice()).size());
    }
    EXPECT_GE(points, 0.7 * traced) << name;
    EXPECT_LE(points, 3 * traced) << name;
    EXPECT_GE(crossings, 0.7 * crossed) << name;
    EXPECT_LE(crossings, 3 * crossed) << name;
    EXPECT_GE(nodes, static_cast<double>(surface.faces().size())) << name;
  }
}

TEST(CutFaces, TellsNothingOfNoFaces) {
  const Solid solid = sample("ring");
  const SliceJob job = fine_job_of(solid, 60);
  EXPECT_EQ(CutFaces(*solid, job).cut({}, {}).nodes, 0);
}

TEST(CutEstimates, StopWhenCancelled) {
  const Solid solid = sample("ring");
  const SliceJob job = fine_job_of(solid, 60);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const std::vector<BoundaryFaceId> faces{BoundaryFaceId{0}};
  EXPECT_THROW((void)CutFaces(*solid, job).cut(faces, cancel), Error);
  const CellBoxes cells{{LimitCellId{0}, Box3(Vec3::Zero(), Vec3::Ones())}};
  CutCells cutter(solid, interpolation_spec_of(job, solid->summary().channels));
  EXPECT_THROW((void)cutter.cut(cells, cancel), Error);
}

}  // namespace
}  // namespace ccslice
