// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of planes against inversion, pixel by pixel.

#include "core/preview/plane_painter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/field/material_field.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::HasSubstr;

/// Pixels of a part's box, seen along a direction.
PreviewJob oblique_job(const LimitSolid& solid, const Vec3& normal, std::uint32_t pixels) {
  PreviewJob job;
  const Box3& box = solid.summary().bounding_box;
  const Vec3 n = normal.normalized();
  job.plane.middle_mm = box.center();
  job.plane.across = n.unitOrthogonal();
  job.plane.up = n.cross(job.plane.across);
  job.plane.across_mm = job.plane.up_mm = 1.05 * box.diagonal().norm() / pixels;
  job.plane.columns = job.plane.rows = pixels;
  job.show.content = PreviewContent::kChannel;
  job.show.colours = ColourMapName::kGrey;
  const ChannelRange& channel = solid.summary().channels.front();
  job.show.channel = channel.name;
  job.show.range = ValueRange{channel.min, channel.max};
  return job;
}

Vec3 place_of(const PreviewPlane& plane, std::uint32_t column, std::uint32_t row_from_top) {
  return plane.middle_mm + (column + 0.5 - 0.5 * plane.columns) * plane.across_mm * plane.across +
         (0.5 * plane.rows - row_from_top - 0.5) * plane.up_mm * plane.up;
}

struct Pixel {
  std::uint8_t grey, alpha;
};

Pixel pixel_of(const PreviewPicture& picture, std::uint32_t column, std::uint32_t row_from_top) {
  const std::size_t at = std::size_t{4} * (std::size_t{picture.columns} * row_from_top + column);
  return {picture.rgba[at], picture.rgba[at + 3]};
}

/// Whether inversion finds the place within a distance of the solid, and its value.
class Truth {
 public:
  explicit Truth(const Solid& solid) : field_(make_material_field(solid, Placement::Identity(), 1e-6)) {
    values_.resize(solid->channel_count());
  }
  std::optional<double> at(const Vec3& place) {
    const auto found = field_->invert(place, {});
    if (!found) return std::nullopt;
    field_->mat(found->at, values_);
    return values_.front();
  }

 private:
  std::unique_ptr<MaterialField> field_;
  std::vector<double> values_;
};

struct Disagreement {
  int wrong_sides = 0;     // Opaque outside or clear inside, where neighbours say that no outline is near.
  double worst_share = 0;  // Of the range shown, at pixels inside both.
  std::uint64_t inside = 0;
};

Disagreement compare(const Solid& solid, const PreviewJob& job, const PreviewPicture& picture) {
  Truth truth(solid);
  Disagreement found;
  const double length = job.show.range->max - job.show.range->min;
  for (std::uint32_t row = 1; row + 1 < picture.rows; ++row) {
    for (std::uint32_t column = 1; column + 1 < picture.columns; ++column) {
      const Pixel pixel = pixel_of(picture, column, row);
      const auto value = truth.at(place_of(job.plane, column, row));
      found.inside += value.has_value() ? 1 : 0;
      if (value.has_value() != (pixel.alpha != 0)) {
        // A tenth of a pixel at an outline may be on either side.
        bool near = false;
        for (const Vec3& step : {job.plane.across, job.plane.up}) {
          for (const double way : {-0.15, 0.15}) {
            const Vec3 beside = place_of(job.plane, column, row) + way * job.plane.across_mm * step;
            near = near || truth.at(beside).has_value() != value.has_value();
          }
        }
        if (!near) ++found.wrong_sides;
      } else if (value && length > 0) {
        const double share = (*value - job.show.range->min) / length;
        found.worst_share = std::max(found.worst_share, std::abs(pixel.grey / 255.0 - share));
      }
    }
  }
  return found;
}

class PlanesOfTinyMeshes : public testing::TestWithParam<const char*> {};

TEST_P(PlanesOfTinyMeshes, AreWhatInversionFinds) {
  const Solid solid = prepare_solid(oracle::tiny_mesh(GetParam()));
  PlanePainter painter(solid);
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 2, 3), Vec3(-3, 1, 0.1)}) {
    const PreviewJob job = oblique_job(*solid, normal, 48);
    validate_preview(solid->summary(), job);
    const PreviewPicture picture = painter.paint(job, PreviewStage::kFull, {});
    const Disagreement found = compare(solid, job, picture);
    EXPECT_EQ(found.wrong_sides, 0) << normal.transpose();
    EXPECT_GT(found.inside, 0u) << normal.transpose();
    // The tolerance, half a shade of the table and half a step of grey.
    EXPECT_LE(found.worst_share, 1.0 / 256 + 0.5 / 254 + 0.5 / 255 + 1e-9) << normal.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, PlanesOfTinyMeshes, testing::Values("box_3", "vertex_link_octahedron"),
                         [](const auto& info) { return std::string(info.param); });

