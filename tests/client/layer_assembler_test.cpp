// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/layer_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

v1::SliceHeader contours_only() {
  v1::SliceHeader header;
  header.set_first_layer(4);
  header.set_layer_count(1);
  return header;
}

v1::SliceRangeResponse begin(std::uint64_t loops) {
  v1::SliceRangeResponse message;
  message.mutable_layer_begin()->set_layer(4);
  message.mutable_layer_begin()->set_contour_loops(loops);
  return message;
}

v1::SliceRangeResponse end() {
  v1::SliceRangeResponse message;
  message.mutable_layer_end()->set_layer(4);
  return message;
}

v1::SliceRangeResponse piece(std::uint64_t loop, std::uint64_t first_point, const std::vector<double>& points,
                             bool last) {
  v1::SliceRangeResponse message;
  v1::ContourPiece& piece = *message.mutable_contour_chunk()->add_pieces();
  piece.set_loop(loop);
  piece.set_first_point(first_point);
  piece.set_last(last);
  for (const double value : points) {
    piece.add_points_mm(value);
    piece.add_parameters(0.5);
  }
  for (std::size_t i = 0; i < points.size() / 2; ++i) piece.add_faces(7);
  return message;
}

TEST(LayerAssembler, PutsContourPiecesTogether) {
  LayerAssembler assembler(contours_only());
  EXPECT_FALSE(assembler.add(begin(2)));
  EXPECT_FALSE(assembler.add(piece(0, 0, {1, 2, 3, 4}, false)));
  EXPECT_FALSE(assembler.add(piece(0, 2, {5, 6}, true)));
  EXPECT_FALSE(assembler.add(piece(1, 0, {7, 8}, true)));
  const std::optional<Layer> layer = assembler.add(end());
  ASSERT_TRUE(layer);
  ASSERT_EQ(layer->contours.size(), 2u);
  EXPECT_THAT(layer->contours[0].points_mm, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(layer->contours[0].faces, ElementsAre(7, 7, 7));
  EXPECT_EQ(assembler.next_layer(), 5u);
}

v1::SliceRangeResponse region_piece(std::uint64_t loop, std::uint32_t region) {
  v1::SliceRangeResponse message = piece(loop, 0, {1, 2, 3, 4}, true);
  v1::ContourPiece& only = *message.mutable_contour_chunk()->mutable_pieces(0);
  only.clear_faces();
  only.clear_parameters();
  only.set_cell_region(region);
  return message;
}

TEST(LayerAssembler, PutsContoursOfRegionsTogether) {
  v1::SliceHeader header = contours_only();
  for (const char* name : {"core", "shell"}) header.add_cell_region_names(name);
  LayerAssembler assembler(header);
  EXPECT_FALSE(assembler.add(begin(2)));
  EXPECT_FALSE(assembler.add(region_piece(0, 1)));
  EXPECT_FALSE(assembler.add(region_piece(1, 2)));
  const std::optional<Layer> layer = assembler.add(end());
  ASSERT_TRUE(layer);
  EXPECT_EQ(layer->contours[0].cell_region, 1u);
  EXPECT_EQ(layer->contours[1].cell_region, 2u);
  LayerAssembler other(header);
  EXPECT_FALSE(other.add(begin(1)));
  EXPECT_THROW((void)other.add(region_piece(0, 3)), ClientError);
}

TEST(LayerAssembler, RefusesContoursWithGaps) {
  const std::vector<std::vector<v1::SliceRangeResponse>> streams = {
      {begin(1), piece(0, 1, {1, 2}, true)},                                    // Begins in the middle.
      {begin(2), piece(1, 0, {1, 2}, true)},                                    // The first loop is missing.
      {begin(1), piece(0, 0, {1, 2}, false), end()},                            // The loop never ends.
      {begin(1), piece(0, 0, {1, 2, 3}, true)},                                 // Half a point.
      {begin(1), piece(0, 0, {1, 2}, true), piece(1, 0, {1, 2}, true), end()},  // More than announced.
      {begin(1), end()},                                                        // Fewer.
      {piece(0, 0, {1, 2}, true)},                                              // Outside of a layer.
      {begin(0), begin(0)},
      {end()},
      {v1::SliceRangeResponse()},
  };
  for (const auto& stream : streams) {
    LayerAssembler assembler(contours_only());
    EXPECT_THROW(
        {
          for (v1::SliceRangeResponse message : stream) (void)assembler.add(std::move(message));
        },
        ClientError);
  }
}

/// What is wrong with the last message of a stream, the first one to be refused.
std::string objection_to_the_last(LayerAssembler assembler, std::vector<v1::SliceRangeResponse> stream) {
  v1::SliceRangeResponse last = std::move(stream.back());
  stream.pop_back();
  for (v1::SliceRangeResponse& message : stream) (void)assembler.add(std::move(message));
  try {
    (void)assembler.add(std::move(last));
  } catch (const ClientError& error) {
    EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt);
    return error.what();
  }
  return {};
}

TEST(LayerAssembler, TakesNoContoursBeyondThoseAnnounced) {
  const LayerAssembler assembler(contours_only());
  const auto objection = [&](std::vector<v1::SliceRangeResponse> stream) {
    return objection_to_the_last(assembler, std::move(stream));
  };
  EXPECT_THAT(objection({begin(0), piece(0, 0, {1, 2}, false)}), HasSubstr("more contour loops than announced"));
  EXPECT_THAT(objection({begin(1), piece(0, 0, {1, 2}, true), piece(1, 0, {1, 2}, false)}),
              HasSubstr("more contour loops than announced"));
}

