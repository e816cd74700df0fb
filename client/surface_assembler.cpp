// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/surface_assembler.h"

#include <cstdint>
#include <string>
#include <utility>

#include "client/client_error.h"

namespace ccslice::client {

void SurfaceAssembler::add(const v1::TessellateBoundaryResponse& message) {
  switch (message.event_case()) {
    case v1::TessellateBoundaryResponse::kHeader: begin(message.header()); break;
    case v1::TessellateBoundaryResponse::kVertexChunk: add(message.vertex_chunk()); break;
    case v1::TessellateBoundaryResponse::kTriangleChunk: add(message.triangle_chunk()); break;
    default: require_answer(false, "an empty message");
  }
}

void SurfaceAssembler::begin(const v1::TessellationHeader& header) {
  // Servers make 20 million triangles at most, and half as many vertices, each with up to 64 channels.
  constexpr double kMostBytes = 8.0 * (1 << 30);
  require_answer(!begun_, "a second header");
  const double vertex_bytes = sizeof(surface_.points_mm[0]) + sizeof(float) * header.channels_size();
  const double bytes = vertex_bytes * static_cast<double>(header.vertex_count()) +
                       sizeof(surface_.triangles[0]) * static_cast<double>(header.triangle_count());
  require_answer(bytes <= kMostBytes, "a surface of impossible size");
  begun_ = true;
  surface_.header = header;
}

Surface SurfaceAssembler::finish() && {
  require_answer(begun_ && surface_.points_mm.size() == surface_.header.vertex_count() &&
                     surface_.triangles.size() == surface_.header.triangle_count(),
                 "it ended before all triangles came");
  return std::move(surface_);
}

void SurfaceAssembler::add(const v1::VertexChunk& chunk) {
  require_answer(begun_ && chunk.first_vertex() == surface_.points_mm.size(), "vertices out of order");
  const int points = chunk.positions_mm_size() / 3;
  require_answer(chunk.positions_mm_size() > 0, "an empty chunk");
  require_answer(chunk.positions_mm_size() == 3 * points &&
                     chunk.channel_values_size() == std::int64_t{points} * surface_.header.channels_size(),
                 "vertices without all their numbers");
  require_answer(static_cast<std::uint64_t>(points) <= surface_.header.vertex_count() - chunk.first_vertex(),
                 "more vertices than announced");
  for (int i = 0; i < 3 * points; i += 3) {
    surface_.points_mm.push_back({chunk.positions_mm(i), chunk.positions_mm(i + 1), chunk.positions_mm(i + 2)});
  }
  surface_.channel_values.insert(surface_.channel_values.end(), chunk.channel_values().begin(),
                                 chunk.channel_values().end());
}

void SurfaceAssembler::add(const v1::TriangleChunk& chunk) {
  require_answer(begun_ && chunk.first_triangle() == surface_.triangles.size(), "triangles out of order");
  require_answer(chunk.vertices_size() > 0, "an empty chunk");
  require_answer(chunk.vertices_size() % 3 == 0, "part of a triangle");
  require_answer(static_cast<std::uint64_t>(chunk.vertices_size()) / 3 <=
                     surface_.header.triangle_count() - chunk.first_triangle(),
                 "more triangles than announced");
  for (int i = 0; i < chunk.vertices_size(); i += 3) {
    surface_.triangles.push_back({chunk.vertices(i), chunk.vertices(i + 1), chunk.vertices(i + 2)});
    for (const std::uint32_t vertex : surface_.triangles.back()) {
      require_answer(vertex < surface_.points_mm.size(), "a triangle of an unknown vertex");
    }
  }
}

}  // namespace ccslice::client
