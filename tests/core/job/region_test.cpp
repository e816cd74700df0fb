// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A region is a crop of the whole, to the bit, and flips are those of its pictures.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/job/region.h"
#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/output/encode.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kHigh = 40;  // Of some region of some layers.

Grid small_grid() {
  Grid grid;
  grid.origin_mm = Vec3(10, 20, 30);
  grid.pitch = {0.5, 0.25, 0.1};
  grid.extent = {8, 12, 20};
  return grid;
}

/// What `plan` throws.
template <typename Plan>
ErrorCode code_of(const Plan& plan, std::string* field) {
  try {
    plan();
  } catch (const Error& error) {
    if (field != nullptr) *field = error.field();
    EXPECT_NE(std::string(error.what()).find(error.field()), std::string::npos) << error.what();
    return error.code();
  }
  return ErrorCode{0};
}

ErrorCode code_of(const Box3& box_mm, std::string* field = nullptr) {
  return code_of([&] { region_of_box(small_grid(), box_mm); }, field);
}

ErrorCode code_of(const VoxelBox& region, std::string* field = nullptr) {
  return code_of([&] { validate_region(small_grid(), region); }, field);
}

Box3 box(const Vec3& low, const Vec3& high) {
  Box3 box_mm;
  box_mm.min() = low;
  box_mm.max() = high;
  return box_mm;
}

TEST(ValidateRegion, TakesVoxelsOfTheGrid) {
  EXPECT_EQ(code_of(VoxelBox{1, 2, 3, {7, 10, 17}}), ErrorCode{0});
  EXPECT_EQ((VoxelBox{1, 2, 3, {7, 10, 17}}.window()), (LayerWindow{1, 2, 7, 10}));
  EXPECT_EQ((VoxelBox{1, 2, 3, {7, 10, 17}}.end_layer()), 20u);
}

TEST(RegionOfBox, TakesTheVoxelsWhoseCentresAreInTheBox) {
  // Centres along x: 10.25, 10.75, 11.25, ...; the lower bound holds, the upper one doesn't.
  const VoxelBox region = region_of_box(small_grid(), box({10.25, 20.2, 30.05}, {11.25, 21.1, 30.26}));
  EXPECT_EQ(region.window(), (LayerWindow{0, 1, 2, 3}));
  EXPECT_EQ(region.first_layer, 0u);
  EXPECT_EQ(region.extent.layers, 3u);
}

TEST(RegionOfBox, LeavesOutWhatOfTheBoxIsOutsideOfTheGrid) {
  const VoxelBox region = region_of_box(small_grid(), box({0, 22, 31}, {100, 100, 100}));
  EXPECT_EQ(region.window(), (LayerWindow{0, 8, 8, 4}));
  EXPECT_EQ(region.first_layer, 10u);
  EXPECT_EQ(region.end_layer(), 20u);
}

TEST(RegionOfBox, CutsTheGridIntoBoxesThatShareNoVoxel) {
  const Grid grid = small_grid();
  for (double cut = 10.01; cut < 13.9; cut += 0.13) {
    const VoxelBox left = cut <= 10.25 ? VoxelBox{} : region_of_box(grid, box({10, 20, 30}, {cut, 23, 32}));
    const VoxelBox right = cut > 13.75 ? VoxelBox{8, 0, 0, {}} : region_of_box(grid, box({cut, 20, 30}, {14, 23, 32}));
    EXPECT_EQ(left.extent.columns, right.first_column) << cut;
    EXPECT_EQ(left.extent.columns + right.extent.columns, 8u) << cut;
  }
}

TEST(ValidateRegion, RefusesWhatIsNoRegionAndNamesTheField) {
  std::string field;
  EXPECT_EQ(code_of(VoxelBox{0, 0, 0, {1, 0, 1}}, &field), ErrorCode::kRegionEmpty);
  EXPECT_EQ(field, "region.voxels.extent.rows");
  EXPECT_EQ(code_of(VoxelBox{8, 0, 0, {1, 1, 1}}, &field), ErrorCode::kRegionOutOfGrid);
  EXPECT_EQ(field, "region.voxels.first_column");
  EXPECT_EQ(code_of(VoxelBox{0, 0, 19, {1, 1, 2}}, &field), ErrorCode::kRegionOutOfGrid);
  EXPECT_EQ(field, "region.voxels.extent.layers");
  EXPECT_EQ(code_of(VoxelBox{4'294'967'295u, 0, 0, {4'294'967'295u, 1, 1}}), ErrorCode::kRegionOutOfGrid);
}

