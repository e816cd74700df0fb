// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/preview/plane_painter.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/channel_functions.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

float chequers(const Vec3& mesh) {
  const auto parity = [](double x) { return static_cast<int>(std::floor(x / 1.7)) & 1; };
  return static_cast<float>(parity(mesh.x()) ^ parity(mesh.y()) ^ parity(mesh.z()));
}

/// A turned box of which a chequered half is cut out.
class CutTest : public testing::Test {
 protected:
  CutTest() {
    Placement placement = Placement::Identity();
    placement.rotate(Eigen::AngleAxisd(0.4, Vec3(1, 2, -0.3).normalized()));
    whole_ = job_of(solid_, {0.3, 0.25, 0.4}, placement);
    whole_.sources = {std::make_shared<ChannelFunction>(
        ChannelRange{"chequers", 0, 1}, std::vector<std::string>{},
        [](const Vec3&, const Vec3& mesh, std::span<const float>) { return chequers(mesh); })};
    PlaneSpec gradient = channel(solid_, 0, SampleType::kFloat32);
    gradient.outside_sample = -7;
    whole_.planes = {occupancy(), gradient};
    cut_ = whole_;
    cut_.cut = "chequers";
  }

  Layer sliced(const SliceJob& job, std::uint32_t layer) const {
    validate_job(*solid_, job);
    return LayerSlicer(solid_, job).slice(layer, {});
  }
  static std::vector<float> floats(const EncodedPlane& plane) {
    std::vector<float> values(plane.bytes.size() / sizeof(float));
    std::memcpy(values.data(), plane.bytes.data(), plane.bytes.size());
    return values;
  }
  bool inside(const EncodedPlane& plane, std::uint32_t x, std::uint32_t y) const {
    const std::size_t row_bytes = (whole_.grid.extent.columns + 7) / 8;
    return plane.bytes[row_bytes * y + x / 8] >> (7 - x % 8) & 1;
  }
  bool is_cut(std::uint32_t x, std::uint32_t y, std::uint32_t layer) const {
    const Vec3 world = whole_.grid.lattice().centre(x, y, whole_.grid.layer_z_mm(layer));
    return chequers(whole_.placement.inverse(Eigen::Affine) * world) > 0.5F;
  }
  static Printing two_materials() {
    Printing printing;
    printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x0000ffff}};
    printing.map.kind = BlendMap{"gradient", {{0, 1}, {1, 2}}};
    return printing;
  }

  const Solid solid_ = prepare_solid(make_box());
  SliceJob whole_, cut_;
  const std::uint32_t layer_ = 9;
};

TEST_F(CutTest, LeavesOtherVoxelsAsTheyAre) {
  const Layer before = sliced(whole_, layer_), after = sliced(cut_, layer_);
  const std::vector<float> all = floats(before.planes[1]), left = floats(after.planes[1]);
  std::uint64_t kept = 0, cut = 0;
  std::size_t voxel = 0;
  for (std::uint32_t y = 0; y < whole_.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < whole_.grid.extent.columns; ++x, ++voxel) {
      const bool is_inside = inside(before.planes[0], x, y), is_kept = is_inside && !is_cut(x, y, layer_);
      ASSERT_EQ(inside(after.planes[0], x, y), is_kept) << x << " " << y;
      ASSERT_EQ(left[voxel], is_kept ? all[voxel] : -7) << x << " " << y;
      kept += is_kept;
      cut += is_inside && !is_kept;
    }
  }
  EXPECT_GT(kept, 100u);
  EXPECT_GT(cut, 100u);
  EXPECT_EQ(after.stats.voxels_inside, kept);
  EXPECT_EQ(after.stats.voxels_cut, cut);
  EXPECT_EQ(before.stats.voxels_cut, 0u);
  EXPECT_EQ(after.stats.voxels_interpolated + after.stats.voxels_coherent + after.stats.voxels_full +
                after.stats.voxels_unresolved,
            kept + cut);
}

TEST_F(CutTest, GivesTheSameBytesInAnySplitRegionAndNumberOfParts) {
  cut_.printing = two_materials();
  PlaneSpec& materials = cut_.planes.emplace_back();
  materials.content = PlaneContent::kMaterials;
  materials.sample_type = SampleType::kUint8;
  materials.encoding = Encoding::kRaw;
  const Layer whole = sliced(cut_, layer_);
  slice_range(solid_, cut_, layer_ - 4, 12,
              [&](Layer&& layer) {
                if (layer.index != layer_) return;
                for (std::size_t p = 0; p < 3; ++p) EXPECT_EQ(layer.planes[p].bytes, whole.planes[p].bytes);
              },
              {.threads = 3, .cancel = {}});
  const GridExtent& extent = cut_.grid.extent;
  SliceJob part = cut_;
  part.region = VoxelBox{7, 5, 0, {extent.columns - 12, extent.rows - 9, extent.layers}};
  const Layer cropped = sliced(part, layer_);
  std::uint64_t inside_voxels = 0;
  for (std::uint32_t y = 0; y < part.region->extent.rows; ++y) {
    for (std::uint32_t x = 0; x < part.region->extent.columns; ++x) {
      const std::size_t here = std::size_t{part.region->extent.columns} * y + x,
                        there = std::size_t{extent.columns} * (y + 5) + x + 7;
      ASSERT_EQ(cropped.planes[2].bytes[here], whole.planes[2].bytes[there]) << x << " " << y;
      inside_voxels += cropped.planes[2].bytes[here] != 0;
    }
  }
  EXPECT_EQ(cropped.stats.voxels_inside, inside_voxels);
  // A second part far away changes nothing, but takes the way of several.
  PlacedParts parts(2);
  for (PlacedPart& each : parts) {
    each.solid = solid_;
    each.job = cut_;
  }
  parts[1].job.placement.translation() += Vec3(1000, 0, 0);
  const Layer composed = LayerSlicer(parts).slice(layer_, {});
  for (std::size_t p = 0; p < 3; ++p) EXPECT_EQ(composed.planes[p].bytes, whole.planes[p].bytes) << p;
  EXPECT_EQ(composed.stats.voxels_cut, whole.stats.voxels_cut);
}

