// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include "server/service/meshes/mesh_id.h"
#include "server/service/meshes/mesh_room.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

using ::testing::HasSubstr;
using ::testing::StrEq;

TEST(UploadMesh, AnswersTheSummary) {
  TestServer server;
  const v1::ControlMesh mesh = make_box(2, 10);
  v1::UploadMeshResponse response;
  const grpc::Status status = server.upload(mesh, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const v1::MeshSummary& summary = response.mesh();
  EXPECT_EQ(summary.mesh_id(), mesh_id_of(mesh.SerializeAsString()));
  EXPECT_EQ(summary.size_bytes(), mesh.SerializeAsString().size());
  EXPECT_EQ(summary.control_cells(), 8u);
  EXPECT_EQ(summary.control_vertices(), 27u);
  EXPECT_EQ(summary.sharp_edges(), 24u);
  EXPECT_EQ(summary.limit_cells(), summary.regular_cells() + summary.line_cells() + summary.vertex_cells());
  EXPECT_GT(summary.memory_bytes(), 0u);
  EXPECT_NEAR(summary.bounding_box().max_mm().x(), 10, 1e-9);
  EXPECT_NEAR(summary.bounding_box().min_mm().z(), 0, 1e-9);
  ASSERT_EQ(summary.channels_size(), 1);
  EXPECT_EQ(summary.channels(0).name(), "x");
  EXPECT_EQ(summary.channels(0).max_value(), 10);
  EXPECT_FALSE(response.already_cached());
  EXPECT_FALSE(summary.engine_version().empty());
}

TEST(UploadMesh, IsIdempotentAndTheSecondTimeNeedsNoBytes) {
  TestServer server;
  const std::string id = server.upload_good(make_block(1, 10));
  v1::UploadMeshResponse response;
  const grpc::Status status = server.upload(id, 12345, "", &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(response.already_cached());
  EXPECT_EQ(response.mesh().mesh_id(), id);
}

TEST(UploadMesh, ManyAtTheSameTimePrepareOnce) {
  TestServer server;
  const v1::ControlMesh mesh = make_block(6, 10);
  std::vector<std::thread> clients;
  std::vector<v1::UploadMeshResponse> responses(6);
  for (v1::UploadMeshResponse& response : responses) {
    clients.emplace_back([&] { EXPECT_TRUE(server.upload(mesh, &response).ok()); });
  }
  for (std::thread& client : clients) client.join();
  // One preparation: everybody sees the time at which it ended.
  for (const v1::UploadMeshResponse& response : responses) {
    EXPECT_EQ(response.mesh().create_time().SerializeAsString(), responses[0].mesh().create_time().SerializeAsString());
  }
  EXPECT_EQ(server.server().state().cache.use().meshes, 1u);
  EXPECT_EQ(server.server().state().uploads.used_bytes(), 0u);
}

class RefusedUpload : public ::testing::Test {
 protected:
  ~RefusedUpload() override {
    EXPECT_EQ(server_.server().state().cache.use().meshes, 0u) << "cached something wrong";
    EXPECT_TRUE(
        eventually([this] { return server_.server().state().uploads.used_bytes() == 0; }, std::chrono::seconds(1)));
    EXPECT_TRUE(server_.upload(make_block(1, 10)).ok()) << "the server is still up";
  }

  void expect(const grpc::Status& status, const std::string& reason, const std::string& field) {
    const Failure failure = failure_of(status);
    EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(failure.reason, reason);
    EXPECT_EQ(failure.domain, "ccslice");
    EXPECT_EQ(failure.field, field);
    EXPECT_FALSE(failure.message.empty());
  }

  TestServer server_;
  const std::string bytes_ = make_block(1, 10).SerializeAsString();
  const std::string id_ = mesh_id_of(bytes_);
};

TEST_F(RefusedUpload, Truncated) {
  expect(server_.upload(id_, bytes_.size(), bytes_.substr(1)), "UPLOAD_TRUNCATED", "chunk");
}

TEST_F(RefusedUpload, Overrun) { expect(server_.upload(id_, bytes_.size() - 1, bytes_), "UPLOAD_OVERRUN", "chunk"); }

TEST_F(RefusedUpload, WrongDigest) {
  expect(server_.upload(mesh_id_of("other"), bytes_.size(), bytes_), "UPLOAD_DIGEST_MISMATCH", "start.mesh_id");
}

TEST_F(RefusedUpload, WrongId) {
  expect(server_.upload("md5:1", bytes_.size(), bytes_), "MESH_ID_INVALID", "start.mesh_id");
}

TEST_F(RefusedUpload, AbsurdSize) {
  expect(server_.upload(id_, std::numeric_limits<std::uint64_t>::max(), bytes_), "UPLOAD_SIZE_INVALID",
         "start.size_bytes");
  expect(server_.upload(id_, 0, bytes_), "UPLOAD_SIZE_INVALID", "start.size_bytes");
}

TEST_F(RefusedUpload, ChunkWithoutStart) {
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server_.stub().UploadMesh(&context, &response);
  v1::UploadMeshRequest message;
  message.set_chunk("abc");
  writer->Write(message);
  writer->WritesDone();
  expect(writer->Finish(), "REQUEST_MALFORMED", "start");
}

TEST_F(RefusedUpload, NoMessageAtAll) {
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server_.stub().UploadMesh(&context, &response);
  writer->WritesDone();
  expect(writer->Finish(), "REQUEST_MALFORMED", "start");
}

TEST_F(RefusedUpload, NoPart) {
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server_.stub().UploadMesh(&context, &response);
  writer->Write(v1::UploadMeshRequest());
  writer->WritesDone();
  expect(writer->Finish(), "REQUEST_MALFORMED", "part");
}

TEST_F(RefusedUpload, BytesThatAreNoMesh) {
  const std::string bytes = "\xff\xff\xff\xff";
  expect(server_.upload(mesh_id_of(bytes), bytes.size(), bytes), "MESH_MALFORMED", "chunk");
}

TEST_F(RefusedUpload, FieldsOfALaterVersion) {
  const std::string bytes = bytes_ + "\xf8\x01\x07";  // Field 31, a number.
  expect(server_.upload(mesh_id_of(bytes), bytes.size(), bytes), "MESH_UNKNOWN_FIELD", "31");
}

TEST_F(RefusedUpload, EmptyMesh) {
  v1::ControlMesh mesh;
  mesh.set_allow_folds(true);  // Zero bytes would be refused for their size.
  EXPECT_EQ(failure_of(server_.upload(mesh)).reason, "MESH_EMPTY");
}

struct BadMesh {
  const char* reason;
  const char* field;
  void (*spoil)(v1::ControlMesh& mesh);
};

class RefusedMesh : public ::testing::TestWithParam<BadMesh> {};

TEST_P(RefusedMesh, HasItsReasonAndNamesTheField) {
  TestServer server;
  v1::ControlMesh mesh = make_block(2, 10);
  GetParam().spoil(mesh);
  const Failure failure = failure_of(server.upload(mesh));
  EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(failure.reason, GetParam().reason) << failure.message;
  EXPECT_THAT(failure.field, StrEq(GetParam().field)) << failure.message;
  EXPECT_EQ(server.server().state().cache.use().meshes, 0u);
}

const double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// Two blocks that share one vertex, or one edge.
void add_cell_beyond(v1::ControlMesh& mesh, std::initializer_list<std::uint32_t> shared) {
  const auto first = static_cast<std::uint32_t>(mesh.positions_mm_size() / 3);
  std::vector<std::uint32_t> corner = {first,     first + 1, first + 2, first + 3,
                                       first + 4, first + 5, first + 6, first + 7};
  std::uint32_t k = 0;
  std::uint32_t added = 0;
  for (const std::uint32_t vertex : shared) corner[k++] = vertex;
  for (; k < 8; ++k) corner[k] = first + added++;
  const double places[8][3] = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, 1, 1}, {1, 0, 0}, {1, 0, 1}, {1, 1, 0}, {1, 1, 1}};
  for (std::uint32_t i = static_cast<std::uint32_t>(shared.size()); i < 8; ++i) {
    for (const double x : places[i]) mesh.add_positions_mm(10 + 5 * x);
    mesh.add_channel_values(0);
  }
  mesh.add_cell_kinds(v1::CELL_KIND_HEX);
  for (const int order : {0, 4, 6, 2, 1, 5, 7, 3}) mesh.add_cell_vertices(corner[static_cast<std::size_t>(order)]);
}