TEST(RegionOfBox, RefusesBoxesThatAreNone) {
  std::string field;
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(code_of(box({10, nan, 30}, {11, 21, 31}), &field), ErrorCode::kRegionNonFinite);
  EXPECT_EQ(field, "region.box_mm.min_mm.y");
  EXPECT_EQ(code_of(box({10, 20, 30}, {11, 21, infinity}), &field), ErrorCode::kRegionNonFinite);
  EXPECT_EQ(field, "region.box_mm.max_mm.z");
  EXPECT_EQ(code_of(box({11, 20, 30}, {10, 21, 31}), &field), ErrorCode::kRegionEmpty);
  EXPECT_EQ(code_of(box({11, 20, 30}, {11, 21, 31})), ErrorCode::kRegionEmpty);
  EXPECT_EQ(code_of(box({10.3, 20, 30}, {10.4, 21, 31})), ErrorCode::kRegionEmpty);
  EXPECT_EQ(code_of(box({14, 20, 30}, {15, 21, 31})), ErrorCode::kRegionOutOfGrid);
  EXPECT_EQ(code_of(box({-1e300, 20, 30}, {10, 21, 31})), ErrorCode::kRegionOutOfGrid);
  EXPECT_EQ(field, "region.box_mm");
}

TEST(DropLoopsOutside, KeepsThoseWhoseBoxesMeetTheWindow) {
  const auto square = [](double x, double y, double size) {
    ContourLoop loop;
    for (const Vec2& corner : {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)}) {
      loop.points.emplace_back().xy = Vec2(x, y) + size * corner;
    }
    return loop;
  };
  Contours contours;
  contours.loops = {square(0, 0, 100), square(30, 30, 2), square(11, 21, 0.5), square(0, 0, 10.4)};
  const Grid grid = small_grid();
  drop_loops_outside({2, 2, 3, 3}, grid.lattice(), contours.loops);  // x 11 to 12.5, y 20.5 to 21.25.
  ASSERT_EQ(contours.loops.size(), 2u);
  EXPECT_EQ(contours.loops[1].points.front().xy, Vec2(11, 21));
}

/// A sample of a raw picture, whatever its type, as bytes.
std::string sample_at(const EncodedPlane& plane, SampleType type, std::size_t channels, std::uint32_t width,
                      std::uint32_t x, std::uint32_t y) {
  const std::size_t bits = type == SampleType::kBit      ? 1
                           : type == SampleType::kUint2  ? 2
                           : type == SampleType::kUint4  ? 4
                           : type == SampleType::kUint8  ? 8
                           : type == SampleType::kUint16 ? 16
                                                         : 32 * channels;
  const std::size_t row_bytes = (width * bits + 7) / 8, bit = x * bits, byte = y * row_bytes + bit / 8;
  if (bits >= 8) {
    const auto begin = plane.bytes.begin() + static_cast<std::ptrdiff_t>(byte);
    return {begin, begin + static_cast<std::ptrdiff_t>(bits / 8)};
  }
  return {static_cast<char>(plane.bytes[byte] >> (8 - bits - bit % 8) & ((1 << bits) - 1))};
}

/// Whether `part` is what region and order make of `whole`; both raw.
void expect_crop(const SliceJob& job, const Layer& part, const Layer& whole) {
  const VoxelBox& region = *job.region;
  for (std::size_t p = 0; p < job.planes.size(); ++p) {
    const PlaneSpec& plane = job.planes[p];
    const std::size_t channels = channel_count(plane);
    ASSERT_EQ(part.planes[p].bytes.size(),
              sample_bytes(plane.sample_type, region.extent.columns, region.extent.rows, channel_count(plane)));
    std::size_t differences = 0;
    for (std::uint32_t y = 0; y < region.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < region.extent.columns; ++x) {
        const std::uint32_t column = job.order.columns_descending ? region.extent.columns - 1 - x : x;
        const std::uint32_t row = job.order.rows_descending ? region.extent.rows - 1 - y : y;
        const std::string there = sample_at(whole.planes[p], plane.sample_type, channels, job.grid.extent.columns,
                                            region.first_column + column, region.first_row + row);
        const std::string here = sample_at(part.planes[p], plane.sample_type, channels, region.extent.columns, x, y);
        differences += here != there;
      }
    }
    EXPECT_EQ(differences, 0u) << "layer " << part.index << ", plane " << p;
  }
}

