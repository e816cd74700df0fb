// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_slicer.h"
#include "core/job/validate_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "core/base/error.h"
#include "core/mesh_authoring/grade.h"
#include "core/models/models.h"
#include "core/output/encode.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

// A box of 24 x 16 x 8 mm with corner at the origin whose channels 0, 1, 2 are x, y and z in mm.
Solid box_of_coordinates() {
  ControlMesh mesh = make_box();
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  apply_grade(parse_grade("x=x:0..24"), mesh);
  apply_grade(parse_grade("y=y:0..16"), mesh);
  apply_grade(parse_grade("z=z:0..8"), mesh);
  return prepare_solid(std::move(mesh));
}

bool occupied(const SliceJob& job, const EncodedPlane& plane, std::uint32_t x, std::uint32_t y) {
  const std::size_t row_bytes = (job.grid.extent.columns + 7) / 8;
  return plane.bytes[row_bytes * y + x / 8] >> (7 - x % 8) & 1;
}

float float_at(const SliceJob& job, const EncodedPlane& plane, std::uint32_t x, std::uint32_t y) {
  float value;
  std::memcpy(&value, &plane.bytes[4 * (std::size_t{job.grid.extent.columns} * y + x)], sizeof value);
  return value;
}

Vec3 centre(const SliceJob& job, std::uint32_t x, std::uint32_t y, std::uint32_t layer) {
  const VoxelPitch& pitch = job.grid.pitch;
  return job.grid.origin_mm + Vec3((x + 0.5) * pitch.x_mm, (y + 0.5) * pitch.y_mm, (layer + 0.5) * pitch.z_mm);
}

// Slices every layer of a placed box of coordinates; each voxel must be inside or outside as the box says (but for
// those within 2 um of its surface), with its coordinates in the mesh frame as materials.
void expect_placed_box(const Placement& placement, const VoxelPitch& pitch, double value_tolerance) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, pitch, placement);
  job.planes = {occupancy(), channel(solid, 0, SampleType::kFloat32), channel(solid, 1, SampleType::kFloat32),
                channel(solid, 2, SampleType::kFloat32)};
  validate_job(*solid, job);
  LayerSlicer slicer(solid, job);
  const Placement mesh_of_world = placement.inverse(Eigen::Affine);
  std::uint64_t seen = 0;
  double worst = 0;
  for (std::uint32_t k = 0; k < job.grid.extent.layers; ++k) {
    const Layer layer = slicer.slice(k, {});
    EXPECT_EQ(layer.stats.voxels_unresolved, 0u);
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        const Vec3 p = mesh_of_world * centre(job, x, y, k);
        const double depth = std::min(p.minCoeff(), (Vec3(24, 16, 8) - p).minCoeff());
        const bool inside = occupied(job, layer.planes[0], x, y);
        seen += inside;
        if (std::abs(depth) > 2e-3) {
          ASSERT_EQ(inside, depth > 0) << p.transpose();
        }
        for (int axis = 0; axis < 3; ++axis) {
          const double value = float_at(job, layer.planes[1 + axis], x, y);
          const double expected = inside ? p[axis] : 0;
          worst = std::max(worst, std::abs(value - expected));
        }
      }
    }
    EXPECT_LE(layer.stats.max_residual_mm, 1e-3 + job.contour_tolerance_mm);
  }
  EXPECT_GT(seen, 1000u);
  EXPECT_LE(worst, value_tolerance);
}

TEST(SliceBox, ReproducesLinearGradientsAlongAllAxes) {
  expect_placed_box(Placement::Identity(), {0.37, 0.41, 0.53}, 1.5e-6);  // A float of 24 has steps of 1.9e-6.
}

TEST(SliceBox, ReproducesAUnitGradientToOneMillionth) {
  const Solid solid = prepare_solid(make_box());
  SliceJob job = job_of(solid, {0.1, 0.1, 1});
  LayerSlicer slicer(solid, job);
  const Layer layer = slicer.slice(3, {});
  ASSERT_EQ(layer.stats.voxels_inside, 240u * 160);
  for (std::uint32_t y = 0; y < 160; ++y) {
    for (std::uint32_t x = 0; x < 240; ++x) {
      ASSERT_NEAR(float_at(job, layer.planes[1], x, y), (x + 0.5) * 0.1 / 24, 1e-6);
    }
  }
}

TEST(SliceBox, FollowsARotation) {
  Placement placement = Placement::Identity();
  placement.rotate(Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()));
  placement.pretranslate(Vec3(100, -50, 3));
  expect_placed_box(placement, {0.6, 0.5, 0.9}, 3e-6);
}