void add_missed(v1::ControlMesh& mesh, std::initializer_list<std::uint32_t> vertices) {
  mesh.set_interpolating(true);
  for (const std::uint32_t vertex : vertices) {
    mesh.add_missed_vertices(vertex);
    for (int i = 0; i < 3; ++i) mesh.add_missed_positions_mm(1);
  }
}

/// A mid-node, with a value of the mesh's channel.
void add_edge_node(v1::ControlMesh& mesh, std::uint32_t a, std::uint32_t b) {
  mesh.set_as_meshed(true);
  for (const std::uint32_t vertex : {a, b}) mesh.add_edge_node_vertices(vertex);
  for (int i = 0; i < 3; ++i) mesh.add_node_positions_mm(1);
  mesh.add_node_values(1);
}

INSTANTIATE_TEST_SUITE_P(UploadMesh, RefusedMesh,
                         ::testing::Values(BadMesh{"MESH_NON_FINITE", "positions_mm[4]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_positions_mm(4, kNotANumber);
                                                   }},
                                           BadMesh{"MESH_NON_FINITE", "positions_mm[4]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_positions_mm(4, std::numeric_limits<double>::infinity());
                                                   }},
                                           BadMesh{"MESH_NON_FINITE", "channel_values[4]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_channel_values(4, std::numeric_limits<float>::infinity());
                                                   }},
                                           BadMesh{"MESH_COORDINATE_OUT_OF_RANGE", "positions_mm[4]",
                                                   [](v1::ControlMesh& mesh) { mesh.set_positions_mm(4, 1e30); }},
                                           BadMesh{
                                               "MESH_INDEX_OUT_OF_RANGE", "cell_vertices[5]",
                                               [](v1::ControlMesh& mesh) { mesh.set_cell_vertices(5, 4'000'000'000); }},
                                           BadMesh{"MESH_INDEX_OUT_OF_RANGE", "sharp_vertices[0]",
                                                   [](v1::ControlMesh& mesh) { mesh.add_sharp_vertices(27); }},
                                           BadMesh{"MESH_INDEX_OUT_OF_RANGE", "missed_vertices[0]",
                                                   [](v1::ControlMesh& mesh) { add_missed(mesh, {27}); }},
                                           BadMesh{"MESH_REPEATED_VERTEX", "missed_vertices[1]",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_missed(mesh, {3, 3});
                                                   }},
                                           BadMesh{"MESH_NON_FINITE", "missed_positions_mm[4]",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_missed(mesh, {3, 5});
                                                     mesh.set_missed_positions_mm(4, kNotANumber);
                                                   }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "missed_positions_mm",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_missed(mesh, {3});
                                                     mesh.add_missed_positions_mm(1);
                                                   }},
                                           BadMesh{"MESH_BAD_MID_NODE", "edge_node_vertices",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_edge_node(mesh, 0, 1);
                                                     mesh.set_as_meshed(false);
                                                   }},
                                           BadMesh{"MESH_BAD_MID_NODE", "edge_node_vertices",
                                                   [](v1::ControlMesh& mesh) { add_edge_node(mesh, 0, 26); }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "node_values",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_edge_node(mesh, 0, 1);
                                                     mesh.add_node_values(1);
                                                   }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "face_node_vertices",
                                                   [](v1::ControlMesh& mesh) { mesh.add_face_node_vertices(1); }},
                                           BadMesh{"MESH_BAD_SHARP_FEATURE", "sharp_vertices",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_as_meshed(true);
                                                     mesh.add_sharp_vertices(0);
                                                   }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "missed_vertices",
                                                   [](v1::ControlMesh& mesh) {
                                                     add_missed(mesh, {3});
                                                     mesh.set_interpolating(false);
                                                   }},
                                           BadMesh{"MESH_REPEATED_VERTEX", "cell_vertices[1]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_cell_vertices(1, mesh.cell_vertices(0));
                                                   }},
                                           BadMesh{"MESH_UNSUPPORTED_CELL", "cell_kinds[3]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_cell_kinds(3, v1::CELL_KIND_PYRAMID);
                                                   }},
                                           BadMesh{"MESH_UNKNOWN_CELL_KIND", "cell_kinds[3]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_cell_kinds(3, static_cast<v1::CellKind>(77));
                                                   }},
                                           BadMesh{"MESH_UNKNOWN_CELL_KIND", "cell_kinds[3]",
                                                   [](v1::ControlMesh& mesh) {
                                                     mesh.set_cell_kinds(3, v1::CELL_KIND_UNSPECIFIED);
                                                   }},
                                           BadMesh{
                                               "MESH_ARRAY_MISMATCH", "positions_mm",
                                               [](v1::ControlMesh& mesh) { mesh.add_positions_mm(1); }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "cell_vertices",
                                                   [](v1::ControlMesh& mesh) { mesh.add_cell_vertices(1); }},
                                           BadMesh{"MESH_ARRAY_MISMATCH", "sharp_edges",
                                                   [](v1::ControlMesh& mesh) { mesh.add_sharp_edges(1); }},
                                           BadMesh{
                                               "MESH_ARRAY_MISMATCH", "channel_values",
                                               [](v1::ControlMesh& mesh) { mesh.add_channel_values(1); }},
                                           BadMesh{"MESH_BAD_CHANNEL", "channel_names[0]",
                                                   [](v1::ControlMesh& mesh) { mesh.set_channel_names(0, ""); }},
                                           BadMesh{"MESH_ISOLATED_VERTEX", "positions_mm[81]",
                                                   [](v1::ControlMesh& mesh) {
                                                     for (int i = 0; i < 3; ++i) mesh.add_positions_mm(99);
                                                     mesh.add_channel_values(0);
                                                   }},
                                           BadMesh{"MESH_INVERTED_CELL", "cell_vertices",
                                                   [](v1::ControlMesh& mesh) { mesh.set_positions_mm(3 * 13, 40); }},
                                           BadMesh{"MESH_BAD_SHARP_FEATURE", "sharp_vertices[0]",
                                                   [](v1::ControlMesh& mesh) { mesh.add_sharp_vertices(13); }},
                                           BadMesh{"MESH_NON_MANIFOLD_VERTEX", "cell_vertices",
                                                   [](v1::ControlMesh& mesh) { add_cell_beyond(mesh, {26}); }}));

