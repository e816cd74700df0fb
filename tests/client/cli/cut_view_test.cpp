// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/cut_view.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "client/cli/pictures/png_file.h"

namespace ccslice::cli {
namespace {

using Rgb = std::array<int, 3>;

constexpr int kSide = 24;
constexpr Rgb kWhite = {255, 255, 255};

/// A cube whose value grows along y.
VoxelBlock cube() {
  VoxelBlock block{{kSide, kSide, kSide}, {}, {}, {.title = "y", .range = {{0, 1}}, .entries = {}}};
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    block.inside.push_back(1);
    block.value.push_back(static_cast<std::uint8_t>(255 * (i / kSide % kSide) / (kSide - 1)));
  }
  return block;
}

/// Its surface, a box of twelve triangles.
client::Surface surface_of(const VoxelBlock& block) {
  client::Surface surface;
  for (int corner = 0; corner < 8; ++corner) {
    surface.points_mm.push_back({double(corner & 1) * block.size[0], double(corner >> 1 & 1) * block.size[1],
                                 double(corner >> 2) * block.size[2]});
  }
  surface.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                       {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return surface;
}

Picture draw_cube(const VoxelBlock& block, const CutView& view) {
  return draw_cut_view(surface_of(block), block, view);
}

/// The colour at fractions of the picture's width and height, from the upper left.
Rgb colour_at(const Picture& picture, double across, double down) {
  const int column = std::min(static_cast<int>(across * picture.width), picture.width - 1);
  const int row = std::min(static_cast<int>(down * picture.height), picture.height - 1);
  const std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(column));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

bool is_blue(const Rgb& c) { return c[2] > c[0] && c[2] > c[1]; }
bool is_yellow(const Rgb& c) { return c[0] > 2 * c[2] && c[1] > 2 * c[2]; }

TEST(CutView, ShowsThePartOnWhite) {
  const Picture picture = draw_cube(cube(), {.cut = {}, .width = 80});
  EXPECT_EQ(picture.width, 80);
  EXPECT_EQ(picture.rgb.size(), static_cast<std::size_t>(3 * picture.width * picture.height));
  EXPECT_EQ(colour_at(picture, 0, 0), kWhite);
  EXPECT_EQ(colour_at(picture, 1, 1), kWhite);
  EXPECT_NE(colour_at(picture, 0.5, 0.5), kWhite);
}

TEST(CutView, ShowsTheMaterialOnTheCut) {
  const Picture picture =
      draw_cube(cube(), {.azimuth_deg = 0, .elevation_deg = 0, .cut = {0.5, std::nullopt, std::nullopt}, .width = 80});
  EXPECT_TRUE(is_blue(colour_at(picture, 0.15, 0.5))) << "+y is on the right of who stands in +x";
  EXPECT_TRUE(is_yellow(colour_at(picture, 0.85, 0.5)));
}

TEST(CutView, ShowsPrintedMaterialsInTheirColours) {
  VoxelBlock block = cube();
  for (std::size_t i = 0; i < block.value.size(); ++i) block.value[i] = i / kSide % kSide < kSide / 2 ? 1 : 2;
  block.legend = {.title = "materials", .range = {}, .entries = {{"a", Colour(1, 0, 0)}, {"b", Colour(0, 0, 1)}}};
  const Picture picture =
      draw_cube(block, {.azimuth_deg = 0, .elevation_deg = 0, .cut = {0.5, std::nullopt, std::nullopt}, .width = 80});
  EXPECT_EQ(colour_at(picture, 0.2, 0.5), (Rgb{255, 0, 0}));
  EXPECT_EQ(colour_at(picture, 0.8, 0.5), (Rgb{0, 0, 255}));
}

TEST(CutView, CutsAwayTheViewersSide) {
  const auto view = [](double azimuth, double cut) {
    return draw_cube(
        cube(), {.azimuth_deg = azimuth, .elevation_deg = 0, .cut = {std::nullopt, cut, std::nullopt}, .width = 80});
  };
  EXPECT_TRUE(is_blue(colour_at(view(90, 0.1), 0.5, 0.5))) << "from +y: y < 0.1 remains";
  EXPECT_TRUE(is_yellow(colour_at(view(-90, 0.9), 0.5, 0.5))) << "from -y: y > 0.9 remains";
}

TEST(CutView, OfTwoCutsTakesACornerAway) {
  CutView view{.azimuth_deg = 0, .elevation_deg = 0, .cut = {-0.05, 0.5, std::nullopt}, .width = 80};
  view.azimuth_deg = 1;  // On the +y side of the second plane.
  const Picture picture = draw_cube(cube(), view);
  EXPECT_EQ(colour_at(picture, 0.75, 0.5), kWhite) << "y > 0.5 is gone, all the way back";
  EXPECT_NE(colour_at(picture, 0.25, 0.5), kWhite);
}

TEST(CutView, WithoutValuesIsOfOneColour) {
  VoxelBlock block = cube();
  block.legend = {};
  const Picture picture =
      draw_cube(block, {.azimuth_deg = 0, .elevation_deg = 0, .cut = {0.5, std::nullopt, std::nullopt}, .width = 80});
  EXPECT_EQ(colour_at(picture, 0.2, 0.5), colour_at(picture, 0.8, 0.5));
}

TEST(CutView, DrawsSharpEdgesSharp) {
  const Picture picture = draw_cube(cube(), {.azimuth_deg = 45, .elevation_deg = 0, .cut = {}, .width = 200});
  // The edge between the faces in +x and +y is in the middle.
  const Rgb left = colour_at(picture, 0.25, 0.5), right = colour_at(picture, 0.75, 0.5);
  VoxelBlock plain = cube();
  plain.legend = {};
  const Picture grey = draw_cube(plain, {.azimuth_deg = 45, .elevation_deg = 0, .cut = {}, .width = 200});
  EXPECT_NE(left, right);
  EXPECT_NE(colour_at(grey, 0.25, 0.5), colour_at(grey, 0.75, 0.5));
  EXPECT_EQ(colour_at(grey, 0.25, 0.5), colour_at(grey, 0.49, 0.5)) << "as light up to the edge as in the middle";
  EXPECT_EQ(colour_at(grey, 0.75, 0.5), colour_at(grey, 0.51, 0.5));
}

TEST(CutView, CutsAlongAFaceWithoutSpeckles) {
  VoxelBlock block = cube();
  block.legend = {};
  for (const double at : {0.0, 1.0}) {
    const Picture picture = draw_cube(
        block, {.azimuth_deg = 30, .elevation_deg = 20, .cut = {at, std::nullopt, std::nullopt}, .width = 100});
    const Picture whole = at == 1 ? draw_cube(block, {.azimuth_deg = 30, .elevation_deg = 20, .cut = {}, .width = 100})
                                  : blank_picture(picture.width, picture.height);
    EXPECT_EQ(picture.rgb, whole.rgb) << at;
  }
}

TEST(CutView, ShowsCellRegionsOnTheSurfaceToo) {
  VoxelBlock block = cube();
  for (std::size_t i = 0; i < block.value.size(); ++i) block.value[i] = i / kSide % kSide < kSide / 2 ? 1 : 2;
  block.legend = {.title = "cell regions", .range = {}, .entries = {{"a", Colour(1, 0, 0)}, {"b", Colour(0, 0, 1)}}};
  const Picture picture = draw_cube(block, {.azimuth_deg = 0, .elevation_deg = 0, .cut = {}, .width = 80});
  EXPECT_GT(colour_at(picture, 0.2, 0.5)[0], colour_at(picture, 0.2, 0.5)[2]);
  EXPECT_GT(colour_at(picture, 0.8, 0.5)[2], colour_at(picture, 0.8, 0.5)[0]);
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number = number << 8 | static_cast<unsigned char>(bytes[at + i]);
  return number;
}

TEST(PngFile, HoldsThePicture) {
  const Picture picture{2, 2, {1, 2, 3, 250, 251, 252, 7, 0, 255, 9, 8, 7}};
  const std::string png = to_png(picture);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(12, 4), "IHDR");
  EXPECT_EQ(number_at(png, 16), 2u);
  EXPECT_EQ(number_at(png, 20), 2u);
  EXPECT_EQ(png.substr(24, 5), std::string("\x08\x02\0\0\0", 5));
  const std::size_t data = 33;
  const std::uint32_t size = number_at(png, data);
  EXPECT_EQ(png.substr(data + 4, 4), "IDAT");
  const auto* body = reinterpret_cast<const Bytef*>(png.data() + data + 4);
  EXPECT_EQ(number_at(png, data + 8 + size), crc32_z(0, body, 4 + size));
  std::array<Bytef, 14> rows{};
  uLongf rows_size = rows.size();
  ASSERT_EQ(uncompress(rows.data(), &rows_size, body + 4, size), Z_OK);
  // Each row is its filter, "up", and the differences to the row above.
  EXPECT_EQ(rows, (std::array<Bytef, 14>{2, 1, 2, 3, 250, 251, 252, 2, 6, 254, 252, 15, 13, 11}));
  EXPECT_EQ(png.substr(png.size() - 12), std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12));
}

}  // namespace
}  // namespace ccslice::cli
