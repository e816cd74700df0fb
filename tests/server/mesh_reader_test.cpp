// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/mesh_reader.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <random>
#include <thread>

#include "ccslice/v1/mesh.pb.h"
#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "tests/server/test_meshes.h"
#include "tests/support/processor_time.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// Cut into blocks of this size.
std::vector<std::string> cut(const std::string& bytes, std::size_t block_bytes) {
  std::vector<std::string> blocks;
  for (std::size_t at = 0; at < bytes.size(); at += block_bytes) blocks.push_back(bytes.substr(at, block_bytes));
  return blocks;
}

ControlMesh read(const std::string& bytes) { return read_control_mesh({bytes}); }

ErrorCode code_of(const std::string& bytes, const MeshLimits& limits = {}) {
  try {
    read_control_mesh({bytes}, limits);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode{};
}

void expect_same(const MidNodes& nodes, const v1::ControlMesh& message) {
  std::vector<std::uint32_t> edges, faces;
  for (const auto& edge : nodes.edges) edges.insert(edges.end(), edge.begin(), edge.end());
  for (const auto& face : nodes.faces) faces.insert(faces.end(), face.begin(), face.end());
  EXPECT_TRUE(std::ranges::equal(edges, message.edge_node_vertices()));
  EXPECT_TRUE(std::ranges::equal(faces, message.face_node_vertices()));
  EXPECT_TRUE(std::ranges::equal(nodes.cells, message.cell_node_cells()));
  EXPECT_TRUE(std::ranges::equal(nodes.values, message.node_values()));
  ASSERT_EQ(3 * nodes.positions.size(), static_cast<std::size_t>(message.node_positions_mm_size()));
  for (int i = 0; i < message.node_positions_mm_size(); ++i) {
    EXPECT_EQ(nodes.positions[static_cast<std::size_t>(i / 3)][i % 3], message.node_positions_mm(i));
  }
}

void expect_same(const ControlMesh& mesh, const v1::ControlMesh& message) {
  ASSERT_EQ(3 * mesh.positions.size(), static_cast<std::size_t>(message.positions_mm_size()));
  for (int i = 0; i < message.positions_mm_size(); ++i) {
    EXPECT_EQ(mesh.positions[static_cast<std::size_t>(i / 3)][i % 3], message.positions_mm(i));
  }
  EXPECT_EQ(mesh.channel_names,
            std::vector<std::string>(message.channel_names().begin(), message.channel_names().end()));
  EXPECT_EQ(mesh.channel_values, std::vector<float>(message.channel_values().begin(), message.channel_values().end()));
  EXPECT_EQ(mesh.cell_kinds.size(), static_cast<std::size_t>(message.cell_kinds_size()));
  EXPECT_EQ(mesh.cell_vertices,
            std::vector<std::uint32_t>(message.cell_vertices().begin(), message.cell_vertices().end()));
  ASSERT_EQ(2 * mesh.sharp_edges.size(), static_cast<std::size_t>(message.sharp_edges_size()));
  for (int i = 0; i < message.sharp_edges_size(); ++i) {
    EXPECT_EQ(mesh.sharp_edges[static_cast<std::size_t>(i / 2)][static_cast<std::size_t>(i % 2)],
              message.sharp_edges(i));
  }
  EXPECT_EQ(mesh.sharp_vertices,
            std::vector<std::uint32_t>(message.sharp_vertices().begin(), message.sharp_vertices().end()));
  EXPECT_EQ(mesh.allow_folds, message.allow_folds());
  EXPECT_EQ(mesh.interpolating, message.interpolating());
  EXPECT_EQ(mesh.cell_region_names,
            std::vector<std::string>(message.cell_region_names().begin(), message.cell_region_names().end()));
  EXPECT_EQ(mesh.cell_regions, std::vector<std::uint8_t>(message.cell_regions().begin(), message.cell_regions().end()));
  EXPECT_TRUE(std::ranges::equal(mesh.region_value_vertices, message.region_value_vertices()));
  EXPECT_TRUE(std::ranges::equal(mesh.region_value_regions, message.region_value_regions()));
  EXPECT_TRUE(std::ranges::equal(mesh.region_values, message.region_values()));
  EXPECT_TRUE(std::ranges::equal(mesh.missed_vertices, message.missed_vertices(), {}, &MissedVertex::vertex));
  ASSERT_EQ(3 * mesh.missed_vertices.size(), static_cast<std::size_t>(message.missed_positions_mm_size()));
  for (int i = 0; i < message.missed_positions_mm_size(); ++i) {
    EXPECT_EQ(mesh.missed_vertices[static_cast<std::size_t>(i / 3)].position[i % 3], message.missed_positions_mm(i));
  }
  EXPECT_EQ(mesh.as_meshed, message.as_meshed());
  expect_same(mesh.mid_nodes, message);
}

v1::ControlMesh some_mesh() {
  v1::ControlMesh mesh = make_box(3, 10);
  mesh.add_cell_kinds(v1::CELL_KIND_TET);
  mesh.add_cell_kinds(v1::CELL_KIND_WEDGE);
  for (std::uint32_t i = 0; i < 10; ++i) mesh.add_cell_vertices(0x12345678u * i);
  mesh.add_channel_names("Härte");
  mesh.set_allow_folds(true);
  mesh.set_interpolating(true);
  for (const char* name : {"core", "Hülle"}) mesh.add_cell_region_names(name);
  for (const std::uint32_t region : {1u, 0u, 254u}) mesh.add_cell_regions(region);
  for (const std::uint32_t vertex : {0u, 77u, 0xffffffffu}) mesh.add_region_value_vertices(vertex);
  for (const std::uint32_t region : {254u, 3u}) mesh.add_region_value_regions(region);
  for (const float value : {0.5f, -3e38f}) mesh.add_region_values(value);
  for (const std::uint32_t vertex : {7u, 0xffffffffu}) mesh.add_missed_vertices(vertex);
  for (const double number : {0.25, -0.0, 1e300, 4., 5., 6.}) mesh.add_missed_positions_mm(number);
  mesh.set_as_meshed(true);
  for (const std::uint32_t vertex : {0u, 0xffffffffu, 1u, 2u}) mesh.add_edge_node_vertices(vertex);
  for (const std::uint32_t vertex : {0u, 1u, 2u, 0xffffffffu}) mesh.add_face_node_vertices(vertex);
  for (const std::uint32_t cell : {3u, 0xffffffffu}) mesh.add_cell_node_cells(cell);
  for (const double number : {1., -0.0, 1e300}) mesh.add_node_positions_mm(number);
  for (const float value : {0.25f, 3e38f}) mesh.add_node_values(value);
  return mesh;
}

TEST(MeshReader, ReadsWhatProtobufWroteHoweverItIsCut) {
  const v1::ControlMesh mesh = some_mesh();
  const std::string bytes = mesh.SerializeAsString();
  for (const std::size_t block : {std::size_t{1}, std::size_t{7}, std::size_t{1000}, bytes.size()}) {
    expect_same(read_control_mesh(cut(bytes, block)), mesh);
  }
  expect_same(read_control_mesh({}), v1::ControlMesh());
}

/// Every value with a tag of its own, fields mixed, as other writers may do.
TEST(MeshReader, ReadsUnpackedAndRepeatedFieldsLikeProtobuf) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    for (int i = 0; i < 6; ++i) {
      out.WriteTag(1 << 3 | 1);  // positions_mm, fixed64.
      out.WriteLittleEndian64(0x3ff0000000000000ull + static_cast<std::uint64_t>(i));
      out.WriteTag(6 << 3);  // sharp_edges, varint.
      out.WriteVarint32(static_cast<std::uint32_t>(i) << 20);
      out.WriteTag(3 << 3 | 5);  // channel_values, fixed32.
      out.WriteLittleEndian32(0x3f800000u + static_cast<std::uint32_t>(i));
      out.WriteTag(8 << 3);  // allow_folds.
      out.WriteVarint64(i % 2);
      out.WriteTag(9 << 3);  // interpolating.
      out.WriteVarint64((i + 1) % 2);
    }
  }
  v1::ControlMesh packed;
  packed.add_positions_mm(7);
  packed.add_positions_mm(8);
  packed.add_positions_mm(9);
  bytes += packed.SerializeAsString() + packed.SerializeAsString();
  v1::ControlMesh message;
  ASSERT_TRUE(message.ParseFromString(bytes));
  expect_same(read(bytes), message);
}

