// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels that aren't the solid's go all the ways that its own go.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/preview/layer_painter.h"
#include "core/preview/plane_painter.h"
#include "core/slicer/slicer_memory.h"
#include "core/volume/volume_source.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/channel_functions.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

/// Half of the box's values and half a wave through the mesh.
float wave(const Vec3& mesh) { return static_cast<float>(0.5 + 0.5 * std::sin(0.7 * mesh.x() + 0.4 * mesh.y())); }

/// A turned box whose job has two channels more: "wave", of the place in the mesh, and "mean", of it and of the solid's
/// "gradient".
class ChannelSourcesTest : public testing::Test {
 protected:
  ChannelSourcesTest() {
    Placement placement = Placement::Identity();
    placement.rotate(Eigen::AngleAxisd(0.4, Vec3(1, 2, -0.3).normalized()));
    job_ = job_of(solid_, {0.3, 0.25, 0.4}, placement);
    job_.sources = {
        std::make_shared<ChannelFunction>(
            ChannelRange{"wave", 0, 1}, std::vector<std::string>{},
            [](const Vec3&, const Vec3& mesh, std::span<const float>) { return wave(mesh); }),
        std::make_shared<ChannelFunction>(
            ChannelRange{"mean", 0, 1}, std::vector<std::string>{"gradient", "wave"},
            [](const Vec3&, const Vec3&, std::span<const float> inputs) { return (inputs[0] + inputs[1]) / 2; })};
    job_.planes = {occupancy()};
  }

  PlaneSpec plane_of(const std::string& name, SampleType type) const {
    PlaneSpec plane = channel(solid_, 0, type);
    plane.channel = name;
    return plane;
  }
  Printing blended(const std::string& channel) const {
    Printing printing;
    printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x0000ffff}};
    printing.map.kind = BlendMap{channel, {{0.2, 1}, {0.8, 2}}};
    printing.halftone = {HalftoneMethod::kErrorDiffusion, 5};
    return printing;
  }
  Layer sliced(std::uint32_t layer) const {
    validate_job(*solid_, job_);
    return LayerSlicer(solid_, job_).slice(layer, {});
  }
  std::vector<float> floats(const EncodedPlane& plane) const {
    std::vector<float> values(plane.bytes.size() / sizeof(float));
    std::memcpy(values.data(), plane.bytes.data(), plane.bytes.size());
    return values;
  }
  void expect_same_bytes() {
    job_.planes.push_back(plane_of("mean", SampleType::kFloat32));
    job_.printing = blended("mean");
    job_.planes.push_back(plane_of("", SampleType::kUint8));
    job_.planes.back().content = PlaneContent::kMaterials;
    for (const double tolerance : {0.0, 1.0 / 1024}) {
      job_.channel_tolerance = tolerance;
      const Layer whole = sliced(layer_);
      slice_range(solid_, job_, layer_ - 4, 12,
                  [&](Layer&& layer) {
                    if (layer.index != layer_) return;
                    for (std::size_t p = 0; p < 3; ++p) EXPECT_EQ(layer.planes[p].bytes, whole.planes[p].bytes);
                  },
                  {.threads = 3, .cancel = {}});
      SliceJob part = job_;
      const GridExtent& extent = job_.grid.extent;
      part.region = VoxelBox{7, 5, 0, {extent.columns - 12, extent.rows - 9, extent.layers}};
      const Layer cropped = LayerSlicer(solid_, part).slice(layer_, {});
      for (std::uint32_t y = 0; y < part.region->extent.rows; ++y) {
        const std::size_t from = std::size_t{extent.columns} * (y + 5) + 7,
                          to = std::size_t{part.region->extent.columns} * y;
        EXPECT_TRUE(
            std::equal(cropped.planes[2].bytes.begin() + static_cast<std::ptrdiff_t>(to),
                       cropped.planes[2].bytes.begin() + static_cast<std::ptrdiff_t>(to + part.region->extent.columns),
                       whole.planes[2].bytes.begin() + static_cast<std::ptrdiff_t>(from)))
            << y;
      }
    }
  }
  bool inside(const Layer& layer, std::uint32_t x, std::uint32_t y) const {
    const std::size_t row_bytes = (job_.grid.extent.columns + 7) / 8;
    return layer.planes[0].bytes[row_bytes * y + x / 8] >> (7 - x % 8) & 1;
  }
  Vec3 in_mesh(std::uint32_t x, std::uint32_t y, std::uint32_t layer) const {
    return job_.placement.inverse(Eigen::Affine) * job_.grid.lattice().centre(x, y, job_.grid.layer_z_mm(layer));
  }

  const Solid solid_ = prepare_solid(make_box());
  SliceJob job_;
  const std::uint32_t layer_ = 9;
};

