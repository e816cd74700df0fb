// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/layer_painter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/printing/colour_gamut.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/cell_regions.h"

namespace ccslice {
namespace {

class LayerPainterTest : public testing::Test {
 protected:
  LayerPainterTest() {
    job_ = job_of(solid_, {0.4, 0.3, 0.35});
    auto printing = std::make_shared<Printing>();
    printing->materials = {{"soft", 0xff0000ff}, {"hard", 0x0000ffff}};
    printing->map.kind = BlendMap{"gradient", {{0, 1}, {1, 2}}};
    printing->halftone = {HalftoneMethod::kErrorDiffusion, 5};
    printing_ = printing;
    job_.printing = *printing_;
  }

  PreviewPicture paint(const PreviewColours& show, std::uint32_t layer, bool contours = false) {
    return LayerPainter({{"", solid_, layer_preview_job(job_, show, contours)}}, show, {}).paint(layer, {});
  }

  /// The bytes of a plane of the job's layer, as slicing gives them.
  std::vector<std::uint8_t> sliced(PlaneSpec plane, std::uint32_t layer) {
    SliceJob job = job_;
    job.planes = {std::move(plane)};
    return LayerSlicer(solid_, job).slice(layer, {}).planes.front().bytes;
  }

  const std::uint8_t* pixel(const PreviewPicture& picture, std::uint32_t column, std::uint32_t row) const {
    return &picture.rgba[std::size_t{4} * (std::size_t{picture.columns} * (picture.rows - 1 - row) + column)];
  }