TEST(UploadMesh, NamesTheOffendingIds) {
  TestServer server;
  v1::ControlMesh mesh = make_block(2, 10);
  mesh.set_cell_kinds(3, v1::CELL_KIND_PYRAMID);
  const Failure failure = failure_of(server.upload(mesh));
  EXPECT_EQ(failure.ids, "3");
  EXPECT_THAT(failure.message, HasSubstr("pyramid"));
}

TEST(UploadMesh, TakesInvertedCellsWithAllowFoldsAndSaysSo) {
  TestServer server;
  v1::ControlMesh mesh = make_block(2, 10);
  mesh.set_positions_mm(3 * 13, 40);
  mesh.set_allow_folds(true);
  v1::UploadMeshResponse response;
  const grpc::Status status = server.upload(mesh, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_GT(response.mesh().inverted_control_cell_count(), 0u);
  EXPECT_GT(response.mesh().folding_cells(), 0u);
  EXPECT_GT(response.mesh().folds_size(), 0);
}

TEST(UploadMesh, SaysWhereCellsOverlapWithoutTouching) {
  TestServer server;
  v1::UploadMeshResponse response;
  ASSERT_TRUE(server.upload(make_two_blocks(9.9), &response).ok());
  const v1::Overlaps& overlaps = response.mesh().overlaps();
  EXPECT_GT(overlaps.limit_cells(), 1u);
  EXPECT_GT(overlaps.depth_mm(), 0.05);
  EXPECT_LT(overlaps.depth_mm(), 0.11);
  EXPECT_GT(overlaps.volume_mm3(), 0);
  EXPECT_FALSE(overlaps.more());
  ASSERT_GT(overlaps.places_size(), 0);
  for (const v1::OverlapPlace& place : overlaps.places()) {
    EXPECT_LT(place.control_cell(), 8u);
    EXPECT_GE(place.other_control_cell(), 8u);
    EXPECT_NEAR(place.position_mm().x(), 9.95, 0.2);
    EXPECT_LE(place.depth_mm(), overlaps.depth_mm());
  }
  ASSERT_TRUE(server.upload(make_two_blocks(10), &response).ok());
  EXPECT_EQ(response.mesh().overlaps().limit_cells(), 0u);
  EXPECT_EQ(response.mesh().overlaps().places_size(), 0);
}

TEST(UploadMesh, CountsCellsOfWhichItCannotBeToldWhetherTheyFold) {
  TestServer server;
  v1::ControlMesh mesh = make_block(7, 70);
  for (int i = 0; i < mesh.positions_mm_size(); i += 3) {  // As in limit_solid_test.cpp.
    if (mesh.positions_mm(i) == 40 && mesh.positions_mm(i + 2) == 30) mesh.set_positions_mm(i, 17.5);
  }
  mesh.set_allow_folds(true);
  v1::UploadMeshResponse response;
  const grpc::Status status = server.upload(mesh, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_GT(response.mesh().undecided_cells(), 0u);
  EXPECT_EQ(response.mesh().folding_cells(), 0u);
}

TEST(UploadMesh, SharesAnError) {
  TestServer server;
  v1::ControlMesh mesh = make_block(4, 10);
  mesh.set_cell_vertices(1, mesh.cell_vertices(0));
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] { EXPECT_EQ(failure_of(server.upload(mesh)).reason, "MESH_REPEATED_VERTEX"); });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(server.server().state().cache.use().meshes, 0u);
}

