// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/surface_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using Stream = std::vector<v1::TessellateBoundaryResponse>;

v1::TessellateBoundaryResponse header(std::uint64_t vertices, std::uint64_t triangles, int channels = 0) {
  v1::TessellateBoundaryResponse message;
  message.mutable_header()->set_vertex_count(vertices);
  message.mutable_header()->set_triangle_count(triangles);
  for (int i = 0; i < channels; ++i) message.mutable_header()->add_channels();
  return message;
}

v1::TessellateBoundaryResponse vertices(std::uint64_t first, int count) {
  v1::TessellateBoundaryResponse message;
  message.mutable_vertex_chunk()->set_first_vertex(first);
  for (int i = 0; i < 3 * count; ++i) message.mutable_vertex_chunk()->add_positions_mm(i);
  return message;
}

v1::TessellateBoundaryResponse triangles(std::uint64_t first, int count) {
  v1::TessellateBoundaryResponse message;
  message.mutable_triangle_chunk()->set_first_triangle(first);
  for (int i = 0; i < 3 * count; ++i) message.mutable_triangle_chunk()->add_vertices(static_cast<std::uint32_t>(i % 3));
  return message;
}

/// What is wrong with the last message of a stream, the first one to be refused.
std::string objection_to_the_last(const Stream& stream) {
  SurfaceAssembler assembler;
  for (std::size_t i = 0; i + 1 < stream.size(); ++i) assembler.add(stream[i]);
  try {
    assembler.add(stream.back());
  } catch (const ClientError& error) {
    EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt);
    return error.what();
  }
  return {};
}

TEST(SurfaceAssembler, PutsChunksTogether) {
  SurfaceAssembler assembler;
  for (const auto& message : Stream{header(4, 3), vertices(0, 3), vertices(3, 1), triangles(0, 2), triangles(2, 1)}) {
    assembler.add(message);
  }
  const Surface surface = std::move(assembler).finish();
  EXPECT_EQ(surface.points_mm.size(), 4u);
  EXPECT_THAT(surface.triangles.at(2), ElementsAre(0, 1, 2));
}

TEST(SurfaceAssembler, RefusesStreamsThatEndTooSoon) {
  for (const Stream& stream : {Stream{}, {header(3, 1), vertices(0, 3)}, {header(4, 1), vertices(0, 3)}}) {
    SurfaceAssembler assembler;
    for (const auto& message : stream) assembler.add(message);
    EXPECT_THROW(std::move(assembler).finish(), ClientError);
  }
}

TEST(SurfaceAssembler, RefusesWhatIsOutOfOrder) {
  EXPECT_THAT(objection_to_the_last({header(3, 1), header(3, 1)}), HasSubstr("a second header"));
  EXPECT_THAT(objection_to_the_last({vertices(0, 3)}), HasSubstr("vertices out of order"));
  EXPECT_THAT(objection_to_the_last({header(4, 1), vertices(0, 3), vertices(0, 1)}), HasSubstr("out of order"));
  EXPECT_THAT(objection_to_the_last({header(3, 1, 1), vertices(0, 3)}), HasSubstr("without all their numbers"));
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 2), triangles(0, 1)}), HasSubstr("unknown vertex"));
}

TEST(SurfaceAssembler, TakesNoMoreThanIsAnnounced) {
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 3), vertices(3, 1)}), HasSubstr("than announced"));
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 4)}), HasSubstr("than announced"));
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 3), triangles(0, 2)}), HasSubstr("than announced"));
}

TEST(SurfaceAssembler, TakesNoChunksThatBringNothing) {
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 0)}), HasSubstr("an empty chunk"));
  EXPECT_THAT(objection_to_the_last({header(3, 1), vertices(0, 3), triangles(0, 0)}), HasSubstr("an empty chunk"));
}

TEST(SurfaceAssembler, TakesNoSurfacesOfImpossibleSize) {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  EXPECT_EQ(objection_to_the_last({header(10'000'000, 20'000'000, 64)}), "") << "as much as servers make";
  EXPECT_THAT(objection_to_the_last({header(kMost, 20'000'000)}), HasSubstr("impossible size"));
  EXPECT_THAT(objection_to_the_last({header(10'000'000, kMost)}), HasSubstr("impossible size"));
  EXPECT_THAT(objection_to_the_last({header(10'000'000, 20'000'000, 1'000'000)}), HasSubstr("impossible size"));
}

}  // namespace
}  // namespace ccslice::client