TEST(SliceBox, FollowsScaleShearAndMirror) {
  Placement placement = Placement::Identity();
  placement.linear() << -1.5, 0.3, 0, 0, 0.8, 0.2, 0.1, 0, 2;
  ASSERT_LT(placement.linear().determinant(), 0);
  expect_placed_box(placement, {0.9, 0.4, 1.1}, 3e-6);
}

TEST(SliceBox, AQuarterTurnTurnsThePicture) {
  const Solid solid = box_of_coordinates();
  const SliceJob straight = job_of(solid, {0.5, 0.25, 1});
  Placement quarter = Placement::Identity();
  quarter.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const SliceJob turned = job_of(solid, {0.25, 0.5, 1}, quarter);
  ASSERT_EQ(turned.grid.extent.columns, straight.grid.extent.rows);
  const Layer a = LayerSlicer(solid, straight).slice(2, {});
  const Layer b = LayerSlicer(solid, turned).slice(2, {});
  EXPECT_EQ(a.stats.voxels_inside, b.stats.voxels_inside);
  for (std::uint32_t y = 0; y < straight.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < straight.grid.extent.columns; ++x) {
      const std::uint32_t x_turned = turned.grid.extent.columns - 1 - y;
      ASSERT_NEAR(float_at(straight, a.planes[1], x, y), float_at(turned, b.planes[1], x_turned, x), 3e-6);
    }
  }
}

TEST(SliceBox, LayersBesideThePartAreEmptyButThere) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, {1, 1, 1});
  job.grid.origin_mm.z() -= 2;
  job.grid.extent.layers += 4;
  LayerSlicer slicer(solid, job);
  for (const std::uint32_t k : {0u, 1u, 10u, 11u}) {
    const Layer layer = slicer.slice(k, {});
    EXPECT_EQ(layer.stats.voxels_inside, 0u);
    ASSERT_EQ(layer.planes.size(), 2u);
    EXPECT_EQ(layer.planes[1].raw_bytes, 24u * 16 * 4);
    EXPECT_THAT(layer.planes[1].bytes, testing::Each(0));
  }
  EXPECT_EQ(slicer.slice(2, {}).stats.voxels_inside, 24u * 16);
}

TEST(SliceBox, AGridMayCutThePart) {
  const Solid solid = box_of_coordinates();
  const SliceJob whole = job_of(solid, {0.5, 0.5, 1});
  SliceJob part = whole;
  part.grid.origin_mm += Vec3(10, 5, 0);
  part.grid.extent.columns = 60;
  part.grid.extent.rows = 7;
  const Layer a = LayerSlicer(solid, whole).slice(4, {});
  const Layer b = LayerSlicer(solid, part).slice(4, {});
  for (std::uint32_t y = 0; y < 7; ++y) {
    for (std::uint32_t x = 0; x < 60; ++x) {
      const float expected = x + 20 < 48 ? float_at(whole, a.planes[1], x + 20, y + 10) : 0;
      ASSERT_NEAR(float_at(part, b.planes[1], x, y), expected, 3e-6);
    }
  }
}

TEST(SliceBox, ContoursComeOnlyWhenAskedFor) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, {1, 1, 1});
  const Layer without = LayerSlicer(solid, job).slice(1, {});
  EXPECT_TRUE(without.contours.loops.empty());
  EXPECT_EQ(without.stats.contour_loops, 1u);
  job.contours = true;
  const Layer with = LayerSlicer(solid, job).slice(1, {});
  ASSERT_EQ(with.contours.loops.size(), 1u);
  EXPECT_EQ(with.contours.loops[0].points.size(), with.stats.contour_points);
  job.planes.clear();
  EXPECT_EQ(LayerSlicer(solid, job).slice(1, {}).contours.loops.size(), 1u);
}

TEST(SliceBox, OccupancyAloneInvertsNothing) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, {0.5, 0.5, 1});
  job.planes = {occupancy()};
  const LayerStats stats = LayerSlicer(solid, job).slice(1, {}).stats;
  EXPECT_EQ(stats.voxels_inside, 48u * 32);
  EXPECT_EQ(stats.voxels_interpolated + stats.voxels_coherent + stats.voxels_full + stats.voxels_unresolved, 0u);
}

TEST(SliceBox, SeveralChannelsTravelInOnePlane) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, {0.5, 0.5, 1});
  job.planes = {channel(solid, 0, SampleType::kFloat32), channel(solid, 0, SampleType::kFloat32), occupancy(),
                channel(solid, 2, SampleType::kFloat32)};
  job.planes[1].content = PlaneContent::kChannels;
  job.planes[1].channels = {job.planes[3].channel, job.planes[0].channel};
  validate_job(*solid, job);
  const Layer layer = LayerSlicer(solid, job).slice(3, {});
  const std::size_t voxels = std::size_t{job.grid.extent.columns} * job.grid.extent.rows;
  ASSERT_EQ(layer.planes[1].raw_bytes, 8 * voxels);
  for (std::size_t voxel = 0; voxel < voxels; ++voxel) {
    ASSERT_EQ(std::memcmp(&layer.planes[1].bytes[8 * voxel], &layer.planes[3].bytes[4 * voxel], 4), 0);
    ASSERT_EQ(std::memcmp(&layer.planes[1].bytes[8 * voxel + 4], &layer.planes[0].bytes[4 * voxel], 4), 0);
  }
}