TEST_F(ChannelSourcesTest, AreShownInPlanesOfAnyType) {
  job_.planes.push_back(plane_of("wave", SampleType::kUint8));
  job_.planes.push_back(plane_of("mean", SampleType::kFloat32));
  job_.planes.push_back(plane_of("gradient", SampleType::kFloat32));
  PlaneSpec all = plane_of("", SampleType::kFloat32);
  all.content = PlaneContent::kChannels;
  all.channels = {"mean", "gradient"};
  job_.planes.push_back(all);
  const Layer layer = sliced(layer_);
  const std::vector<float> means = floats(layer.planes[2]), own = floats(layer.planes[3]);
  const std::vector<float> both = floats(layer.planes[4]);
  std::size_t voxel = 0;
  for (std::uint32_t y = 0; y < job_.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job_.grid.extent.columns; ++x, ++voxel) {
      EXPECT_EQ(both[2 * voxel], means[voxel]);
      EXPECT_EQ(both[2 * voxel + 1], own[voxel]);
      if (!inside(layer, x, y)) {
        EXPECT_EQ(means[voxel], 0);
        continue;
      }
      const float expected = wave(in_mesh(x, y, layer_));
      EXPECT_NEAR(layer.planes[1].bytes[voxel], 255 * expected, 0.51);
      EXPECT_NEAR(means[voxel], (expected + own[voxel]) / 2, 1e-6);
    }
  }
}

TEST_F(ChannelSourcesTest, NeedNothingOfTheSolidIfTheyReadNothingOfIt) {
  job_.planes.push_back(plane_of("wave", SampleType::kFloat32));
  const LayerStats stats = sliced(layer_).stats;
  EXPECT_GT(stats.voxels_inside, 0u);
  EXPECT_EQ(stats.voxels_interpolated + stats.voxels_coherent + stats.voxels_full, 0u);
  EXPECT_GT(slicer_memory(solid_, job_).slicer_bytes, 0u);
}

TEST_F(ChannelSourcesTest, GiveTheSameBytesForAnyThreadsToleranceAndRegion) { expect_same_bytes(); }

/// Some samples have no value, and some of the part is outside.
TEST_F(ChannelSourcesTest, OfVolumesGiveTheSameBytesToo) {
  const Box3 box = solid_->summary().bounding_box;
  const ChannelSources sources = job_.sources;
  job_ = job_of(solid_, {0.3, 0.25, 0.4}, Placement::Identity());
  job_.sources = sources;
  for (const bool is_turned : {false, true}) {
    std::mt19937 random(9);
    const VolumeShape shape{.samples = {9, 8, 7}, .type = VolumeSampleType::kFloat32};
    std::vector<std::byte> bytes(shape.bytes());
    for (std::size_t s = 0; s < bytes.size() / sizeof(float); ++s) {
      const float sample =
          random() % 20 == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(random() % 1000) / 1000;
      std::memcpy(bytes.data() + s * sizeof(float), &sample, sizeof(float));
    }
    VolumeReading reading;
    reading.index_of_mm = Vec3(10, 9, 8).cwiseQuotient(box.sizes()).asDiagonal();
    if (is_turned) reading.index_of_mm *= Eigen::AngleAxisd(0.2, Vec3(3, 1, 2).normalized()).toRotationMatrix();
    reading.first_index = -(reading.index_of_mm * box.min());
    reading.outside_value = 0.5;
    job_.sources[0] = std::make_shared<VolumeSource>(ChannelRange{"wave", 0, 1},
                                                     std::make_shared<const Volume>(shape, bytes), reading);
    job_.planes = {occupancy()};
    expect_same_bytes();
  }
}

