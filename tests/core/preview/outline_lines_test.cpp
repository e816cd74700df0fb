// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Drawn lines against the distance from each pixel to every line of the outlines, and against areas that are known.

#include "core/preview/outline_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "core/base/error.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/preview/layer_painter.h"
#include "core/preview/plane_painter.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

/// A picture of one colour everywhere, or clear.
PreviewPicture picture_of(std::uint32_t columns, std::uint32_t rows, std::array<std::uint8_t, 4> rgba) {
  PreviewPicture picture;
  picture.columns = columns;
  picture.rows = rows;
  picture.across_mm = 0.5;
  picture.up_mm = 0.25;
  for (std::uint32_t i = 0; i < columns * rows; ++i) picture.rgba.insert(picture.rgba.end(), rgba.begin(), rgba.end());
  return picture;
}

PreviewColours lines_of(double width, PreviewContent content = PreviewContent::kOccupancy) {
  PreviewColours show;
  show.content = content;
  show.lines = PreviewLines{width, {200, 100, 0}};
  return show;
}

const std::uint8_t* pixel_at(const PreviewPicture& picture, std::uint32_t column, std::uint32_t row) {
  return &picture.rgba[std::size_t{4} * (std::size_t{picture.columns} * (picture.rows - 1 - row) + column)];
}

/// By the definition, from all lines; in pixels.
double distance_to(const std::vector<std::vector<Vec2>>& outlines, const Vec2& place) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::vector<Vec2>& outline : outlines) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const auto in_pixels = [](const Vec2& mm) { return Vec2(mm.x() / 0.5, mm.y() / 0.25); };
      const Vec2 a = in_pixels(outline[i]), b = in_pixels(outline[(i + 1) % outline.size()]);
      for (const Vec2& end : {a, b}) nearest = std::min(nearest, (place - end).norm());
      const Vec2 along = (b - a).normalized();
      const double foot = (place - a).dot(along);
      if (foot > 0 && foot < (b - a).norm()) {
        nearest = std::min(nearest, std::abs(along.x() * (place - a).y() - along.y() * (place - a).x()));
      }
    }
  }
  return nearest;
}

TEST(OutlineLines, CoverWhatIsNear) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(-5, 25), y(-3, 13);
  for (const double width : {0.25, 1.0, 1.5, 4.0, 16.0}) {
    for (int round = 0; round < 6; ++round) {
      PreviewPicture picture = picture_of(40, 41, {0, 0, 0, 0});
      for (int loop = 0; loop < 2; ++loop) {
        std::vector<Vec2>& outline = picture.outlines.emplace_back();
        for (int i = 0; i < 3 + round; ++i) outline.emplace_back(x(random), y(random));
        if (round == 1) outline[1].y() = outline[0].y();  // Level, upright,
        if (round == 2) outline[1].x() = outline[0].x();
        if (round == 3) outline[1] = outline[0];  // and of no length.
      }
      draw_lines(lines_of(width), 1, picture, {});
      for (std::uint32_t row = 0; row < picture.rows; ++row) {
        for (std::uint32_t column = 0; column < picture.columns; ++column) {
          const double distance = distance_to(picture.outlines, Vec2(column + 0.5, row + 0.5));
          const double share = std::clamp(0.5 * width + 0.5 - distance, 0.0, std::min(width, 1.0));
          const std::uint8_t* rgba = pixel_at(picture, column, row);
          ASSERT_NEAR(rgba[3], 255 * share, 0.5 + 1e-6) << column << ", " << row << ", width " << width;
          if (rgba[3] == 0) continue;
          ASSERT_EQ((std::array{rgba[0], rgba[1], rgba[2]}), (Srgb{200, 100, 0}));
        }
      }
    }
  }
}

TEST(OutlineLines, MixWithThePartButNotInHalftones) {
  for (const PreviewContent content : {PreviewContent::kChannel, PreviewContent::kHalftone}) {
    PreviewPicture picture = picture_of(20, 20, {0, 0, 100, 255});
    picture.outlines = {{{2, 1}, {8, 2}, {5, 4}}};
    draw_lines(lines_of(2.3, content), 1, picture, {});
    int between = 0, line = 0;
    for (std::uint32_t row = 0; row < 20; ++row) {
      for (std::uint32_t column = 0; column < 20; ++column) {
        const std::uint8_t* rgba = pixel_at(picture, column, row);
        ASSERT_EQ(rgba[3], 255);
        line += rgba[0] == 200 ? 1 : 0;
        between += rgba[0] != 200 && rgba[0] != 0 ? 1 : 0;
        ASSERT_NEAR(rgba[2], 100 - 0.5 * rgba[0], 1);
        if (content == PreviewContent::kHalftone) {
          const bool near = distance_to(picture.outlines, Vec2(column + 0.5, row + 0.5)) <= 1.15;
          ASSERT_EQ(rgba[0], near ? 200 : 0);
        }
      }
    }
    EXPECT_GT(line, 20);
    EXPECT_EQ(between > 0, content == PreviewContent::kChannel);
  }
}