class PlanePainterTest : public testing::Test {
 protected:
  const Solid solid_ = prepare_solid(make_box());
  PreviewJob job_ = oblique_job(*solid_, Vec3(1, 2, 3), 64);
};

TEST_F(PlanePainterTest, PaintsTheSameWhateverWasPaintedBefore) {
  PlanePainter used(solid_);
  for (int step = 0; step < 3; ++step) {
    job_.plane.middle_mm += 0.3 * job_.plane.across.cross(job_.plane.up);
    for (const PreviewStage stage : {PreviewStage::kCoarse, PreviewStage::kFull}) {
      const PreviewPicture again = used.paint(job_, stage, {});
      EXPECT_EQ(again.rgba, PlanePainter(solid_).paint(job_, stage, {}).rgba) << step;
    }
  }
}

TEST_F(PlanePainterTest, CoarsePicturesLookAlike) {
  PlanePainter painter(solid_);
  const PreviewPicture coarse = painter.paint(job_, PreviewStage::kCoarse, {});
  const PreviewPicture full = painter.paint(job_, PreviewStage::kFull, {});
  EXPECT_EQ(coarse.columns, 8u);
  EXPECT_EQ(coarse.rows, 8u);
  EXPECT_DOUBLE_EQ(coarse.across_mm, 8 * full.across_mm);
  EXPECT_NEAR(64.0 * static_cast<double>(coarse.pixels_inside), static_cast<double>(full.pixels_inside),
              0.3 * static_cast<double>(full.pixels_inside));
  for (std::uint32_t row = 0; row < 8; ++row) {
    for (std::uint32_t column = 0; column < 8; ++column) {
      const Pixel small = pixel_of(coarse, column, row), large = pixel_of(full, 8 * column + 4, 8 * row + 4);
      if (small.alpha == 0 || large.alpha == 0) continue;
      EXPECT_NEAR(small.grey, large.grey, 30) << column << ", " << row;
    }
  }
}

TEST_F(PlanePainterTest, TakesTheRangeOfThePictureUnlessTold) {
  const std::optional<ValueRange> told = job_.show.range;
  job_.show.range.reset();
  PlanePainter painter(solid_);
  const PreviewPicture picture = painter.paint(job_, PreviewStage::kFull, {});
  ASSERT_TRUE(picture.range);
  EXPECT_LT(picture.range->min, picture.range->max);
  EXPECT_GE(picture.range->min, told->min);
  EXPECT_LE(picture.range->max, told->max);
  std::uint8_t darkest = 255, lightest = 0;
  for (std::uint32_t row = 0; row < picture.rows; ++row) {
    for (std::uint32_t column = 0; column < picture.columns; ++column) {
      const Pixel pixel = pixel_of(picture, column, row);
      if (pixel.alpha == 0) continue;
      darkest = std::min(darkest, pixel.grey);
      lightest = std::max(lightest, pixel.grey);
    }
  }
  EXPECT_EQ(darkest, 0);
  EXPECT_EQ(lightest, 255);
}

TEST_F(PlanePainterTest, APlaneThatMissesThePartIsClear) {
  job_.plane.middle_mm += Vec3(1e4, 0, 0);
  for (const bool ranged : {true, false}) {
    if (!ranged) job_.show.range.reset();
    const PreviewPicture picture = PlanePainter(solid_).paint(job_, PreviewStage::kFull, {});
    EXPECT_EQ(picture.pixels_inside, 0u);
    EXPECT_EQ(picture.range.has_value(), ranged);
    EXPECT_THAT(picture.rgba, testing::Each(0));
  }
}

TEST_F(PlanePainterTest, OutlinesEncloseWhatIsPainted) {
  job_.contours = true;
  job_.show.content = PreviewContent::kOccupancy;
  const PreviewPicture picture = PlanePainter(solid_).paint(job_, PreviewStage::kFull, {});
  double area = 0, length = 0;
  for (const std::vector<Vec2>& loop : picture.outlines) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec2 &a = loop[i], &b = loop[(i + 1) % loop.size()];
      area += 0.5 * (a.x() * b.y() - b.x() * a.y());
      length += (b - a).norm();
      EXPECT_GE(a.minCoeff(), 0);
      EXPECT_LE(a.x(), picture.columns * picture.across_mm);
    }
  }
  // Half a pixel along the outline.
  EXPECT_NEAR(static_cast<double>(picture.pixels_inside) * picture.across_mm * picture.up_mm, area,
              0.5 * picture.across_mm * length);
}

