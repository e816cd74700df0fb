// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers of real hex meshes, upright and tilted, with a channel that is linear in the mesh frame: then the value of
// every single voxel is known, to within its residual.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>

#include "core/base/read_file.h"
#include "core/job/validate_job.h"
#include "core/limit/support.h"
#include "core/mesh_authoring/grade.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {
namespace {

constexpr int kVoxelsAcross = 160;  // Of the longest side of the placed box.
constexpr std::uint32_t kLayersTested = 7;

struct GradedSolid {
  std::shared_ptr<const LimitSolid> solid;
  double x_first_mm = 0, x_last_mm = 0;  // The channel goes from 100 to 200 between these.

  double expected(const Vec3& mesh_point) const {
    return 100 + 100 * (mesh_point.x() - x_first_mm) / (x_last_mm - x_first_mm);
  }
};

GradedSolid prepare_graded(const std::string& path) {
  ControlMesh mesh = read_mesh(read_file_bytes(path, 1 << 24)).mesh;
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  apply_grade(parse_grade("x=x:100..200"), mesh);
  const auto by_x = [](const Vec3& a, const Vec3& b) { return a.x() < b.x(); };
  const auto [first, last] = std::minmax_element(mesh.positions.begin(), mesh.positions.end(), by_x);
  GradedSolid graded;
  graded.x_first_mm = first->x();
  graded.x_last_mm = last->x();
  graded.solid = prepare_solid(std::move(mesh));
  return graded;
}

SliceJob job_of(const LimitSolid& solid, const Placement& placement) {
  SliceJob job;
  job.placement = placement;
  const double pitch_mm = bounding_box(solid, placement).sizes().maxCoeff() / kVoxelsAcross;
  GridRequest request;
  request.pitch = {pitch_mm, pitch_mm, pitch_mm};
  job.grid = plan_grid(solid, placement, request);
  job.channel_tolerance = 0;
  job.planes.resize(2);
  job.planes[0].encoding = Encoding::kRaw;
  job.planes[1] = job.planes[0];
  job.planes[1].content = PlaneContent::kChannel;
  job.planes[1].channel = solid.summary().channels[0].name;
  job.planes[1].sample_type = SampleType::kFloat32;
  return job;
}

// Inside voxels whose value isn't that of a point within `tolerance_mm` of their centre.
std::uint64_t wrong_voxels(const SliceJob& job, const GradedSolid& graded, const Layer& layer, double tolerance_mm) {
  const Placement mesh_of_world = job.placement.inverse(Eigen::Affine);
  const double tolerance = tolerance_mm * 100 / (graded.x_last_mm - graded.x_first_mm) + 2e-5;
  const std::size_t row_bytes = (job.grid.extent.columns + 7) / 8;
  std::uint64_t wrong = 0;
  for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
      const bool inside = layer.planes[0].bytes[row_bytes * y + x / 8] >> (7 - x % 8) & 1;
      float value;
      std::memcpy(&value, &layer.planes[1].bytes[4 * (std::size_t{job.grid.extent.columns} * y + x)], sizeof value);
      const Vec3 offset((x + 0.5) * job.grid.pitch.x_mm, (y + 0.5) * job.grid.pitch.y_mm, 0);
      const Vec3 world(job.grid.origin_mm.x() + offset.x(), job.grid.origin_mm.y() + offset.y(), layer.z_mm);
      const double expected = inside ? graded.expected(mesh_of_world * world) : 0;
      wrong += !(std::abs(value - expected) <= tolerance);
      EXPECT_TRUE(!inside || value >= 99) << "inside, but without a material";
    }
  }
  return wrong;
}

void expect_good_layers(const GradedSolid& graded, const Placement& placement) {
  const SliceJob job = job_of(*graded.solid, placement);
  validate_job(*graded.solid, job);
  LayerSlicer slicer(graded.solid, job);
  std::uint64_t inside = 0, full = 0, unresolved = 0;
  double residual_mm = 0;
  for (std::uint32_t i = 0; i < kLayersTested; ++i) {
    const Layer layer = slicer.slice((2 * i + 1) * job.grid.extent.layers / (2 * kLayersTested), {});
    EXPECT_LE(layer.stats.max_residual_mm, 1e-3 + job.contour_tolerance_mm) << "layer " << layer.index;
    EXPECT_LE(wrong_voxels(job, graded, layer, layer.stats.max_residual_mm), layer.stats.voxels_unresolved)
        << "layer " << layer.index;
    inside += layer.stats.voxels_inside;
    full += layer.stats.voxels_full;
    unresolved += layer.stats.voxels_unresolved;
    residual_mm = std::max(residual_mm, layer.stats.max_residual_mm);
  }
  EXPECT_GT(inside, 0u);
  EXPECT_LE(unresolved, inside / 1000);
  std::printf("%llu voxels inside, %llu by the whole search, %llu unresolved, largest residual %.2g mm\n",
              static_cast<unsigned long long>(inside), static_cast<unsigned long long>(full),
              static_cast<unsigned long long>(unresolved), residual_mm);
}

class SliceRealMesh : public testing::TestWithParam<const char*> {
 protected:
  std::string path() const { return std::string(CCSLICE_SHARED_MESHES_DIR) + "/" + GetParam(); }
};

TEST_P(SliceRealMesh, GivesEveryVoxelItsMaterial) {
  if (!std::filesystem::exists(path())) GTEST_SKIP() << path() << " isn't there";
  const GradedSolid graded = prepare_graded(path());
  expect_good_layers(graded, Placement::Identity());
  Placement tilted = Placement::Identity();
  tilted.rotate(Eigen::AngleAxisd(0.9, Vec3(2, -1, 0.4).normalized()));
  expect_good_layers(graded, tilted);
}

std::string name_of(const testing::TestParamInfo<const char*>& info) {
  return std::filesystem::path(info.param).stem().string();
}

INSTANTIATE_TEST_SUITE_P(Meshes, SliceRealMesh,
                         testing::Values("bone_octree.vtk", "ellipsoid.mesh", "fertility_cmu.vtk",
                                         "joint_limit_folds.vtk", "lower_arm.vtk", "mountwithhole.vtk",
                                         "rockerarm_cinolib.mesh", "rod.vtk", "screw2.mesh"),
                         name_of);

}  // namespace
}  // namespace ccslice