TEST_F(CutTest, OfEverythingLeavesAnEmptyLayer) {
  cut_.sources = {
      std::make_shared<ChannelFunction>(ChannelRange{"chequers", 1, 1}, std::vector<std::string>{},
                                        [](const Vec3&, const Vec3&, std::span<const float>) { return 1; })};
  const Layer layer = sliced(cut_, layer_);
  EXPECT_EQ(layer.stats.voxels_inside, 0u);
  EXPECT_EQ(layer.stats.voxels_cut, sliced(whole_, layer_).stats.voxels_inside);
}

TEST_F(CutTest, TakesAChannelOfTheSolid) {
  cut_.cut = "gradient";
  std::uint64_t left = 0, cut = 0;
  for (std::uint32_t layer = 0; layer < whole_.grid.extent.layers; ++layer) {
    const Layer before = sliced(whole_, layer), after = sliced(cut_, layer);
    const std::vector<float> all = floats(before.planes[1]);
    std::size_t voxel = 0;
    for (std::uint32_t y = 0; y < whole_.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < whole_.grid.extent.columns; ++x, ++voxel) {
        ASSERT_EQ(inside(after.planes[0], x, y), inside(before.planes[0], x, y) && all[voxel] <= kCutAbove);
      }
    }
    left += after.stats.voxels_inside;
    cut += after.stats.voxels_cut;
  }
  EXPECT_GT(cut, 0u);
  EXPECT_GT(left, 0u);
}

TEST_F(CutTest, OfAnUnknownChannelIsRefused) {
  cut_.cut = "chekkers";
  try {
    validate_job(*solid_, cut_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kChannelUnknown);
    EXPECT_EQ(error.field(), "cut");
  }
}

TEST_F(CutTest, IsShownByPreviews) {
  PreviewJob preview;
  preview.placement = whole_.placement;
  preview.plane.middle_mm = solid_->summary().bounding_box.center();
  preview.plane.across = Vec3::UnitX();
  preview.plane.up = Vec3::UnitY();
  preview.plane.across_mm = preview.plane.up_mm = 0.2;
  preview.plane.columns = preview.plane.rows = 100;
  preview.sources = whole_.sources;
  preview.show.content = PreviewContent::kChannel;
  preview.show.channel = "gradient";
  PlanePainter painter(solid_);
  const PreviewPicture before = painter.paint(preview, PreviewStage::kFull, {});
  preview.cut = "chequers";
  const PreviewPicture after = painter.paint(preview, PreviewStage::kFull, {});
  ASSERT_EQ(after.rgba.size(), before.rgba.size());
  std::uint64_t kept = 0;
  for (std::size_t i = 3; i < after.rgba.size(); i += 4) {
    ASSERT_TRUE(after.rgba[i] == 0 || before.rgba[i] != 0);
    kept += after.rgba[i] != 0;
  }
  EXPECT_EQ(after.pixels_inside, kept);
  EXPECT_GT(kept, before.pixels_inside / 4);
  EXPECT_LT(kept, before.pixels_inside * 3 / 4);
  preview.show.printing = std::make_shared<const Printing>(two_materials());
  preview.voxels = whole_.grid;
  for (const PreviewContent content : {PreviewContent::kOccupancy, PreviewContent::kMix, PreviewContent::kHalftone}) {
    preview.show.content = content;
    EXPECT_EQ(painter.paint(preview, PreviewStage::kFull, {}).pixels_inside, kept);
    EXPECT_GT(painter.paint(preview, PreviewStage::kCoarse, {}).pixels_inside, 0u);
  }
}

TEST_F(CutTest, ThatLeavesTooManyRunsIsRefused) {
  PlaneSpec spec;
  spec.content = PlaneContent::kChannel;
  spec.sample_type = SampleType::kFloat32;
  ContonePlane plane(spec, {"every second", 0, 1}, std::nullopt);
  const LayerWindow window{0, 0, 4096, 1024};
  plane.clear(window.columns, window.rows);
  std::vector<float> row(window.columns);
  for (std::uint32_t x = 0; x < window.columns; ++x) row[x] = static_cast<float>(x % 2);
  std::vector<VoxelRun> runs;
  for (std::uint32_t y = 0; y < window.rows; ++y) {
    plane.set_values(window.index(0, y), row);
    runs.push_back({y, 0, window.columns});
  }
  std::vector<VoxelRun> some(runs.begin(), runs.begin() + 3);
  const auto ignore = [](const VoxelRun&) {};
  cut_runs(plane, window, some, ignore, {});
  EXPECT_EQ(some.size(), 3u * window.columns / 2);
  try {
    cut_runs(plane, window, runs, ignore, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFieldInvalid);
    EXPECT_EQ(error.field(), "cut");
  }
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(cut_runs(plane, window, runs, ignore, cancel), Error);
}

}  // namespace
}  // namespace ccslice