/// Bytes changed at random: what protobuf takes, comes out the same; nothing else happens than that or an Error.
TEST(MeshReaderConsistency, AgreesWithProtobufOnDamagedBytes) {
  constexpr unsigned kSeed = 20261121;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 random(kSeed);
  v1::ControlMesh small = make_plain_block(1, 10);
  small.add_channel_names("a");
  const std::string bytes = small.SerializeAsString();
  for (int round = 0; round < 20'000; ++round) {
    std::string damaged = bytes;
    for (unsigned change = 0; change <= random() % 3; ++change) {
      damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    if (random() % 4 == 0) damaged.resize(random() % damaged.size());
    v1::ControlMesh message;
    const bool parsed = message.ParseFromString(damaged);
    try {
      const ControlMesh mesh = read_control_mesh(cut(damaged, 1 + random() % 50));
      ASSERT_TRUE(parsed) << round;
      ASSERT_EQ(mesh.positions.size() * 3, static_cast<std::size_t>(message.positions_mm_size()));
      ASSERT_EQ(mesh.cell_vertices,
                std::vector<std::uint32_t>(message.cell_vertices().begin(), message.cell_vertices().end()));
      ASSERT_EQ(mesh.channel_names.size(), static_cast<std::size_t>(message.channel_names_size()));
    } catch (const Error&) {
    }
  }
}

TEST(MeshReader, RefusesWhatIsNoMesh) {
  EXPECT_EQ(code_of("\x0a\x08" + std::string(7, 'x')), ErrorCode::kMeshMalformed) << "cut off";
  EXPECT_EQ(code_of("\x0a\x07" + std::string(7, 'x')), ErrorCode::kMeshMalformed) << "not whole doubles";
  EXPECT_EQ(code_of("\x0a\xff\xff\xff\xff\x0f"), ErrorCode::kMeshMalformed) << "a length of 4 GiB";
  EXPECT_EQ(code_of(std::string("\x00", 1)), ErrorCode::kMeshMalformed);
  EXPECT_EQ(code_of("\x8a\x01\x01x"), ErrorCode::kMeshUnknownField) << "an unknown field";
  EXPECT_EQ(code_of("\x78\x05"), ErrorCode::kMeshArrayMismatch) << "a missed vertex without its place";
  EXPECT_EQ(code_of("\x82\x01\x08" + std::string(8, 'x')), ErrorCode::kMeshArrayMismatch) << "and half a place alone";
  EXPECT_EQ(code_of("\x82\x01\x07" + std::string(7, 'x')), ErrorCode::kMeshMalformed) << "not whole doubles";
  EXPECT_EQ(code_of("\x12\x01\xff"), ErrorCode::kMeshMalformed) << "not UTF-8";
  EXPECT_EQ(code_of("\x22\x01\x04"), ErrorCode::kMeshUnsupportedCell) << "a pyramid";
  EXPECT_EQ(code_of("\x22\x01\x05"), ErrorCode::kMeshUnknownCellKind);
  EXPECT_EQ(code_of("\x38\x05"), ErrorCode{}) << "a sharp vertex alone: for the core to judge";
}

TEST(MeshReader, KeepsTheLimitsWhileItReads) {
  MeshLimits limits;
  limits.max_vertices = 20;
  EXPECT_EQ(code_of(make_block(2, 10).SerializeAsString(), limits), ErrorCode::kMeshTooLarge);
  v1::ControlMesh missed;
  missed.mutable_missed_vertices()->Resize(21, 0);
  EXPECT_EQ(code_of(missed.SerializeAsString(), limits), ErrorCode::kMeshTooLarge);
  missed.clear_missed_vertices();
  missed.mutable_missed_positions_mm()->Resize(61, 0);
  EXPECT_EQ(code_of(missed.SerializeAsString(), limits), ErrorCode::kMeshTooLarge);
  limits = {};
  limits.max_cells = 7;
  EXPECT_EQ(code_of(make_block(2, 10).SerializeAsString(), limits), ErrorCode::kMeshTooLarge);
  std::string names;
  for (int i = 0; i < 65; ++i) names += std::string("\x12\x00", 2);
  EXPECT_EQ(code_of(names), ErrorCode::kMeshTooLarge);
  EXPECT_EQ(code_of("\x12\x81\x02" + std::string(257, 'x')), ErrorCode::kMeshBadChannel) << "a name of 257 bytes";
  EXPECT_EQ(code_of("\x52\x81\x02" + std::string(257, 'x')), ErrorCode::kMeshBadCellRegion) << "cell_region_names";
  EXPECT_EQ(code_of("\x58\xff\x01"), ErrorCode::kMeshBadCellRegion) << "cell region 255";
  EXPECT_EQ(code_of("\x58\x80\x80\x04"), ErrorCode::kMeshBadCellRegion) << "cell region 65536";
  EXPECT_EQ(code_of("\x68\xff\x01"), ErrorCode::kMeshBadCellRegion) << "255 in region_value_regions";
}

TEST(MeshReader, StopsSoonAfterACancel) {
  v1::ControlMesh mesh;
  mesh.mutable_sharp_vertices()->Resize(40'000'000, 1);
  const std::vector<std::string> blocks = cut(mesh.SerializeAsString(), 1 << 20);
  MeshLimits limits;
  limits.max_vertices = 200'000'000;
  const CancellationToken cancel = CancellationToken::make();
  std::optional<ProcessorTime> used;
  std::thread canceller([&] {
    std::this_thread::sleep_for(5ms);
    used.emplace();
    cancel.cancel();
  });
  EXPECT_THROW(read_control_mesh(blocks, limits, cancel), Error);
  canceller.join();
  EXPECT_LT(used->seconds(), 0.1);
}

}  // namespace
}  // namespace ccslice::server