TEST(SliceBox, EncodingsCarryTheSameSamples) {
  const Solid solid = box_of_coordinates();
  SliceJob job = job_of(solid, {0.5, 0.5, 1});
  job.planes.clear();
  for (const SampleType type : {SampleType::kUint8, SampleType::kUint16, SampleType::kFloat32}) {
    for (const Encoding encoding : {Encoding::kRaw, Encoding::kRawZstd, Encoding::kPng}) {
      if (!encoding_obstacle(type, encoding)) job.planes.push_back(channel(solid, 1, type, encoding));
    }
  }
  validate_job(*solid, job);
  const Layer layer = LayerSlicer(solid, job).slice(1, {});
  for (std::size_t i = 1; i < job.planes.size(); ++i) {
    if (job.planes[i].sample_type != job.planes[i - 1].sample_type) continue;
    EXPECT_EQ(layer.planes[i].crc32, layer.planes[i - 1].crc32);
    EXPECT_EQ(layer.planes[i].raw_bytes, layer.planes[i - 1].raw_bytes);
  }
  for (std::size_t i = 0; i < job.planes.size(); ++i) {
    if (job.planes[i].encoding != Encoding::kRaw) continue;
    EXPECT_EQ(layer.planes[i].crc32, crc32_of(layer.planes[i].bytes));
  }
}

class SliceRing : public testing::Test {
 protected:
  static void SetUpTestSuite() { solid_ = prepare_solid(make_ring()); }
  static void TearDownTestSuite() { solid_.reset(); }

  static SliceJob coarse_job() { return job_of(solid_, {0.9, 0.7, 0.71}); }

  static Solid solid_;
};

Solid SliceRing::solid_;

TEST_F(SliceRing, HasTheVoxelsOfTable2) {
  const Grid grid = job_of(solid_, {0.0423, 0.0846, 0.03}).grid;
  EXPECT_EQ(grid.extent.columns, 1975u);
  EXPECT_EQ(grid.extent.rows, 987u);
  EXPECT_EQ(grid.extent.layers, 576u);
}

TEST_F(SliceRing, StopsWithin100MsOfACancel) {
  SliceJob job = job_of(solid_, {0.02, 0.04, 0.03});
  job.planes.push_back(channel(solid_, 0, SampleType::kUint16, Encoding::kRawZstd));
  job.channel_tolerance = 0;  // Slow.
  LayerSlicer slicer(solid_, job);
  double best_ms = 1e9;
  for (int attempt = 0; attempt < 5 && best_ms > 100; ++attempt) {  // A busy machine may need several.
    const CancellationToken cancel = CancellationToken::make();
    std::chrono::steady_clock::time_point cancelled_at;
    std::jthread canceller([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20 + 10 * attempt));
      cancelled_at = std::chrono::steady_clock::now();
      cancel.cancel();
    });
    ErrorCode code{};
    try {
      slicer.slice(100, cancel);
    } catch (const Error& error) {
      code = error.code();
    }
    const auto stopped_at = std::chrono::steady_clock::now();
    canceller.join();
    ASSERT_EQ(code, ErrorCode::kCancelled);
    best_ms = std::min(best_ms, std::chrono::duration<double, std::milli>(stopped_at - cancelled_at).count());
  }
  EXPECT_LE(best_ms, 100);
}

TEST_F(SliceRing, ARangeEndsWithTheErrorOfItsReceiver) {
  const SliceJob job = coarse_job();
  int delivered = 0;
  const auto refuse_third = [&](Layer&&) {
    if (++delivered == 3) throw std::runtime_error("no more");
  };
  EXPECT_THROW(slice_range(solid_, job, 0, job.grid.extent.layers, refuse_third), std::runtime_error);
  EXPECT_EQ(delivered, 3);
}

TEST_F(SliceRing, ARangeDeliversInOrder) {
  const SliceJob job = coarse_job();
  std::vector<std::uint32_t> order;
  SliceRangeOptions options;
  options.threads = 3;
  slice_range(
      solid_, job, 3, 9, [&](Layer&& layer) { order.push_back(layer.index); }, options);
  EXPECT_THAT(order, testing::ElementsAre(3, 4, 5, 6, 7, 8, 9, 10, 11));
}

}  // namespace
}  // namespace ccslice
