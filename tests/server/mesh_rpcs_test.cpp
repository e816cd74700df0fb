// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <future>
#include <thread>

#include "server/service/base/limits.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

class MeshRpcs : public ::testing::Test {
 protected:
  grpc::Status get(const std::string& id, v1::GetMeshResponse& response) {
    grpc::ClientContext context;
    v1::GetMeshRequest request;
    request.set_mesh_id(id);
    return server_.stub().GetMesh(&context, request, &response);
  }
  grpc::Status remove(const std::string& id, v1::DeleteMeshResponse& response) {
    grpc::ClientContext context;
    v1::DeleteMeshRequest request;
    request.set_mesh_id(id);
    return server_.stub().DeleteMesh(&context, request, &response);
  }
  grpc::Status list(std::uint32_t page_size, const std::string& token, v1::ListMeshesResponse& response) {
    grpc::ClientContext context;
    v1::ListMeshesRequest request;
    request.set_page_size(page_size);
    request.set_page_token(token);
    return server_.stub().ListMeshes(&context, request, &response);
  }

  TestServer server_;
  const std::string missing_ = mesh_id_of("missing");
};

TEST_F(MeshRpcs, ServerInfoTellsTheLimits) {
  grpc::ClientContext context;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(server_.stub().GetServerInfo(&context, {}, &info).ok());
  EXPECT_FALSE(info.engine_version().empty());
  EXPECT_FALSE(info.server_version().empty());
  EXPECT_EQ(info.threads(), 2u);
  EXPECT_EQ(info.max_points_per_message(), kMaxPointsPerMessage);
  EXPECT_EQ(info.slice_limits().max_planes(), 64u);
  EXPECT_GT(info.mesh_limits().max_cells(), 0u);
  EXPECT_EQ(info.sample_types_size(), 6);
  EXPECT_GE(info.encodings_size(), 2);
  EXPECT_EQ(info.cache_capacity_bytes(), test_options().cache_bytes);
}

TEST_F(MeshRpcs, GetAnswersWhatTheUploadAnswered) {
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(server_.upload(make_block(2, 10), &uploaded).ok());
  v1::GetMeshResponse response;
  ASSERT_TRUE(get(uploaded.mesh().mesh_id(), response).ok());
  response.mutable_mesh()->mutable_last_use_time()->CopyFrom(uploaded.mesh().last_use_time());
  EXPECT_EQ(response.mesh().SerializeAsString(), uploaded.mesh().SerializeAsString());
}