std::vector<Layer> slice(const Solid& solid, const SliceJob& job, std::uint32_t first, std::uint32_t count,
                         int threads = 1) {
  validate_job(*solid, job);
  std::vector<Layer> layers;
  SliceRangeOptions options;
  options.threads = threads;
  slice_range(
      solid, job, first, count, [&](Layer&& layer) { layers.push_back(std::move(layer)); }, options);
  return layers;
}

/// A smooth box, tilted: regular cells and irregular ones, painted by pieces, by tiles and voxel by voxel.
struct Engine {
  const char* name;
  std::optional<double> channel_tolerance;
  HalftoneMethod method;
};

class RegionOfABox : public testing::TestWithParam<Engine> {
 protected:
  RegionOfABox() {
    ControlMesh mesh = make_box();
    mesh.sharp_edges.clear();
    mesh.sharp_vertices.clear();
    solid_ = prepare_solid(mesh);
    Placement placement = Placement::Identity();
    placement.rotate(Eigen::AngleAxisd(0.4, Vec3(1, 2, -0.3).normalized()));
    job_ = job_of(solid_, {0.11, 0.045, 0.21}, placement);
    Printing printing;
    printing.materials = {{"soft", 0xff0000ff}, {"middle", 0x00ff00ff}, {"hard", 0x0000ffff}};
    printing.map.kind = BlendMap{"gradient", {{0, 1}, {0.5, 2}, {1, 3}}};
    printing.halftone = {GetParam().method, 5};
    job_.printing = printing;
    job_.channel_tolerance = GetParam().channel_tolerance;
    PlaneSpec materials;
    materials.content = PlaneContent::kMaterials;
    materials.sample_type = SampleType::kUint2;
    materials.encoding = Encoding::kRaw;
    PlaneSpec mask = occupancy();
    mask.content = PlaneContent::kMaterialMask;
    mask.material = 2;
    PlaneSpec all;
    all.content = PlaneContent::kChannels;
    all.channels = {"gradient"};
    all.sample_type = SampleType::kFloat32;
    all.encoding = Encoding::kRaw;
    job_.planes = {occupancy(),
                   channel(solid_, 0, SampleType::kUint8),
                   channel(solid_, 0, SampleType::kUint16),
                   channel(solid_, 0, SampleType::kFloat32),
                   all,
                   materials,
                   mask};
    first_ = job_.grid.extent.layers / 2 - 2;
    whole_ = slice(solid_, job_, first_, kLayers);
  }

  /// Regions at the middle, at the edges, across the places where rows start anew, and of single voxels.
  std::vector<VoxelBox> regions() const {
    const GridExtent& grid = job_.grid.extent;
    return {{grid.columns / 3, grid.rows / 3, first_, {grid.columns / 4, kHigh, kLayers}},
            {0, 0, first_, {17, grid.rows, kLayers}},
            {3, 100, first_, {grid.columns - 5, 60, kLayers}},
            {grid.columns / 2, 128, first_ + 1, {1, 1, 2}},
            {grid.columns / 2, grid.rows - 70, first_, {9, 70, kLayers}},
            {0, 0, 0, grid}};
  }

  static constexpr std::uint32_t kLayers = 3;
  Solid solid_;
  SliceJob job_;
  std::uint32_t first_ = 0;
  std::vector<Layer> whole_;
};

TEST_P(RegionOfABox, IsACropOfTheWhole) {
  for (const VoxelBox& region : regions()) {
    job_.region = region;
    const std::uint32_t first = std::max(first_, region.first_layer);
    for (const Layer& layer : slice(solid_, job_, first, std::min(kLayers, region.extent.layers))) {
      expect_crop(job_, layer, whole_[layer.index - first_]);
    }
  }
}

