// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/layer_messages.h"

#include <gtest/gtest.h>

#include <vector>

namespace ccslice::server {
namespace {

std::vector<v1::SliceRangeResponse> all_messages(Layer layer, std::uint32_t max_chunk_bytes) {
  LayerMessages messages(std::move(layer), max_chunk_bytes);
  std::vector<v1::SliceRangeResponse> all;
  v1::SliceRangeResponse message;  // Used again and again, like in a call.
  while (messages.next(message)) all.push_back(message);
  return all;
}

EncodedPlane make_plane(std::size_t bytes) {
  EncodedPlane plane;
  for (std::size_t i = 0; i < bytes; ++i) plane.bytes.push_back(static_cast<std::uint8_t>(i * 31));
  plane.raw_bytes = 7;
  plane.crc32 = 0xdeadbeef;
  return plane;
}

TEST(LayerMessages, CutsPlanesIntoChunksInOrder) {
  Layer layer;
  layer.index = 5;
  layer.planes = {make_plane(10'000), make_plane(0), make_plane(4096)};
  const auto all = all_messages(layer, 4096);
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0].layer_begin().encoded_bytes(0), 10'000u);
  std::string first;
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ(all[i].plane_chunk().plane(), 0u);
    EXPECT_EQ(all[i].plane_chunk().offset(), first.size());
    first += all[i].plane_chunk().data();
  }
  EXPECT_EQ(first, std::string(layer.planes[0].bytes.begin(), layer.planes[0].bytes.end()));
  EXPECT_EQ(all[4].plane_chunk().plane(), 2u);
  EXPECT_EQ(all[5].layer_end().planes(0).crc32(), 0xdeadbeef);
  EXPECT_TRUE(all[5].layer_end().empty());
}

TEST(LayerMessages, CutsContoursIntoPiecesThatNeverExceedTheChunk) {
  Layer layer;
  for (const std::size_t points : {1000u, 3u, 5u, 400u}) {
    ContourLoop loop;
    for (std::size_t i = 0; i < points; ++i) {
      loop.points.push_back(
          {.face = BoundaryFaceId{0xffffffff}, .s = 0.5, .t = 0.25, .xy = {static_cast<double>(i), 1}});
    }
    layer.contours.loops.push_back(loop);
  }
  std::vector<std::size_t> lengths(4);
  std::vector<bool> ended(4);
  for (const auto& message : all_messages(layer, 4096)) {
    EXPECT_LE(message.ByteSizeLong(), 4096u);
    for (const v1::ContourPiece& piece : message.contour_chunk().pieces()) {
      EXPECT_EQ(piece.first_point(), lengths[piece.loop()]);
      EXPECT_FALSE(ended[piece.loop()]);
      EXPECT_EQ(piece.points_mm(0), static_cast<double>(piece.first_point()));
      EXPECT_EQ(piece.points_mm_size(), 2 * piece.faces_size());
      EXPECT_EQ(piece.parameters_size(), 2 * piece.faces_size());
      lengths[piece.loop()] += static_cast<std::size_t>(piece.faces_size());
      ended[piece.loop()] = piece.last();
    }
  }
  EXPECT_EQ(lengths, (std::vector<std::size_t>{1000, 3, 5, 400}));
  EXPECT_EQ(ended, std::vector<bool>(4, true));
}

}  // namespace
}  // namespace ccslice::server