TEST(LayerAssembler, TakesNoMessagesThatBringNothing) {
  const LayerAssembler assembler(contours_only());
  v1::SliceRangeResponse no_pieces;
  no_pieces.mutable_contour_chunk();
  EXPECT_THAT(objection_to_the_last(assembler, {begin(1), no_pieces}), HasSubstr("an empty chunk"));
  EXPECT_THAT(objection_to_the_last(assembler, {begin(1), piece(0, 0, {}, false)}), HasSubstr("no contour points"));
  v1::SliceHeader header = contours_only();
  header.mutable_grid()->mutable_extent()->set_columns(3);
  header.mutable_grid()->mutable_extent()->set_rows(1);
  header.add_planes()->set_sample_type(v1::SAMPLE_TYPE_UINT8);
  header.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  v1::SliceRangeResponse opening = begin(0), no_bytes;
  opening.mutable_layer_begin()->add_encoded_bytes(3);
  no_bytes.mutable_plane_chunk();
  EXPECT_THAT(objection_to_the_last(LayerAssembler(header), {opening, no_bytes}), HasSubstr("an empty chunk"));
}

TEST(LayerAssembler, TakesNoMoreContoursThanALayerCanHave) {
  constexpr std::uint64_t kMostPoints = 20;
  const LayerAssembler assembler(contours_only(), kMostPoints);
  const auto objection = [&](std::vector<v1::SliceRangeResponse> stream) {
    return objection_to_the_last(assembler, std::move(stream));
  };
  const std::vector<double> ten_points(20);
  EXPECT_EQ(objection({begin(1), piece(0, 0, ten_points, false), piece(0, 10, {1, 2}, true), end()}), "");
  EXPECT_THAT(objection({begin(std::uint64_t{1} << 60)}), HasSubstr("more contours than there can be"));
  EXPECT_THAT(objection({begin(1), piece(0, 0, ten_points, false), piece(0, 10, ten_points, false)}),
              HasSubstr("more contours than there can be"));
  EXPECT_THAT(objection({begin(4), piece(0, 0, {1, 2}, true), piece(1, 0, ten_points, true)}),
              HasSubstr("more contours than there can be"))
      << "loops take memory of their own";
}

TEST(LayerAssembler, CountsTheContoursOfEachLayerAnew) {
  v1::SliceHeader header = contours_only();
  header.set_layer_count(2);
  LayerAssembler assembler(header, 20);
  const std::vector<double> ten_points(20);
  for (std::uint32_t layer = 4; layer < 6; ++layer) {
    v1::SliceRangeResponse opening = begin(1), closing = end();
    opening.mutable_layer_begin()->set_layer(layer);
    closing.mutable_layer_end()->set_layer(layer);
    EXPECT_FALSE(assembler.add(std::move(opening)));
    EXPECT_FALSE(assembler.add(piece(0, 0, ten_points, true)));
    EXPECT_TRUE(assembler.add(std::move(closing)));
  }
}

TEST(LayerAssembler, TakesNoPlanesLargerThanTheirGridMakesThem) {
  v1::SliceHeader header = contours_only();
  header.mutable_grid()->mutable_extent()->set_columns(100);
  header.mutable_grid()->mutable_extent()->set_rows(100);
  for (const v1::PlaneEncoding encoding : {v1::PLANE_ENCODING_RAW, v1::PLANE_ENCODING_PNG}) {
    header.add_planes()->set_sample_type(v1::SAMPLE_TYPE_UINT8);
    header.mutable_planes(header.planes_size() - 1)->set_encoding(encoding);
  }
  const auto objection = [&](std::uint64_t raw_bytes, std::uint64_t png_bytes) {
    v1::SliceRangeResponse opening = begin(0);
    opening.mutable_layer_begin()->add_encoded_bytes(raw_bytes);
    opening.mutable_layer_begin()->add_encoded_bytes(png_bytes);
    return objection_to_the_last(LayerAssembler(header), {opening});
  };
  EXPECT_EQ(objection(10'000, 12'000), "");
  EXPECT_THAT(objection(10'000, 8 << 20), HasSubstr("a plane of impossible size"));
  EXPECT_THAT(objection(8 << 20, 10'000), HasSubstr("a plane of impossible size"));
  EXPECT_THAT(objection(std::numeric_limits<std::uint64_t>::max(), 10'000), HasSubstr("a plane of impossible size"));
}

TEST(LayerAssembler, IsCompleteWithItsSummaryOnly) {
  LayerAssembler assembler(contours_only());
  (void)assembler.add(begin(0));
  EXPECT_TRUE(assembler.add(end()));
  EXPECT_FALSE(assembler.complete());
  v1::SliceRangeResponse summary;
  summary.mutable_summary()->set_layers(1);
  (void)assembler.add(v1::SliceRangeResponse(summary));
  EXPECT_TRUE(assembler.complete());
  EXPECT_THROW(assembler.add(std::move(summary)), ClientError);
}

}  // namespace
}  // namespace ccslice::client
