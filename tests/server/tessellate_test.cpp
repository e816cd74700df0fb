// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

struct Surface {
  grpc::Status status;
  v1::TessellationHeader header;
  std::vector<double> positions_mm;
  std::vector<float> materials;
  std::vector<std::uint32_t> vertices;
};

class Tessellate : public ::testing::Test {
 protected:
  Surface run() {
    grpc::ClientContext context;
    Surface surface;
    const auto reader = server_.stub().TessellateBoundary(&context, request_);
    v1::TessellateBoundaryResponse message;
    while (reader->Read(&message)) {
      EXPECT_LT(message.ByteSizeLong(), (1u << 20) + 100);
      if (message.has_header()) surface.header = message.header();
      const v1::VertexChunk& vertices = message.vertex_chunk();
      if (message.has_vertex_chunk()) {
        EXPECT_EQ(vertices.first_vertex(), surface.positions_mm.size() / 3);
      }
      surface.positions_mm.insert(surface.positions_mm.end(), vertices.positions_mm().begin(),
                                  vertices.positions_mm().end());
      surface.materials.insert(surface.materials.end(), vertices.channel_values().begin(),
                               vertices.channel_values().end());
      const auto& triangles = message.triangle_chunk().vertices();
      surface.vertices.insert(surface.vertices.end(), triangles.begin(), triangles.end());
    }
    surface.status = reader->Finish();
    return surface;
  }

  static double volume(const Surface& surface) {
    double six_volumes = 0;
    for (std::size_t t = 0; t < surface.vertices.size(); t += 3) {
      const double* a = &surface.positions_mm[3 * surface.vertices[t]];
      const double* b = &surface.positions_mm[3 * surface.vertices[t + 1]];
      const double* c = &surface.positions_mm[3 * surface.vertices[t + 2]];
      six_volumes +=
          a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return six_volumes / 6;
  }

  explicit Tessellate(const ServerOptions& options = test_options()) : server_(options) {}

  TestServer server_;
  v1::TessellateBoundaryRequest request_;
};

TEST_F(Tessellate, GivesAWatertightSurface) {
  request_.set_mesh_id(server_.upload_good(make_block(2, 10)));
  request_.set_chord_tolerance_mm(0.02);
  request_.set_max_chunk_bytes(4096);
  const Surface surface = run();
  ASSERT_TRUE(surface.status.ok()) << surface.status.error_message();
  EXPECT_EQ(surface.header.vertex_count(), surface.positions_mm.size() / 3);
  EXPECT_EQ(surface.header.triangle_count(), surface.vertices.size() / 3);
  EXPECT_EQ(surface.materials.size(), surface.positions_mm.size() / 3);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::size_t t = 0; t < surface.vertices.size(); t += 3) {
    for (std::size_t i = 0; i < 3; ++i) ++sides[{surface.vertices[t + i], surface.vertices[t + (i + 1) % 3]}];
  }
  for (const auto& [side, count] : sides) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(sides.count({side.second, side.first}), 1u);
  }
  EXPECT_GT(volume(surface), 0);
}

TEST_F(Tessellate, ABoxHasItsVolumeMirroredOrNot) {
  request_.set_mesh_id(server_.upload_good(make_box(2, 10)));
  EXPECT_NEAR(volume(run()), 1000, 1e-6);
  for (const double number : {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0}) request_.mutable_placement()->add_matrix(number);
  EXPECT_NEAR(volume(run()), 2000, 1e-6);
}

TEST_F(Tessellate, RefusesWhatItCantDo) {
  request_.set_mesh_id(mesh_id_of("unknown"));
  EXPECT_EQ(failure_of(run().status).reason, "MESH_MISSING");
  request_.set_mesh_id(server_.upload_good(make_block(1, 10)));
  for (const double tolerance : {0.0, -1.0, 1e-9, 1e9, std::nan("")}) {
    request_.set_chord_tolerance_mm(tolerance);
    EXPECT_EQ(failure_of(run().status).reason, "TOLERANCE_INVALID");
    EXPECT_EQ(failure_of(run().status).field, "chord_tolerance_mm");
  }
  request_.set_chord_tolerance_mm(0.1);
  request_.set_max_chunk_bytes(1);
  EXPECT_EQ(failure_of(run().status).reason, "CHUNK_SIZE_INVALID");
}

/// A server whose calls may hold few triangles.
class CrampedTessellate : public Tessellate {
 protected:
  static ServerOptions options() {
    ServerOptions options = test_options();
    options.stream_window_bytes = 1 << 20;
    return options;
  }
  CrampedTessellate() : Tessellate(options()) {}
};

TEST_F(CrampedTessellate, RefusesTrianglesThatDontFitWithTheirChannels) {
  request_.set_mesh_id(server_.upload_good(make_block(2, 10)));
  request_.set_chord_tolerance_mm(0.01);
  const Surface few_channels = run();
  ASSERT_TRUE(few_channels.status.ok()) << few_channels.status.error_message();
  request_.set_mesh_id(server_.upload_good(with_channels(make_block(2, 10), 64)));
  const Failure refused = failure_of(run().status);
  EXPECT_EQ(refused.reason, "TOO_MANY_TRIANGLES") << few_channels.header.triangle_count() << " triangles";
  EXPECT_FALSE(refused.retry);
  EXPECT_NE(refused.message.find("choose a larger one"), std::string::npos) << refused.message;
}

}  // namespace
}  // namespace ccslice::server
