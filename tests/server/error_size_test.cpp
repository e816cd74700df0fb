// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// However much a request holds that is wrong, its code and reason arrive at a client with default settings.

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "server/rpc/convert/status.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

constexpr std::size_t kMegabyte = 1'000'000;
constexpr std::size_t kMostOfARequest = 200'000;  // Of the calls that take few bytes.
constexpr int kMany = 100'000;

/// A text of so many bytes, all of them in characters of three.
std::string euros(std::size_t bytes) {
  std::string text;
  while (text.size() + 3 <= bytes) text += "\xe2\x82\xac";
  return text;
}

class ErrorSize : public ::testing::Test {
 protected:
  static void expect(const grpc::Status& status, const std::string& reason,
                     grpc::StatusCode code = grpc::StatusCode::INVALID_ARGUMENT) {
    EXPECT_EQ(status.error_code(), code) << reason << ": " << status.error_message();
    EXPECT_EQ(failure_of(status).reason, reason);
    EXPECT_EQ(failure_of(status).field.empty(), reason == "BATCH_TOO_LARGE") << reason;
    EXPECT_LT(status.error_message().size() + status.error_details().size(), kMaxStatusBytes);
  }

  grpc::Status upload(const v1::ControlMesh& mesh) { return server_.upload(mesh); }

  v1::PlanSlicesRequest plan_of(const std::string& mesh_id, const std::string& channel) {
    v1::PlanSlicesRequest request;
    part_of(*request.mutable_job()).set_mesh_id(mesh_id);
    *request.mutable_job()->mutable_grid() = slice_request(mesh_id, 1, 0, 1).job().grid();
    request.mutable_job()->add_planes()->mutable_channel()->set_name(channel);
    return request;
  }

  grpc::Status plan(const v1::PlanSlicesRequest& request) {
    grpc::ClientContext context;
    v1::PlanSlicesResponse response;
    return server_.stub().PlanSlices(&context, request, &response);
  }

  /// First message of a bidirectional call, and its end.
  template <class Request, class Stream>
  static grpc::Status converse(const Request& request, const std::unique_ptr<Stream>& stream) {
    stream->Write(request);
    stream->WritesDone();
    return stream->Finish();
  }

  static ServerOptions roomy() {
    ServerOptions options = test_options();
    options.preparation_budget_bytes = 16ull << 30;  // The meshes are refused before they take any of it.
    return options;
  }

  TestServer server_{roomy()};
};

TEST_F(ErrorSize, UnknownChannelsWithLongNames) {
  const std::string id = server_.upload_good(make_block(1, 10));
  for (const std::string& name : {std::string(kMegabyte, 'x'), std::string(kMegabyte, '\n'), euros(kMegabyte)}) {
    expect(plan(plan_of(id, name)), "CHANNEL_UNKNOWN");
    v1::SliceRangeRequest slice = slice_request(id, 1, 0, 1);
    slice.mutable_job()->mutable_planes(0)->mutable_channel()->set_name(name);
    expect(server_.slice(slice).status, "CHANNEL_UNKNOWN");
  }
}

TEST_F(ErrorSize, MeshesWithManyChannelsOfLongNames) {
  v1::ControlMesh mesh = make_plain_block(1, 10);
  for (int c = 0; c < 64; ++c) mesh.add_channel_names(std::to_string(c) + euros(250));
  for (int v = 0; v < 64 * mesh.positions_mm_size() / 3; ++v) mesh.add_channel_values(0);
  expect(plan(plan_of(server_.upload_good(mesh), euros(kMegabyte))), "CHANNEL_UNKNOWN");
  mesh.set_channel_names(63, mesh.channel_names(0));
  expect(upload(mesh), "MESH_BAD_CHANNEL");
  mesh.set_channel_names(63, euros(kMegabyte));
  expect(upload(mesh), "MESH_BAD_CHANNEL");
}