  const Solid solid_ = prepare_solid(make_box());
  SliceJob job_;
  std::shared_ptr<const Printing> printing_;
};

TEST_F(LayerPainterTest, HalftonesAreTheLayersToTheBit) {
  PreviewColours show;
  show.content = PreviewContent::kHalftone;
  PlaneSpec materials = occupancy();
  materials.content = PlaneContent::kMaterials;
  materials.sample_type = SampleType::kUint8;
  const std::uint32_t layer = job_.grid.extent.layers / 2;
  const PreviewPicture picture = paint(show, layer);
  const std::vector<std::uint8_t> numbers = sliced(materials, layer);
  ASSERT_EQ(picture.columns, job_.grid.extent.columns);
  ASSERT_EQ(picture.rows, job_.grid.extent.rows);
  std::vector<std::uint64_t> counts(3);
  for (std::uint32_t row = 0; row < picture.rows; ++row) {
    for (std::uint32_t column = 0; column < picture.columns; ++column) {
      const std::uint8_t material = numbers[std::size_t{picture.columns} * row + column];
      const std::uint32_t colours[] = {0, 0xff0000ff, 0x0000ffff};
      const std::uint8_t* rgba = pixel(picture, column, row);
      const std::uint32_t shown = std::uint32_t{rgba[0]} << 24 | std::uint32_t{rgba[1]} << 16 |
                                  std::uint32_t{rgba[2]} << 8 | std::uint32_t{rgba[3]};
      ASSERT_EQ(shown, colours[material]) << column << ", " << row;
      ++counts[material];
    }
  }
  EXPECT_GT(counts[1], 0u);
  EXPECT_GT(counts[2], 0u);
  EXPECT_EQ(picture.material_pixels, (std::vector<std::uint64_t>{counts[1], counts[2]}));
  EXPECT_EQ(picture.pixels_inside, counts[1] + counts[2]);
}

TEST_F(LayerPainterTest, ChannelsAreTheLayersValues) {
  PreviewColours show;
  show.content = PreviewContent::kChannel;
  show.channel = "gradient";
  show.colours = ColourMapName::kGrey;
  show.range = ValueRange{0, 1};
  job_.region = VoxelBox{3, 2, 0, {job_.grid.extent.columns - 5, job_.grid.extent.rows - 4, job_.grid.extent.layers}};
  const std::uint32_t layer = 7;
  const PreviewPicture picture = paint(show, layer);
  const std::vector<std::uint8_t> values = sliced(channel(solid_, 0, SampleType::kFloat32), layer);
  const std::vector<std::uint8_t> bits = sliced(occupancy(), layer);
  const std::size_t row_bytes = (picture.columns + 7) / 8;
  for (std::uint32_t row = 0; row < picture.rows; ++row) {
    for (std::uint32_t column = 0; column < picture.columns; ++column) {
      float value = 0;
      std::memcpy(&value, &values[sizeof(float) * (std::size_t{picture.columns} * row + column)], sizeof(float));
      const bool inside = bits[row_bytes * row + column / 8] >> (7 - column % 8) & 1;
      const std::uint8_t* rgba = pixel(picture, column, row);
      ASSERT_EQ(rgba[3] != 0, inside) << column << ", " << row;
      if (inside) {
        ASSERT_NEAR(rgba[0], 255 * value, 0.5 + 0.5 * 255 / 254) << column << ", " << row;
      }
    }
  }
}

TEST_F(LayerPainterTest, MixesAndOutlinesShowTheSameVoxels) {
  PreviewColours show;
  const PreviewPicture plain = paint(show, 5, /*contours=*/true);
  EXPECT_EQ(plain.outlines.size(), 1u);
  show.content = PreviewContent::kMix;
  const PreviewPicture mixed = paint(show, 5);
  EXPECT_TRUE(mixed.outlines.empty());
  EXPECT_EQ(mixed.pixels_inside, plain.pixels_inside);
  for (std::size_t at = 3; at < plain.rgba.size(); at += 4) ASSERT_EQ(mixed.rgba[at], plain.rgba[at]);
}

TEST_F(LayerPainterTest, WhatIsLeftEmptyIsTransparent) {
  PreviewColours show;
  show.content = PreviewContent::kHalftone;
  const PreviewPicture full = paint(show, 5);
  show.content = PreviewContent::kMix;
  const PreviewPicture full_mix = paint(show, 5);
  job_.printing->materials[1].leaves_empty = true;
  const PreviewPicture mix = paint(show, 5);
  show.content = PreviewContent::kHalftone;
  const PreviewPicture halftone = paint(show, 5);
  EXPECT_EQ(halftone.material_pixels, full.material_pixels);
  EXPECT_EQ(halftone.pixels_inside, full.material_pixels[0]);
  for (std::size_t at = 0; at < full.rgba.size(); at += 4) {
    const bool is_soft = full.rgba[at] == 255;
    ASSERT_EQ(halftone.rgba[at + 3], is_soft ? 255 : 0);
    if (full_mix.rgba[at + 3] == 0) {
      ASSERT_EQ(mix.rgba[at + 3], 0);
      continue;
    }
    // The fraction of what is red, by the light of the mix.
    const double fraction = linear_intensity(full_mix.rgba[at] / 255.0);
    ASSERT_NEAR(mix.rgba[at + 3], 255 * fraction, 2);
    ASSERT_EQ(mix.rgba[at], mix.rgba[at + 3] > 0 ? 255 : 0);
    ASSERT_EQ(mix.rgba[at + 2], 0);
  }
}

// What the layer of the whole part shows under a region's map, where that region is.
TEST_F(LayerPainterTest, RegionsAreMixedByTheirOwnMaps) {
  const double interface_mm = solid_->summary().bounding_box.center().x();
  const Solid solid = prepare_solid(
      oracle::with_regions(make_box(), 2, [&](const Vec3& middle) { return middle.x() < interface_mm ? 0 : 1; }));
  PreviewColours show;
  show.content = PreviewContent::kMix;
  const auto painted = [&] {
    return LayerPainter({{"", solid, layer_preview_job(job_, show, /*contours=*/false)}}, show, {}).paint(5, {});
  };
  const PreviewPicture whole = painted();
  job_.printing->map.kind = {};
  job_.printing->cell_region_maps = {{1, printing_->map}, {0, {PureMap{2}}}};
  const PreviewPicture picture = painted();
  EXPECT_EQ(picture.pixels_inside, whole.pixels_inside);
  for (std::uint32_t row = 0; row < picture.rows; ++row) {
    for (std::uint32_t column = 0; column < picture.columns; ++column) {
      const double x = job_.grid.lattice().centre(column, row, 0).x();
      if (pixel(whole, column, row)[3] == 0 || std::abs(x - interface_mm) < job_.grid.pitch.x_mm) continue;
      const std::array<std::uint8_t, 4> hard = {0, 0, 255, 255};
      const std::uint8_t* wanted = x < interface_mm ? hard.data() : pixel(whole, column, row);
      ASSERT_TRUE(std::equal(wanted, wanted + 4, pixel(picture, column, row))) << column << ", " << row;
    }
  }
}

}  // namespace
}  // namespace ccslice