TEST_F(MeshRpcs, SummariesTellHowFarTheLimitIsFromTheControlMesh) {
  v1::UploadMeshResponse sharp, smooth;
  ASSERT_TRUE(server_.upload(make_box(2, 10), &sharp).ok());
  EXPECT_NEAR(sharp.mesh().deviation().control_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(sharp.mesh().deviation().limit_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(sharp.mesh().deviation().farthest_distance_mm(), 0, 1e-12);
  ASSERT_TRUE(server_.upload(make_block(2, 10), &smooth).ok());
  const v1::LimitDeviation& deviation = smooth.mesh().deviation();
  EXPECT_NEAR(deviation.control_volume_mm3(), 1000, 1e-9);
  EXPECT_LT(deviation.limit_volume_mm3(), 950);
  EXPECT_NEAR(deviation.farthest_distance_mm(), 5 * std::sqrt(3) / 4, 1e-9);
  EXPECT_EQ(deviation.control_box().max_mm().z(), 10);
}

TEST_F(MeshRpcs, GetOfAMissingMeshSaysWhichOneToUpload) {
  v1::GetMeshResponse response;
  const Failure failure = failure_of(get(missing_, response));
  EXPECT_EQ(failure.code, grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(failure.reason, "MESH_MISSING");
  EXPECT_EQ(failure.missing, missing_);
}

TEST_F(MeshRpcs, RefuseWhatIsNoId) {
  v1::GetMeshResponse got;
  EXPECT_EQ(failure_of(get("x", got)).reason, "MESH_ID_INVALID");
  v1::DeleteMeshResponse deleted;
  EXPECT_EQ(failure_of(remove("", deleted)).reason, "MESH_ID_INVALID");
}

TEST_F(MeshRpcs, DeleteIsIdempotent) {
  const std::string id = server_.upload_good(make_block(1, 10));
  v1::DeleteMeshResponse response;
  ASSERT_TRUE(remove(id, response).ok());
  EXPECT_TRUE(response.deleted());
  ASSERT_TRUE(remove(id, response).ok());
  EXPECT_FALSE(response.deleted());
  v1::GetMeshResponse got;
  EXPECT_EQ(failure_of(get(id, got)).reason, "MESH_MISSING");
}

TEST_F(MeshRpcs, FindMissingNamesTheMissingOnesInOrder) {
  const std::string id = server_.upload_good(make_block(1, 10));
  const std::string other = mesh_id_of("other");
  grpc::ClientContext context;
  v1::FindMissingMeshesRequest request;
  for (const std::string& one : {other, id, missing_}) request.add_mesh_ids(one);
  v1::FindMissingMeshesResponse response;
  ASSERT_TRUE(server_.stub().FindMissingMeshes(&context, request, &response).ok());
  ASSERT_EQ(response.missing_mesh_ids_size(), 2);
  EXPECT_EQ(response.missing_mesh_ids(0), other);
  EXPECT_EQ(response.missing_mesh_ids(1), missing_);
}

TEST_F(MeshRpcs, FindMissingRefusesTooManyAndWrongIds) {
  v1::FindMissingMeshesRequest request;
  for (std::uint32_t i = 0; i <= kMaxIdsPerMessage; ++i) request.add_mesh_ids(missing_);
  v1::FindMissingMeshesResponse response;
  grpc::ClientContext first;
  EXPECT_EQ(failure_of(server_.stub().FindMissingMeshes(&first, request, &response)).reason, "BATCH_TOO_LARGE");
  request.clear_mesh_ids();
  request.add_mesh_ids(missing_);
  request.add_mesh_ids("nonsense");
  grpc::ClientContext second;
  const Failure failure = failure_of(server_.stub().FindMissingMeshes(&second, request, &response));
  EXPECT_EQ(failure.reason, "MESH_ID_INVALID");
  EXPECT_EQ(failure.field, "mesh_ids[1]");
}

class Preparations : public MeshRpcs {
 protected:
  v1::GetPreparationResponse ask(TestServer& server, const std::string& id) {
    grpc::ClientContext context;
    v1::GetPreparationRequest request;
    request.set_mesh_id(id);
    v1::GetPreparationResponse response;
    const grpc::Status status = server.stub().GetPreparation(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
};

TEST_F(Preparations, AreUnknownWhereNobodyPreparesAndDoneWhereTheMeshIsHeld) {
  EXPECT_EQ(ask(server_, missing_).phase(), v1::PREPARATION_PHASE_UNSPECIFIED);
  const std::string id = server_.upload_good(make_block(1, 10));
  const std::uint64_t hits = server_.server().state().cache.use().hits;
  EXPECT_EQ(ask(server_, id).phase(), v1::PREPARATION_PHASE_PREPARED);
  EXPECT_EQ(ask(server_, id).total_cells(), 0u);
  EXPECT_EQ(server_.server().state().cache.use().hits, hits) << "who asks uses nothing";
}

TEST_F(Preparations, AreCountedAsCallsWhoseTimesTellNothing) {
  const Metrics& metrics = server_.server().state().metrics;
  ask(server_, missing_);
  EXPECT_EQ(metrics.calls.counts().at({"GetPreparation", "OK"}), 1u);
  EXPECT_EQ(metrics.seconds_in_all.counts().all, 0u);
  v1::GetMeshResponse response;
  EXPECT_FALSE(get(missing_, response).ok());
  EXPECT_EQ(metrics.seconds_in_all.counts().all, 1u);
}

TEST_F(Preparations, TellPhaseAndCells) {
  constexpr std::array kSteps = {std::pair(PreparationStep::kReading, v1::PREPARATION_PHASE_READING),
                                 std::pair(PreparationStep::kChecking, v1::PREPARATION_PHASE_CHECKING),
                                 std::pair(PreparationStep::kRefining, v1::PREPARATION_PHASE_REFINING),
                                 std::pair(PreparationStep::kBuilding, v1::PREPARATION_PHASE_BUILDING),
                                 std::pair(PreparationStep::kMeasuring, v1::PREPARATION_PHASE_MEASURING),
                                 std::pair(PreparationStep::kBounding, v1::PREPARATION_PHASE_BOUNDING),
                                 std::pair(PreparationStep::kFolding, v1::PREPARATION_PHASE_SEARCHING_FOLDS),
                                 std::pair(PreparationStep::kFinishing, v1::PREPARATION_PHASE_FINISHING)};
  std::promise<void> ended;
  const auto prepare = [&](const CancellationToken&, PreparationProgress& progress) -> PreparedMesh {
    for (const auto& [step, phase] : kSteps) {
      progress.begin(step, 8);
      progress.add(5);
      const v1::GetPreparationResponse response = ask(server_, missing_);
      EXPECT_EQ(response.phase(), phase);
      EXPECT_EQ(response.done_cells(), 5u);
      EXPECT_EQ(response.total_cells(), 8u);
    }
    throw Error(ErrorCode::kMeshEmpty, "no cells");
  };
  server_.server().state().cache.get_or_prepare(missing_, prepare,
                                                [&](const MeshCache::Outcome&) { ended.set_value(); });
  ended.get_future().wait();
  EXPECT_EQ(ask(server_, missing_).phase(), v1::PREPARATION_PHASE_UNSPECIFIED) << "it failed";
}

TEST_F(Preparations, AreToldWhileTheirUploadHoldsTheOnlyPlace) {
  ServerOptions options = test_options();
  options.max_concurrent_calls = 1;
  options.max_waiting_calls = 0;
  TestServer server(options);
  const v1::ControlMesh mesh = make_block(24, 10);
  const std::string id = mesh_id_of(mesh.SerializeAsString());
  std::atomic<bool> answered = false;
  std::thread uploader([&] {
    EXPECT_TRUE(server.upload(mesh).ok());
    answered = true;
  });
  v1::GetPreparationResponse last;
  int under_way = 0;
  while (!answered) {
    const v1::GetPreparationResponse now = ask(server, id);
    EXPECT_GE(now.phase(), last.phase());
    if (now.phase() == last.phase()) {
      EXPECT_GE(now.done_cells(), last.done_cells());
    }
    EXPECT_LE(now.done_cells(), now.total_cells());
    under_way += now.total_cells() > 0;
    last = now;
  }
  uploader.join();
  EXPECT_GT(under_way, 0);
  EXPECT_EQ(ask(server, id).phase(), v1::PREPARATION_PHASE_PREPARED);
}

TEST_F(Preparations, RefuseWhatIsNoId) {
  for (const std::string bad : {"", "nonsense", "sha256:12"}) {
    grpc::ClientContext context;
    v1::GetPreparationRequest request;
    request.set_mesh_id(bad);
    v1::GetPreparationResponse response;
    const Failure failure = failure_of(server_.stub().GetPreparation(&context, request, &response));
    EXPECT_EQ(failure.reason, "MESH_ID_INVALID");
    EXPECT_EQ(failure.field, "mesh_id");
  }
}

TEST_F(MeshRpcs, ListComesInPages) {
  for (int i = 0; i < 5; ++i) server_.upload_good(make_block(1, 10 + i));
  std::vector<std::string> ids;
  std::string token;
  do {
    v1::ListMeshesResponse response;
    ASSERT_TRUE(list(2, token, response).ok());
    for (const v1::MeshSummary& mesh : response.meshes()) ids.push_back(mesh.mesh_id());
    token = response.next_page_token();
  } while (!token.empty());
  EXPECT_EQ(ids.size(), 5u);
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
}

TEST_F(MeshRpcs, ListRefusesForeignTokensAndAbsurdPages) {
  v1::ListMeshesResponse response;
  EXPECT_EQ(failure_of(list(0, "token", response)).field, "page_token");
  EXPECT_EQ(failure_of(list(1001, "", response)).field, "page_size");
}

TEST(MeshExpiry, DropsMeshesThatNobodyUses) {
  ServerOptions options = test_options();
  options.mesh_time_to_live = std::chrono::milliseconds(50);
  TestServer server(options);
  v1::UploadMeshResponse response;
  ASSERT_TRUE(server.upload(make_block(1, 10), &response).ok());
  EXPECT_TRUE(response.mesh().has_expire_time());
  std::this_thread::sleep_for(std::chrono::milliseconds(80));
  server.server().sweep();
  EXPECT_EQ(server.server().state().cache.use().used_bytes, 0u);
}

}  // namespace
}  // namespace ccslice::server
