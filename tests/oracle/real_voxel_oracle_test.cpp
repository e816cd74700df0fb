// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sampled layers of real meshes: every voxel's residual, occupancy against the literal winding number.

#include <gtest/gtest.h>

#include "core/slicer/layer_slicer.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/slicing.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

/// Voxels whose material comes from somewhere else than from within `allowed_mm` of their centre.
struct Residuals {
  std::uint64_t voxels = 0, unresolved = 0, beyond = 0;
  double worst_mm = 0;
};

void add_residuals(const LayerView& view, const Layer& layer, double allowed_mm, Residuals& residuals) {
  residuals.unresolved += layer.stats.voxels_unresolved;
  for (std::uint32_t y = 0; y < view.grid().extent.rows; ++y) {
    for (std::uint32_t x = 0; x < view.grid().extent.columns; ++x) {
      if (!view.inside(x, y)) continue;
      const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
      const double residual = (place - view.centre(x, y)).norm();
      ++residuals.voxels;
      residuals.beyond += residual > allowed_mm;
      residuals.worst_mm = std::max(residuals.worst_mm, residual);
    }
  }
}

class RealVoxels : public testing::TestWithParam<std::string> {};

TEST_P(RealVoxels, EveryVoxelTakesItsMaterialFromItsOwnPlace) {
  std::optional<ControlMesh> mesh = read_real_mesh_ungraded(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  mesh->channel_names.clear();
  grade_by_coordinates(*mesh);
  const Subject subject(*mesh);
  const SliceJob job = float_job(subject, 240);
  LayerSlicer slicer(subject.shared_solid(), job);
  Residuals residuals;
  const double allowed_mm = 1e-3 + job.contour_tolerance_mm;
  for (const double place : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const Layer layer = slicer.slice(static_cast<std::uint32_t>(place * job.grid.extent.layers), {});
    add_residuals(LayerView(job, layer), layer, allowed_mm, residuals);
    EXPECT_LE(layer.stats.max_residual_mm, allowed_mm);
  }
  RecordProperty("voxels", std::to_string(residuals.voxels));
  RecordProperty("unresolved", std::to_string(residuals.unresolved));
  RecordProperty("worst_residual_mm", std::to_string(residuals.worst_mm));
  EXPECT_GT(residuals.voxels, 1000u);
  EXPECT_EQ(residuals.beyond, 0u) << "worst " << residuals.worst_mm << " mm, unresolved " << residuals.unresolved;
}

TEST_P(RealVoxels, OccupancyIsTheWindingNumber) {
  const auto mesh = read_real_mesh_ungraded(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  SliceJob job = float_job(subject, 150);
  job.planes.resize(1);
  const Layer layer = LayerSlicer(subject.shared_solid(), job).slice(job.grid.extent.layers / 2, {});
  const LayerView view(job, layer);
  const std::vector<Polygon> polygons = polygons_of(layer.contours);
  for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
      const Vec2 centre = view.centre(x, y).head<2>();
      if (view.inside(x, y) == (winding_number(polygons, centre) != 0)) continue;
      EXPECT_LE(distance_to(polygons, centre), 1e-3) << "voxel " << x << " " << y;
    }
  }
}

class SharpRealVoxels : public testing::TestWithParam<std::string> {};

TEST_P(SharpRealVoxels, TakeTheirMaterialFromTheirOwnPlace) {
  std::optional<ControlMesh> mesh = read_real_mesh_ungraded(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  sharpen_by_cells(*mesh, 1);
  ASSERT_FALSE(mesh->sharp_edges.empty());
  mesh->channel_names.clear();
  grade_by_coordinates(*mesh);
  const Subject subject(*mesh);
  const SliceJob job = float_job(subject, 120);
  LayerSlicer slicer(subject.shared_solid(), job);
  Residuals residuals;
  for (const double place : {0.2, 0.6}) {
    const Layer layer = slicer.slice(static_cast<std::uint32_t>(place * job.grid.extent.layers), {});
    add_residuals(LayerView(job, layer), layer, 1e-3 + job.contour_tolerance_mm, residuals);
  }
  EXPECT_EQ(residuals.beyond, 0u) << "worst " << residuals.worst_mm << " mm, unresolved " << residuals.unresolved;
}

INSTANTIATE_TEST_SUITE_P(Samples, RealVoxels, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealVoxels, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealVoxels, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, RealVoxels, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, SharpRealVoxels, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, SharpRealVoxels, testing::ValuesIn(real_meshes_with_convex_edges()),
                         [](const auto& info) { return case_name(info.param); });

class RealMaterials : public testing::TestWithParam<std::string> {};

TEST_P(RealMaterials, AgreeWithAlgorithm1) {
  const auto mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  LimitSolidForAlgorithm1 solid(subject.solid(), brute_force_boxes(subject));
  const SliceJob job = float_job(subject, 100);
  LayerSlicer slicer(subject.shared_solid(), job);
  const Layer layer = slicer.slice(job.grid.extent.layers / 2, {});
  const Algorithm1Comparison result = compare_with_algorithm1(subject, solid, LayerView(job, layer));
  EXPECT_LT(result.worst, 1e-4);
  EXPECT_GT(result.compared, 9 * result.not_found);
  RecordProperty("compared", static_cast<int>(result.compared));
  RecordProperty("not_found_by_algorithm_1", static_cast<int>(result.not_found));
  RecordProperty("worst", std::to_string(result.worst));
}

INSTANTIATE_TEST_SUITE_P(Samples, RealMaterials, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealMaterials, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealMaterials, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, RealMaterials, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