TEST_F(ErrorSize, MeshesWithManyBadIds) {
  v1::ControlMesh cells = make_plain_block(1, 10);
  cells.clear_cell_kinds();
  cells.clear_cell_vertices();
  for (int c = 0; c < kMany; ++c) {
    cells.add_cell_kinds(v1::CELL_KIND_TET);
    for (int i = 0; i < 4; ++i) cells.add_cell_vertices(4'000'000'000);
  }
  expect(upload(cells), "MESH_INDEX_OUT_OF_RANGE");
  for (auto& vertex : *cells.mutable_cell_vertices()) vertex = 1;
  expect(upload(cells), "MESH_REPEATED_VERTEX");
  for (auto& kind : *cells.mutable_cell_kinds()) kind = 77;
  expect(upload(cells), "MESH_UNKNOWN_CELL_KIND");

  v1::ControlMesh vertices = make_plain_block(1, 10);
  for (int i = 0; i < 3 * kMany; ++i) vertices.add_positions_mm(1);
  expect(upload(vertices), "MESH_ISOLATED_VERTEX");
  for (double& coordinate : *vertices.mutable_positions_mm()) coordinate = std::numeric_limits<double>::quiet_NaN();
  expect(upload(vertices), "MESH_NON_FINITE");
  EXPECT_EQ(failure_of(upload(vertices)).ids, "0,1,2,3,4,5,6,7");

  v1::ControlMesh sharp = make_plain_block(1, 10);
  for (int i = 0; i < kMany; ++i) sharp.add_sharp_vertices(4'000'000'000);
  expect(upload(sharp), "MESH_INDEX_OUT_OF_RANGE");
}

TEST_F(ErrorSize, LongMeshIds) {
  const std::string id(kMostOfARequest, 'x');
  expect(server_.slice(slice_request(id, 1, 0, 1)).status, "MESH_ID_INVALID");
  expect(plan(plan_of(id, "x")), "MESH_ID_INVALID");
  expect(server_.upload(id, 1, "x"), "MESH_ID_INVALID");
  grpc::ClientContext probing, evaluating, getting, asking, deleting;
  v1::ProbePointsRequest probe;
  probe.set_mesh_id(id);
  expect(converse(probe, server_.stub().ProbePoints(&probing)), "MESH_ID_INVALID");
  v1::EvaluatePointsRequest evaluate;
  evaluate.set_mesh_id(id);
  expect(converse(evaluate, server_.stub().EvaluatePoints(&evaluating)), "MESH_ID_INVALID");
  v1::GetMeshRequest get;
  get.set_mesh_id(id);
  v1::GetMeshResponse got;
  expect(server_.stub().GetMesh(&getting, get, &got), "MESH_ID_INVALID");
  v1::GetPreparationRequest ask;
  ask.set_mesh_id(id);
  v1::GetPreparationResponse told;
  expect(server_.stub().GetPreparation(&asking, ask, &told), "MESH_ID_INVALID");
  v1::DeleteMeshRequest remove;
  remove.set_mesh_id(id);
  v1::DeleteMeshResponse removed;
  expect(server_.stub().DeleteMesh(&deleting, remove, &removed), "MESH_ID_INVALID");
}

TEST_F(ErrorSize, ManyIdsAndLongTokens) {
  grpc::ClientContext finding, listing;
  v1::FindMissingMeshesRequest find;
  for (int i = 0; i < kMany; ++i) find.add_mesh_ids("x");
  v1::FindMissingMeshesResponse found;
  expect(server_.stub().FindMissingMeshes(&finding, find, &found), "BATCH_TOO_LARGE");
  v1::ListMeshesRequest list;
  list.set_page_token(euros(kMostOfARequest));
  v1::ListMeshesResponse listed;
  expect(server_.stub().ListMeshes(&listing, list, &listed), "PAGE_INVALID");
}

TEST_F(ErrorSize, ManyPointsAndCells) {
  const std::string id = server_.upload_good(make_block(1, 10));
  grpc::ClientContext probing, evaluating;
  v1::ProbePointsRequest probe;
  probe.set_mesh_id(id);
  for (int i = 0; i < 3 * kMany; ++i) probe.add_points_mm(std::numeric_limits<double>::quiet_NaN());
  expect(converse(probe, server_.stub().ProbePoints(&probing)), "BATCH_TOO_LARGE");
  v1::EvaluatePointsRequest evaluate;
  evaluate.set_mesh_id(id);
  for (int i = 0; i < kMany; ++i) evaluate.add_limit_cells(4'000'000'000);
  for (int i = 0; i < 3 * kMany; ++i) evaluate.add_uvw(7);
  expect(converse(evaluate, server_.stub().EvaluatePoints(&evaluating)), "BATCH_TOO_LARGE");
}

TEST_F(ErrorSize, LargeUnknownFields) {
  v1::PlanSlicesRequest request = plan_of(server_.upload_good(make_block(1, 10)), "x");
  v1::PlanSlicesRequest::GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(24, euros(kMegabyte));
  expect(plan(request), "REQUEST_UNKNOWN_FIELD");
}

/// What a status takes in the trailers at most.
std::size_t trailer_bytes(const grpc::Status& status) {
  return 3 * status.error_message().size() + 4 * status.error_details().size() / 3;
}

TEST(StatusSize, IsBoundedWhateverAnErrorHolds) {
  for (const std::string& text : {std::string(kMegabyte, 'x'), std::string(kMegabyte, '%'), euros(kMegabyte)}) {
    const grpc::Status core =
        to_status(Error(ErrorCode::kMeshNonFinite, text, text, std::vector<std::int64_t>(kMany, 1ll << 62)));
    EXPECT_EQ(failure_of(core).reason, "MESH_NON_FINITE");
    EXPECT_LE(trailer_bytes(core), kMaxStatusBytes + 2 * core.error_message().size());
    for (const ServiceErrorCode code : kServiceErrorCodes) {
      const grpc::Status service = to_status(ServiceError(code, text, text, text));
      EXPECT_EQ(failure_of(service).reason, reason(code));
      EXPECT_LE(trailer_bytes(service), kMaxStatusBytes + 2 * service.error_message().size());
    }
  }
}

TEST(StatusSize, KeepsWhatClientsActOnBeforeTheRest) {
  const Failure missing =
      failure_of(to_status(ServiceError(ServiceErrorCode::kMeshMissing, euros(kMegabyte), "mesh_id", "sha256:1")));
  EXPECT_EQ(missing.missing, "sha256:1");
  EXPECT_TRUE(failure_of(to_status(ServiceError(ServiceErrorCode::kCacheFull, euros(kMegabyte), euros(999)))).retry);
}

}  // namespace
}  // namespace ccslice::server