TEST(UploadMesh, InTinyChunksWaitsForItsTurn) {
  TestServer server;
  ServiceState& state = server.server().state();
  const std::string bytes = make_block(2, 10).SerializeAsString();
  std::promise<void> open;
  const std::shared_future<void> opened = open.get_future().share();
  for (std::size_t i = 0; i <= state.executor.threads(); ++i) {  // One more takes nothing but interactive work.
    state.executor.make_lane("others", Pieces::kInteractive).post([opened] { opened.wait(); });
  }
  std::future<grpc::Status> upload =
      std::async(std::launch::async, [&] { return server.upload(mesh_id_of(bytes), bytes.size(), bytes, nullptr, 4); });
  ASSERT_TRUE(eventually([&] { return state.uploads.used_bytes() > 0; }, 5s));
  EXPECT_FALSE(eventually([&] { return state.uploads.used_bytes() > 8 * 4; }, 500ms)) << "of " << bytes.size();
  open.set_value();
  const grpc::Status status = upload.get();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST(UploadMesh, ThatFindsNoMemoryIsToldWhenToComeAgainAsClientsOfGrpcLookForIt) {
  ServerOptions options = test_options();
  options.max_mesh_bytes = options.upload_budget_bytes = 4 << 20;
  TestServer server(options);
  MemoryBudget::Share all(server.server().state().uploads);
  ASSERT_TRUE(all.resize(options.upload_budget_bytes));
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server.stub().UploadMesh(&context, &response);
  v1::UploadMeshRequest request;
  request.mutable_start()->set_mesh_id(mesh_id_of("none"));
  request.mutable_start()->set_size_bytes(1 << 20);
  writer->Write(request);
  request.set_chunk("x");
  writer->Write(request);
  EXPECT_EQ(failure_of(writer->Finish()).reason, "SERVER_BUSY");
  EXPECT_EQ(context.GetServerTrailingMetadata().count("grpc-retry-pushback-ms"), 1u);
}

TEST(UploadMesh, FindsRoomBesideThoseOfAnotherClientWhichMayNotHaveItAll) {
  ServerOptions options = test_options();
  options.max_mesh_bytes = options.upload_budget_bytes = 4 << 20;
  TestServer server(options);
  MemoryBudget& uploads = server.server().state().uploads;
  const v1::ControlMesh mesh = make_box(2, 10);
  MemoryBudget::Share others(uploads, "somebody else"), more(uploads, "somebody else");
  ASSERT_TRUE(others.resize(3 << 20));
  EXPECT_FALSE(more.resize(1));
  EXPECT_TRUE(server.upload(mesh).ok());
  others.give_back();

  MemoryBudget::Share own(uploads, "ipv4:127.0.0.1");
  ASSERT_TRUE(own.resize(3 << 20));
  const Failure failure = failure_of(server.upload(make_box(2, 11)));
  EXPECT_EQ(failure.reason, "SERVER_BUSY");
  EXPECT_TRUE(failure.retry);
  EXPECT_NE(failure.message.find("of one client"), std::string::npos) << failure.message;
  own.give_back();
  EXPECT_TRUE(server.upload(make_box(2, 11)).ok());
}

TEST(UploadMesh, ThatFallsSilentKeepsNobodyOutAndEndsForItsPace) {
  ServerOptions options = test_options();
  options.max_mesh_bytes = options.upload_budget_bytes = 4 << 20;
  TestServer server(options);
  const std::string id = server.upload_good(make_box(2, 10));
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server.stub().UploadMesh(&context, &response);
  v1::UploadMeshRequest request;
  request.mutable_start()->set_mesh_id(mesh_id_of("none"));
  request.mutable_start()->set_size_bytes(options.max_mesh_bytes);
  ASSERT_TRUE(writer->Write(request));
  for (const std::size_t bytes : {2u << 20, (2u << 20) - 1}) {
    request.set_chunk(std::string(bytes, 'x'));
    ASSERT_TRUE(writer->Write(request));
  }
  const MemoryBudget& uploads = server.server().state().uploads;
  ASSERT_TRUE(eventually([&] { return uploads.used_bytes() == options.max_mesh_bytes - 1; }, std::chrono::seconds(5)));
  EXPECT_TRUE(server.slice(slice_request(id, 1, 0, 1)).status.ok()) << "a request found no room beside an upload";

  const auto ended = [&] {
    server.server().sweep();
    return uploads.used_bytes() == 0;
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually(ended, std::chrono::seconds(30))) << "none but the idle watch would end it, after a minute";
  EXPECT_GT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5)) << "it is given a while of 10 s";
  EXPECT_EQ(failure_of(writer->Finish()).reason, "UPLOAD_TOO_SLOW");
}

