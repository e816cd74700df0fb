// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Regions of cells against each region as a solid of its own, whose contours know nothing of the others'.

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/contour/contour.h"
#include "core/limit/limit_solid.h"
#include "core/limit/support.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/slicing.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kToleranceMm = 1e-3;

class CellRegions : public testing::TestWithParam<std::size_t> {
 protected:
  const ControlMesh& mesh() const { return region_meshes()[GetParam()].mesh; }
  std::size_t region_count() const { return mesh().cell_region_names.size(); }
};

/// Shows the regions. Pitches: these shares of the box's diagonal.
SliceJob job_on(const LimitSolid& solid, const Vec3& shares, const Placement& placement = Placement::Identity()) {
  SliceJob job;
  job.placement = placement;
  const Vec3 pitch = bounding_box(solid, placement).diagonal().norm() * shares.cwiseInverse();
  GridRequest request;
  request.pitch = VoxelPitch{pitch.x(), pitch.y(), pitch.z()};
  job.grid = plan_grid(solid, placement, request);
  PlaneSpec& plane = job.planes.emplace_back();
  plane.content = PlaneContent::kCellRegions;
  plane.sample_type = SampleType::kUint8;
  plane.encoding = Encoding::kRaw;
  return job;
}

/// Raw floats of the first channels.
void add_channel_planes(const LimitSolid& solid, std::uint32_t count, SliceJob& job) {
  for (std::uint32_t c = 0; c < count; ++c) {
    PlaneSpec& plane = job.planes.emplace_back();
    plane.content = PlaneContent::kChannel;
    plane.channel = solid.summary().channels[c].name;
    plane.sample_type = SampleType::kFloat32;
    plane.encoding = Encoding::kRaw;
  }
}

/// Slices the mesh and compares each voxel with the contours of each region by itself.
void expect_voxels_on_their_sides(const ControlMesh& mesh) {
  const std::size_t regions = mesh.cell_region_names.size();
  const auto solid = prepare_solid(mesh);
  std::vector<std::shared_ptr<const LimitSolid>> parts;
  for (std::size_t r = 0; r < regions; ++r) {
    ControlMesh part = region_as_mesh(mesh, static_cast<int>(r));
    part.allow_folds = true;
    parts.push_back(prepare_solid(part));
  }
  Placement placement = Placement::Identity();
  placement.rotate(Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()));
  for (const Placement& place : {Placement::Identity(), placement}) {
    const SliceJob job = job_on(*solid, {131, 97, 23}, place);
    LayerSlicer slicer(solid, job);
    ContourOptions fine;
    fine.tolerance_mm = 0.1 * kToleranceMm;
    fine.smallest_feature_mm = job.grid.pitch.x_mm;
    std::vector<std::size_t> met(regions);
    for (std::uint32_t k = 0; k < job.grid.extent.layers; ++k) {
      const Layer layer = slicer.slice(k, {});
      SlicePlane plane;
      plane.origin = Vec3(0, 0, layer.z_mm);
      std::vector<std::vector<Polygon>> polygons;
      for (const auto& part : parts) polygons.push_back(polygons_of(intersect(*part, place, plane, fine)));
      for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
        for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
          const Vec2 centre = job.grid.lattice().centre(x, y, layer.z_mm).head<2>();
          const std::uint8_t number = layer.planes[0].bytes[std::size_t{job.grid.extent.columns} * y + x];
          for (std::size_t r = 0; r < regions; ++r) {
            const bool inside = winding_number(polygons[r], centre) != 0;
            met[r] += inside;
            if (inside == (number == r + 1)) continue;
            ASSERT_LE(distance_to(polygons[r], centre), 1.2 * kToleranceMm)
                << "voxel " << x << " " << y << " " << k << " is " << int{number} << ", region " << r;
          }
        }
      }
    }
    for (std::size_t r = 0; r < regions; ++r) EXPECT_GT(met[r], 100u) << "region " << r;
  }
}

TEST_P(CellRegions, NoVoxelIsOnTheWrongSide) { expect_voxels_on_their_sides(mesh()); }

TEST(CellRegionsOfRealMeshes, NoVoxelIsOnTheWrongSide) {
  std::size_t found = 0;
  for (const char* name : {"cylinder.ovm", "mountwithhole.vtk", "mixed_small.vtk"}) {
    SCOPED_TRACE(name);
    std::optional<ControlMesh> mesh = read_real_mesh(name);
    if (!mesh) continue;
    ++found;
    scale_to(50, *mesh);
    Box3 box;
    for (const Vec3& p : mesh->positions) box.extend(p);
    const double middle = box.center().x();
    expect_voxels_on_their_sides(
        with_regions(*std::move(mesh), 2, [=](const Vec3& p) { return p.x() < middle ? 0 : 1; }));
  }
  if (found == 0) GTEST_SKIP() << "no real meshes here";
}