Printing blended(HalftoneMethod method) {
  Printing printing;
  printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x0000ffff}};
  printing.map.kind = BlendMap{"gradient", {{0, 1}, {1, 2}}};
  printing.halftone = {method, 3};
  return printing;
}

TEST_F(PlanePainterTest, MixesInLinearLight) {
  job_.show.content = PreviewContent::kMix;
  job_.show.printing = std::make_shared<const Printing>(blended(HalftoneMethod::kErrorDiffusion));
  validate_preview(solid_->summary(), job_);
  const PreviewPicture picture = PlanePainter(solid_).paint(job_, PreviewStage::kFull, {});
  Truth truth(solid_);
  for (std::uint32_t row = 0; row < picture.rows; row += 3) {
    for (std::uint32_t column = 0; column < picture.columns; column += 3) {
      const std::uint8_t* rgba = &picture.rgba[std::size_t{4} * (std::size_t{picture.columns} * row + column)];
      const auto value = truth.at(place_of(job_.plane, column, row));
      if (rgba[3] == 0 || !value) continue;
      const auto srgb = [](double linear) {
        return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
      };
      // Dark colours are steep in the light.
      const auto within = [&](std::uint8_t byte, double share) {
        const double low = srgb(std::clamp(share - 1.0 / 128, 0.0, 1.0)),
                     high = srgb(std::clamp(share + 1.0 / 128, 0.0, 1.0));
        EXPECT_GE(byte, low - 1);
        EXPECT_LE(byte, high + 1);
      };
      within(rgba[0], 1 - *value);
      within(rgba[2], *value);
    }
  }
}