/// Options of a server whose cache has room for two meshes like make_block(2, 10), and not for a third one.
ServerOptions room_for_two_meshes() {
  TestServer probe;
  v1::UploadMeshResponse one;
  EXPECT_TRUE(probe.upload(make_block(2, 10), &one).ok());
  ServerOptions options = test_options();
  options.cache_bytes = one.mesh().memory_bytes() * 5 / 2;
  return options;
}

TEST(UploadMesh, DropsTheLeastRecentlyUsedMeshWhenTheCacheIsFull) {
  TestServer server(room_for_two_meshes());
  const std::string a = server.upload_good(make_block(2, 10));
  const std::string b = server.upload_good(make_block(2, 11));
  const std::string c = server.upload_good(make_block(2, 12));
  v1::FindMissingMeshesRequest request;
  for (const std::string& id : {a, b, c}) request.add_mesh_ids(id);
  v1::FindMissingMeshesResponse missing;
  grpc::ClientContext context;
  ASSERT_TRUE(server.stub().FindMissingMeshes(&context, request, &missing).ok());
  ASSERT_EQ(missing.missing_mesh_ids_size(), 1);
  EXPECT_EQ(missing.missing_mesh_ids(0), a);
}

TEST(UploadMesh, FindsRoomInACacheThatSilentClientsFill) {
  TestServer server(room_for_two_meshes());
  grpc::ClientContext preview_context, points_context;
  v1::PreviewRequest preview;
  preview.set_mesh_id(server.upload_good(make_block(2, 10)));
  preview.set_number(1);
  preview.set_width(8);
  preview.set_height(8);
  preview.set_encoding(v1::PREVIEW_ENCODING_RGBA);
  v1::FreePlane& plane = *preview.mutable_plane()->mutable_free();
  plane.mutable_across()->set_x(1);
  plane.mutable_up()->set_y(1);
  plane.set_across_mm_per_pixel(1);
  preview.mutable_content()->mutable_occupancy();
  const auto previews = server.stub().Preview(&preview_context);
  v1::PreviewResponse picture;
  ASSERT_TRUE(previews->Write(preview) && previews->Read(&picture));
  v1::ProbePointsRequest point;
  point.set_mesh_id(server.upload_good(make_block(2, 11)));
  const auto points = server.stub().ProbePoints(&points_context);
  v1::ProbePointsResponse answer;
  ASSERT_TRUE(points->Write(point) && points->Read(&answer));

  const Failure failure = failure_of(server.upload(make_block(2, 12)));
  EXPECT_EQ(failure.reason, "CACHE_FULL");
  EXPECT_THAT(failure.message, HasSubstr("silent"));
  EXPECT_TRUE(eventually([&] { return server.server().state().calls.open() == 2; }, std::chrono::seconds(5)));
  server.server().relieve();
  EXPECT_EQ(server.server().state().calls.open(), 2u) << "they have time";
  std::this_thread::sleep_for(kSilentWithMesh);
  EXPECT_EQ(failure_of(server.upload(make_block(2, 12))).reason, "CACHE_FULL");
  server.server().relieve();
  // The call that is ended lets go of its mesh a moment later.
  EXPECT_TRUE(eventually([&] { return server.upload(make_block(2, 12)).ok(); }, std::chrono::seconds(5)));
  preview.set_number(2);
  const bool preview_goes_on = previews->Write(preview) && previews->Read(&picture);
  const bool points_go_on = points->Write(point) && points->Read(&answer);
  EXPECT_NE(preview_goes_on, points_go_on) << "one of them is ended, and the other one's mesh needn't go, too";
  previews->WritesDone();
  points->WritesDone();
  const grpc::Status preview_status = previews->Finish();
  const grpc::Status points_status = points->Finish();
  EXPECT_EQ(failure_of(preview_goes_on ? points_status : preview_status).reason, "STREAM_IDLE");
  EXPECT_TRUE((preview_goes_on ? preview_status : points_status).ok());
}