TEST_P(CellRegions, VolumesAreThoseOfTheParts) {
  const auto solid = prepare_solid(mesh());
  const SolidSummary& summary = solid->summary();
  ASSERT_EQ(summary.cell_regions.size(), region_count());
  double sum = 0;
  for (std::size_t r = 0; r < region_count(); ++r) {
    ControlMesh part = region_as_mesh(mesh(), static_cast<int>(r));
    part.allow_folds = true;
    const double volume = prepare_solid(part)->summary().deviation.limit_volume_mm3;
    EXPECT_NEAR(summary.cell_regions[r].volume_mm3, volume, 1e-5 * volume);
    EXPECT_EQ(summary.cell_regions[r].control_cells, part.cell_count());
    sum += volume;
  }
  EXPECT_NEAR(sum, summary.deviation.limit_volume_mm3, 1e-5 * sum);
}

TEST_P(CellRegions, EveryVoxelTakesItsMaterialFromItsOwnPlace) {
  ControlMesh graded = mesh();
  graded.channel_names.clear();
  grade_by_coordinates(graded);
  const auto solid = prepare_solid(graded);
  SliceJob job = job_on(*solid, {61, 53, 29});
  job.planes.clear();
  job.planes.emplace_back().encoding = Encoding::kRaw;
  add_channel_planes(*solid, 3, job);
  SliceJob exact_job = job;
  exact_job.channel_tolerance = 0;
  LayerSlicer exact(solid, exact_job), interpolating(solid, job);
  for (std::uint32_t k = 0; k < job.grid.extent.layers; k += 1 + job.grid.extent.layers / 8) {
    const Layer layer = exact.slice(k, {}), fast = interpolating.slice(k, {});
    const LayerView view(job, layer), fast_view(job, fast);
    EXPECT_EQ(layer.stats.voxels_unresolved, 0u) << "layer " << k;
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        if (!view.inside(x, y)) continue;
        const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
        ASSERT_LT((place - view.centre(x, y)).norm(), 2e-3) << x << " " << y << " " << k;
        for (std::uint32_t c = 0; c < 3; ++c) {
          const ChannelRange& range = solid->summary().channels[c];
          ASSERT_NEAR(fast_view.channel(c, x, y), view.channel(c, x, y), (range.max - range.min) / 65536)
              << x << " " << y << " " << k;
        }
      }
    }
  }
}

// One channel is each region's number, the other the height above 1000 times that.
TEST_P(CellRegions, ChannelsJumpAtInterfaces) {
  constexpr double kStep = 1000;
  const ControlMesh jumping =
      with_jumping_channels(mesh(), {"region", "height"}, [&](std::uint32_t vertex, std::uint8_t region) {
        return std::vector<float>{static_cast<float>(region),
                                  static_cast<float>(mesh().positions[vertex].z() + kStep * region)};
      });
  const auto solid = prepare_solid(jumping);
  SliceJob job = job_on(*solid, {61, 53, 29});
  add_channel_planes(*solid, 2, job);
  SliceJob exact_job = job;
  exact_job.channel_tolerance = 0;
  LayerSlicer exact(solid, exact_job), interpolating(solid, job);
  const ChannelRange& heights = solid->summary().channels[1];
  const double tolerance = (heights.max - heights.min) / 65536;
  std::vector<std::size_t> met(region_count());
  for (std::uint32_t k = 0; k < job.grid.extent.layers; k += 1 + job.grid.extent.layers / 8) {
    const Layer layer = exact.slice(k, {}), fast = interpolating.slice(k, {});
    const LayerView view(job, layer), fast_view(job, fast);
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        const std::uint8_t number = layer.planes[0].bytes[std::size_t{job.grid.extent.columns} * y + x];
        if (number == 0) continue;
        ++met[number - 1u];
        ASSERT_NEAR(view.channel(0, x, y), number - 1, 1e-6) << x << " " << y << " " << k;
        ASSERT_NEAR(fast_view.channel(0, x, y), number - 1, 1e-5) << x << " " << y << " " << k;
        const double height = view.channel(1, x, y);
        ASSERT_NEAR(height - kStep * (number - 1), view.centre(x, y).z(), 2e-3) << x << " " << y << " " << k;
        ASSERT_NEAR(fast_view.channel(1, x, y), height, tolerance) << x << " " << y << " " << k;
      }
    }
  }
  for (const std::size_t count : met) EXPECT_GT(count, 100u);
}

TEST_P(CellRegions, SameBytesHoweverTheRangeIsSplit) {
  const auto solid = prepare_solid(mesh());
  const SliceJob job = job_on(*solid, {61, 53, 29});
  LayerSlicer upwards(solid, job);
  for (std::uint32_t k = 0; k < job.grid.extent.layers; ++k) {
    LayerSlicer alone(solid, job);
    EXPECT_EQ(upwards.slice(k, {}).planes[0].bytes, alone.slice(k, {}).planes[0].bytes) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, CellRegions, testing::Range<std::size_t>(0, region_meshes().size()),
                         [](const auto& info) { return region_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