TEST_F(PlanePainterTest, HalftonesShowTheVoxelsOfTheJob) {
  // A plane whose pixels are the voxels of a layer.
  SliceJob slice = job_of(solid_, {0.31, 0.33, 0.3});
  slice.printing = blended(HalftoneMethod::kBlueNoise);
  PlaneSpec materials = occupancy();
  materials.content = PlaneContent::kMaterials;
  materials.sample_type = SampleType::kUint8;
  slice.planes = {materials};
  const std::uint32_t index = slice.grid.extent.layers / 3;
  const Layer layer = LayerSlicer(solid_, slice).slice(index, {});

  PreviewJob job;
  const GridExtent& extent = slice.grid.extent;
  job.plane.columns = extent.columns;
  job.plane.rows = extent.rows;
  job.plane.across_mm = slice.grid.pitch.x_mm;
  job.plane.up_mm = slice.grid.pitch.y_mm;
  job.plane.middle_mm = slice.grid.origin_mm + Vec3(0.5 * extent.columns * slice.grid.pitch.x_mm,
                                                    0.5 * extent.rows * slice.grid.pitch.y_mm, 0);
  job.plane.middle_mm.z() = slice.grid.layer_z_mm(index);
  job.show.content = PreviewContent::kHalftone;
  job.show.printing = std::make_shared<const Printing>(*slice.printing);
  job.voxels = slice.grid;
  validate_preview(solid_->summary(), job);
  const PreviewPicture picture = PlanePainter(solid_).paint(job, PreviewStage::kFull, {});

  std::uint64_t differ = 0, inside = 0;
  for (std::uint32_t row = 0; row < extent.rows; ++row) {
    for (std::uint32_t column = 0; column < extent.columns; ++column) {
      const std::uint8_t material = layer.planes[0].bytes[std::size_t{extent.columns} * row + column];
      const std::uint8_t* rgba =
          &picture.rgba[std::size_t{4} * (std::size_t{extent.columns} * (extent.rows - 1 - row) + column)];
      const std::uint8_t shown = rgba[3] == 0 ? 0 : rgba[0] == 255 ? 1 : 2;
      if (shown == 2) {
        EXPECT_EQ(rgba[2], 255);
      }
      inside += material != 0 ? 1 : 0;
      differ += shown != material ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 500u);
  EXPECT_LE(differ, inside / 50) << "thresholds within the tolerances of a fraction, and outlines within a tenth";
  EXPECT_EQ(picture.material_pixels[0] + picture.material_pixels[1], picture.pixels_inside);

  auto with_void = std::make_shared<Printing>(*slice.printing);
  with_void->materials[1].leaves_empty = true;
  job.show.printing = with_void;
  const PreviewPicture pores = PlanePainter(solid_).paint(job, PreviewStage::kFull, {});
  EXPECT_EQ(pores.material_pixels, picture.material_pixels);
  EXPECT_EQ(pores.pixels_inside, picture.material_pixels[0]);
  for (std::size_t at = 0; at < picture.rgba.size(); at += 4) {
    ASSERT_EQ(pores.rgba[at + 3], picture.rgba[at] == 255 ? 255 : 0) << at;
  }
}

// Two regions of a part: where each is, it looks as if its map were that of the whole part.
TEST_F(PlanePainterTest, RegionsAreMixedByTheirOwnMaps) {
  const double interface_mm = solid_->summary().bounding_box.center().x();
  const auto halves =
      oracle::with_regions(make_box(), 2, [&](const Vec3& middle) { return middle.x() < interface_mm ? 0 : 1; });
  const Solid solid = prepare_solid(halves);
  Printing by_region = blended(HalftoneMethod::kBlueNoise);
  by_region.map.kind = {};
  by_region.cell_region_maps = {{1, blended(HalftoneMethod::kBlueNoise).map}, {0, {PureMap{2}}}};
  for (const PreviewContent content : {PreviewContent::kMix, PreviewContent::kHalftone}) {
    PreviewJob job = oblique_job(*solid, {0.3, 0.2, 1}, 120);
    job.show.content = content;
    job.voxels = job_of(solid, {0.31, 0.33, 0.3}).grid;
    job.show.printing = std::make_shared<const Printing>(blended(HalftoneMethod::kBlueNoise));
    const PreviewPicture whole = PlanePainter(solid).paint(job, PreviewStage::kFull, {});
    job.show.printing = std::make_shared<const Printing>(by_region);
    validate_preview(solid->summary(), job);
    const PreviewPicture picture = PlanePainter(solid).paint(job, PreviewStage::kFull, {});
    EXPECT_EQ(picture.pixels_inside, whole.pixels_inside);
    std::array<std::size_t, 2> pixels{};
    for (std::uint32_t row = 0; row < picture.rows; ++row) {
      for (std::uint32_t column = 0; column < picture.columns; ++column) {
        const std::size_t at = std::size_t{4} * (std::size_t{picture.columns} * row + column);
        const double x = place_of(job.plane, column, row).x();
        if (whole.rgba[at + 3] == 0 || std::abs(x - interface_mm) < job.plane.across_mm) continue;
        const std::size_t region = x < interface_mm ? 0 : 1;
        ++pixels[region];
        const std::array<std::uint8_t, 4> hard = {0, 0, 255, 255};
        const std::uint8_t* wanted = region == 0 ? hard.data() : &whole.rgba[at];
        ASSERT_TRUE(std::equal(wanted, wanted + 4, &picture.rgba[at])) << column << ", " << row;
      }
    }
    EXPECT_GT(std::min(pixels[0], pixels[1]), 500u);
  }
}

TEST_F(PlanePainterTest, IsCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  PlanePainter painter(solid_);
  EXPECT_THROW(painter.paint(job_, PreviewStage::kFull, cancel), Error);
  const PreviewPicture picture = painter.paint(job_, PreviewStage::kFull, {});
  EXPECT_EQ(picture.rgba, PlanePainter(solid_).paint(job_, PreviewStage::kFull, {}).rgba);
}

TEST_F(PlanePainterTest, RefusesWhatPlanesCantShow) {
  const auto refusal = [&] {
    try {
      validate_preview(solid_->summary(), job_);
    } catch (const Error& error) {
      return std::string(reason(error.code())) + " " + error.what();
    }
    return std::string();
  };
  EXPECT_EQ(refusal(), "");
  job_.show.channel = "depth";
  EXPECT_THAT(refusal(), HasSubstr("CHANNEL_UNKNOWN content.channel.channel: the mesh has no channel \"depth\""));
  job_.show.channel = "gradient";
  job_.show.range = ValueRange{1, 1};
  EXPECT_THAT(refusal(), HasSubstr("VALUE_RANGE_INVALID content.channel.range: from 1 to 1"));
  job_.show.content = PreviewContent::kHalftone;
  EXPECT_THAT(refusal(), HasSubstr("MATERIALS_MISSING printing"));
  job_.show.printing = std::make_shared<const Printing>(blended(HalftoneMethod::kErrorDiffusion));
  EXPECT_THAT(refusal(), HasSubstr("CONTENT_INVALID content.halftone: error diffusion"));
}

}  // namespace
}  // namespace ccslice