TEST_F(ChannelSourcesTest, AreMixedAndHalftoned) {
  job_.printing = blended("wave");
  job_.planes.push_back(plane_of("", SampleType::kUint8));
  job_.planes.back().content = PlaneContent::kMaterials;
  const Layer layer = sliced(layer_);
  std::uint64_t soft = 0, voxel = 0;
  for (std::uint32_t y = 0; y < job_.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job_.grid.extent.columns; ++x, ++voxel) {
      const float value = wave(in_mesh(x, y, layer_));
      if (!inside(layer, x, y) || (value > 0.19F && value < 0.81F)) continue;
      EXPECT_EQ(layer.planes[1].bytes[voxel], value < 0.5F ? 1 : 2);
      ++soft;
    }
  }
  EXPECT_GT(soft, 100u);
  EXPECT_GT(layer.stats.material_voxels[0], 0u);
  EXPECT_GT(layer.stats.voxels_off_map, 0u);
}

TEST_F(ChannelSourcesTest, AreShownInPicturesOfLayersAndOfPlanes) {
  PreviewColours show;
  show.content = PreviewContent::kChannel;
  show.channel = "wave";
  show.colours = ColourMapName::kGrey;
  show.range = ValueRange{0, 1};
  const PreviewPicture of_layer =
      LayerPainter({{"", solid_, layer_preview_job(job_, show, false)}}, show, {}).paint(layer_, {});
  PreviewJob plane;
  plane.placement = job_.placement;
  plane.sources = job_.sources;
  plane.show = show;
  const Grid& grid = job_.grid;
  plane.plane.columns = grid.extent.columns;
  plane.plane.rows = grid.extent.rows;
  plane.plane.across_mm = grid.pitch.x_mm;
  plane.plane.up_mm = grid.pitch.y_mm;
  plane.plane.middle_mm =
      grid.origin_mm + 0.5 * Vec3(grid.extent.columns * grid.pitch.x_mm, grid.extent.rows * grid.pitch.y_mm, 0);
  plane.plane.middle_mm.z() = grid.layer_z_mm(layer_);
  validate_preview(solid_->summary(), plane);
  const PreviewPicture of_plane = PlanePainter(solid_).paint(plane, PreviewStage::kFull, {});
  ASSERT_EQ(of_layer.rgba.size(), of_plane.rgba.size());
  EXPECT_NEAR(static_cast<double>(of_layer.pixels_inside), static_cast<double>(of_plane.pixels_inside), 20);
  std::size_t at = 0;
  for (std::uint32_t y = grid.extent.rows; y-- > 0;) {
    for (std::uint32_t x = 0; x < grid.extent.columns; ++x, at += 4) {
      const double grey = 255 * wave(in_mesh(x, y, layer_));
      for (const PreviewPicture* picture : {&of_layer, &of_plane}) {
        if (picture->rgba[at + 3] == 0) continue;
        EXPECT_NEAR(picture->rgba[at], grey, 1.1) << x << ", " << y;
      }
    }
  }
}

// A plane that isn't a layer: the points are the world's, whatever the picture's axes.
TEST_F(ChannelSourcesTest, AreSampledInTheWorldOfFreePlanes) {
  PreviewJob plane;
  plane.sources = {std::make_shared<ChannelFunction>(
      ChannelRange{"height", -100, 100}, std::vector<std::string>{},
      [](const Vec3& world, const Vec3&, std::span<const float>) { return static_cast<float>(world.z()); })};
  plane.show.content = PreviewContent::kChannel;
  plane.show.channel = "height";
  plane.show.colours = ColourMapName::kGrey;
  plane.show.range = ValueRange{0, 10};
  const Box3& box = solid_->summary().bounding_box;
  plane.plane.middle_mm = box.center();
  plane.plane.across = Vec3::UnitZ();
  plane.plane.up = Vec3::UnitX();
  plane.plane.across_mm = plane.plane.up_mm = 0.25;
  plane.plane.columns = plane.plane.rows = 60;
  const PreviewPicture picture = PlanePainter(solid_).paint(plane, PreviewStage::kFull, {});
  EXPECT_GT(picture.pixels_inside, 100u);
  for (std::uint32_t x = 0; x < 60; ++x) {
    const std::size_t at = std::size_t{4} * (60 * 30 + x);
    if (picture.rgba[at + 3] == 0) continue;
    EXPECT_NEAR(picture.rgba[at], 25.5 * (box.center().z() + 0.25 * (x + 0.5 - 30)), 1.1) << x;
  }
}

}  // namespace
}  // namespace ccslice