TEST(UploadMesh, FindsRoomInACacheThatSlowClientsFillInTheEnd) {
  ServerOptions options = room_for_two_meshes();
  options.admission_wait = 500ms;
  TestServer server(options);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>>> calls;
  std::vector<v1::ProbePointsRequest> points(2);
  for (int i = 0; i < 2; ++i) {
    points[i].set_mesh_id(server.upload_good(make_block(2, 10 + i)));
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    calls.push_back(server.stub().ProbePoints(contexts.back().get()));
  }
  std::vector<std::string> ends;
  std::thread asking([&] {
    for (int asked = 0; ends.empty() && asked < 5; ++asked) {
      for (int i = 0; i < 2; ++i) {
        v1::ProbePointsResponse answer;
        if (calls[i]->Write(points[i]) && calls[i]->Read(&answer)) continue;
        ends.push_back(failure_of(calls[i]->Finish()).reason);
        calls[i] = nullptr;
        break;
      }
      std::this_thread::sleep_for(2s);  // Far less than what counts as silence.
    }
  });
  std::this_thread::sleep_for(500ms);
  const bool is_taken = eventually(
      [&] {
        server.server().relieve();
        return server.upload(make_block(2, 12)).ok();
      },
      7s);
  EXPECT_TRUE(is_taken);
  asking.join();
  EXPECT_EQ(ends, std::vector<std::string>{"STREAM_IDLE"}) << "no more than it takes";
  for (const auto& context : contexts) context->TryCancel();
  for (const auto& call : calls) {
    if (call) (void)call->Finish();
  }
}

TEST(UploadMesh, RefusesWhatTheCacheCantHold) {
  ServerOptions options = test_options();
  options.cache_bytes = 1000;
  TestServer server(options);
  const Failure failure = failure_of(server.upload(make_block(2, 10)));
  EXPECT_EQ(failure.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(failure.reason, "MESH_EXCEEDS_CACHE");
}

}  // namespace
}  // namespace ccslice::server