TEST(OutlineLines, AreAsMuchThinnerInCoarsePictures) {
  PreviewPicture picture = picture_of(30, 30, {0, 0, 0, 0});
  picture.outlines = {{{-1, 3.1}, {20, 3.1}}};
  draw_lines(lines_of(4), 8, picture, {});
  // Half a coarse pixel, whose middle is 0.1 below: 12.4 pixels high, that of row 12 is at 12.5.
  EXPECT_EQ(pixel_at(picture, 5, 12)[3], 128);
  EXPECT_EQ(pixel_at(picture, 5, 10)[3], 0);
}

TEST(OutlineLines, AreOfNoConsequenceFarAway) {
  PreviewPicture picture = picture_of(8, 8, {0, 0, 0, 0});
  picture.outlines = {{{1e12, 1e12}, {-1e12, 1e12}, {0, 2e12}}, {{-1e9, -1}, {1e9, -1.5}}, {}};
  draw_lines(lines_of(16), 1, picture, {});
  EXPECT_EQ(pixel_at(picture, 3, 0)[3], 255) << "within 8 pixels of the line below the picture";
  EXPECT_EQ(pixel_at(picture, 3, 7)[3], 0);
}

TEST(OutlineLines, StopWhenCancelled) {
  PreviewPicture picture = picture_of(8, 8, {0, 0, 0, 0});
  picture.outlines = {{{0, 0}, {1, 1}, {1, 0}}};
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(draw_lines(lines_of(2), 1, picture, cancel), Error);
}

class PicturesWithLines : public testing::Test {
 protected:
  const Solid solid_ = prepare_solid(make_box());
};

/// How many pixels two pictures differ in, and how many of those are farther from the outlines than the line.
struct Change {
  int pixels = 0, beyond = 0;
};

Change change_between(const PreviewPicture& plain, const PreviewPicture& lined, double width) {
  Change change;
  for (std::uint32_t row = 0; row < plain.rows; ++row) {
    for (std::uint32_t column = 0; column < plain.columns; ++column) {
      if (std::equal(pixel_at(plain, column, row), pixel_at(plain, column, row) + 4, pixel_at(lined, column, row))) {
        continue;
      }
      ++change.pixels;
      std::vector<std::vector<Vec2>> scaled = plain.outlines;
      for (auto& outline : scaled) {
        for (Vec2& point : outline) point = Vec2(0.5 * point.x() / plain.across_mm, 0.25 * point.y() / plain.up_mm);
      }
      change.beyond += distance_to(scaled, Vec2(column + 0.5, row + 0.5)) > 0.5 * width + 0.5 ? 1 : 0;
    }
  }
  return change;
}

TEST_F(PicturesWithLines, OfPlanesDifferAlongTheOutlinesOnly) {
  PreviewJob job;
  const Box3& box = solid_->summary().bounding_box;
  job.plane.middle_mm = box.center();
  job.plane.across = Vec3(1, 2, 0).normalized();
  job.plane.up = Vec3(-2, 1, 1).normalized();
  job.plane.across_mm = job.plane.up_mm = box.diagonal().norm() / 48;
  job.plane.columns = job.plane.rows = 50;
  job.contours = true;
  job.show.content = PreviewContent::kChannel;
  job.show.channel = "gradient";
  PlanePainter painter(solid_);
  const PreviewPicture plain = painter.paint(job, PreviewStage::kFull, {});
  job.show.lines = PreviewLines{3, {0, 0, 0}};
  const PreviewPicture lined = painter.paint(job, PreviewStage::kFull, {});
  const Change change = change_between(plain, lined, 3);
  EXPECT_GT(change.pixels, 150);
  EXPECT_EQ(change.beyond, 0);
  EXPECT_EQ(lined.pixels_inside, plain.pixels_inside);
  const PreviewPicture coarse = painter.paint(job, PreviewStage::kCoarse, {});
  EXPECT_FALSE(coarse.outlines.empty());
}

TEST_F(PicturesWithLines, OfLayersDifferAlongTheOutlinesOnly) {
  SliceJob job = job_of(solid_, {0.4, 0.2, 0.35});
  // The outlines run along the grid's edges.
  job.region = VoxelBox{4, 3, 0, {job.grid.extent.columns - 4, job.grid.extent.rows - 3, job.grid.extent.layers}};
  PreviewColours show;
  const PreviewPicture plain = LayerPainter({{"", solid_, layer_preview_job(job, show, true)}}, show, {}).paint(5, {});
  show.lines = PreviewLines{2, {0, 0, 0}};
  const PreviewPicture lined = LayerPainter({{"", solid_, layer_preview_job(job, show, false)}}, show, {}).paint(5, {});
  const Change change = change_between(plain, lined, 2);
  EXPECT_GT(change.pixels, 50);
  EXPECT_EQ(change.beyond, 0);
}

TEST_F(PicturesWithLines, RefuseWidthsThatNobodySees) {
  PreviewColours show;
  for (const double width : {0.0, -1.0, 0.2, 17.0, std::numeric_limits<double>::quiet_NaN()}) {
    show.lines = PreviewLines{width, {0, 0, 0}};
    try {
      validate_colours(solid_->summary(), show);
      ADD_FAILURE() << width;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kContentInvalid);
      EXPECT_EQ(error.field(), "content.lines.width_pixels");
    }
  }
  show.lines = PreviewLines{16, {0, 0, 0}};
  validate_colours(solid_->summary(), show);
}

}  // namespace
}  // namespace ccslice