TEST_P(RegionOfABox, FlipsItsPictures) {
  job_.region = regions().front();
  for (const PictureOrder order : {PictureOrder{true, false}, PictureOrder{false, true}, PictureOrder{true, true}}) {
    job_.order = order;
    for (const Layer& layer : slice(solid_, job_, first_, kLayers)) {
      expect_crop(job_, layer, whole_[layer.index - first_]);
    }
  }
}

TEST_P(RegionOfABox, CountsWhatIsInIt) {
  job_.region = regions().front();
  for (const Layer& layer : slice(solid_, job_, first_, kLayers)) {
    std::uint64_t inside = 0;
    std::vector<std::uint64_t> materials(3);
    const GridExtent& extent = job_.region->extent;
    for (std::uint32_t y = 0; y < extent.rows; ++y) {
      for (std::uint32_t x = 0; x < extent.columns; ++x) {
        inside += sample_at(layer.planes[0], SampleType::kBit, 1, extent.columns, x, y)[0] == 1;
        const char material = sample_at(layer.planes[5], SampleType::kUint2, 1, extent.columns, x, y)[0];
        if (material > 0) ++materials[static_cast<std::size_t>(material - 1)];
      }
    }
    const LayerStats& stats = layer.stats;
    EXPECT_GT(inside, 0u);
    EXPECT_EQ(stats.voxels_inside, inside);
    EXPECT_EQ(stats.material_voxels, materials);
    EXPECT_EQ(stats.voxels_interpolated + stats.voxels_coherent + stats.voxels_full + stats.voxels_unresolved, inside);
  }
}

TEST_P(RegionOfABox, GivesTheSameBytesForAnySplit) {
  job_.region = regions()[2];
  job_.order.columns_descending = true;
  const std::vector<Layer> together = slice(solid_, job_, first_, kLayers, 2);
  for (std::uint32_t l = 0; l < kLayers; ++l) {
    const Layer alone = slice(solid_, job_, first_ + l, 1).front();
    EXPECT_EQ(alone.stats.max_residual_mm, together[l].stats.max_residual_mm);
    for (std::size_t p = 0; p < alone.planes.size(); ++p) EXPECT_EQ(alone.planes[p].bytes, together[l].planes[p].bytes);
  }
}

INSTANTIATE_TEST_SUITE_P(All, RegionOfABox,
                         testing::Values(Engine{"BlueNoise", std::nullopt, HalftoneMethod::kBlueNoise},
                                         Engine{"ErrorDiffusion", std::nullopt, HalftoneMethod::kErrorDiffusion},
                                         Engine{"Nearest", std::nullopt, HalftoneMethod::kLargestFraction},
                                         Engine{"WhiteNoise", std::nullopt, HalftoneMethod::kWhiteNoise},
                                         Engine{"BlueNoiseOfVoxelsInvertedOneByOne", 0.0, HalftoneMethod::kBlueNoise},
                                         Engine{"ErrorDiffusionOfVoxelsInvertedOneByOne", 0.0,
                                                HalftoneMethod::kErrorDiffusion}),
                         [](const testing::TestParamInfo<Engine>& info) { return info.param.name; });

TEST(Region, OfContoursKeepsLoopsThatMeetItWhole) {
  const Solid solid = prepare_solid(make_ring());
  SliceJob job = job_of(solid, {1.6, 1.3, 0.5});
  job.contours = true;
  const std::uint32_t layer = job.grid.extent.layers / 2;
  const Layer whole = slice(solid, job, layer, 1).front();
  job.region = VoxelBox{0, job.grid.extent.rows / 2, layer, {2, 2, 1}};
  const Layer part = slice(solid, job, layer, 1).front();
  ASSERT_EQ(whole.contours.loops.size(), 2u);
  ASSERT_EQ(part.contours.loops.size(), 1u) << "the outer one alone: the hole is far from the edge";
  EXPECT_EQ(part.stats.contour_loops, 1u);
  const auto is_the_same = [&](const ContourLoop& loop) {
    return std::ranges::equal(loop.points, part.contours.loops.front().points, {}, &ContourPoint::xy,
                              &ContourPoint::xy);
  };
  EXPECT_EQ(std::ranges::count_if(whole.contours.loops, is_the_same), 1);
}

}  // namespace
}  // namespace ccslice
