// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Servers that share a store.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/service/redis_process.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

ServerOptions options_of(const std::string& store) {
  ServerOptions options = test_options();
  options.mesh_store.place = parse_mesh_store(store);
  options.mesh_store.folder_bytes = 1 << 30;
  return options;
}

bool is_missing(TestServer& server, const std::string& id) {
  grpc::ClientContext context;
  v1::FindMissingMeshesRequest request;
  request.add_mesh_ids(id);
  v1::FindMissingMeshesResponse response;
  EXPECT_TRUE(server.stub().FindMissingMeshes(&context, request, &response).ok());
  return response.missing_mesh_ids_size() == 1;
}

grpc::Status remove(TestServer& server, const std::string& id, v1::DeleteMeshResponse& response) {
  grpc::ClientContext context;
  v1::DeleteMeshRequest request;
  request.set_mesh_id(id);
  return server.stub().DeleteMesh(&context, request, &response);
}

std::string id_of(const v1::ControlMesh& mesh) { return mesh_id_of(mesh.SerializeAsString()); }

v1::ProbePointsRequest probe_request(const std::string& mesh_id) {
  v1::ProbePointsRequest request;
  request.set_mesh_id(mesh_id);
  for (int i = 0; i < 3; ++i) request.add_points_mm(5);
  return request;
}

v1::PreviewRequest preview_request(const std::string& mesh_id) {
  v1::PreviewRequest request;
  request.set_mesh_id(mesh_id);
  request.set_number(1);
  request.set_width(16);
  request.set_height(16);
  request.mutable_content()->mutable_occupancy();
  v1::FreePlane& plane = *request.mutable_plane()->mutable_free();
  plane.mutable_middle_mm()->set_z(5);
  plane.mutable_across()->set_x(1);
  plane.mutable_up()->set_y(1);
  plane.set_across_mm_per_pixel(1);
  plane.set_up_mm_per_pixel(1);
  return request;
}

class MeshStoreRpcs : public ::testing::Test {
 protected:
  std::string store() const { return "dir:" + folder_.string(); }
  fs::path path_of(const std::string& id) const { return folder_ / id.substr(7, 2) / id.substr(9, 2) / id.substr(7); }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  const v1::ControlMesh mesh_ = make_block(2, 10);
  const std::string id_ = id_of(mesh_);
};

TEST_F(MeshStoreRpcs, AnyServerServesAnyMesh) {
  TestServer first(options_of(store()));
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(first.upload(mesh_, &uploaded).ok());
  EXPECT_TRUE(uploaded.stored());
  const Sliced direct = first.slice(slice_request(id_, 1, 0, 3));
  ASSERT_TRUE(direct.status.ok());
  first.stop();

  TestServer second(options_of(store()));
  EXPECT_FALSE(is_missing(second, id_));
  const Sliced sliced = second.slice(slice_request(id_, 1, 0, 3));
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.layer_bytes, direct.layer_bytes);
  v1::UploadMeshResponse again;
  ASSERT_TRUE(second.upload(mesh_, &again).ok());
  EXPECT_TRUE(again.already_cached());
  EXPECT_TRUE(again.stored());
}

TEST_F(MeshStoreRpcs, EveryCallReadsThrough) {
  {
    TestServer first(options_of(store()));
    first.upload_good(mesh_);
  }
  {
    TestServer server(options_of(store()));
    grpc::ClientContext context;
    v1::GetMeshRequest request;
    request.set_mesh_id(id_);
    v1::GetMeshResponse response;
    ASSERT_TRUE(server.stub().GetMesh(&context, request, &response).ok());
    EXPECT_EQ(response.mesh().mesh_id(), id_);
  }
  {
    TestServer server(options_of(store()));
    grpc::ClientContext context;
    v1::PlanSlicesRequest request;
    part_of(*request.mutable_job()).set_mesh_id(id_);
    request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(1);
    request.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(1);
    request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(1);
    v1::PlanSlicesResponse response;
    EXPECT_TRUE(server.stub().PlanSlices(&context, request, &response).ok());
  }
  {
    TestServer server(options_of(store()));
    grpc::ClientContext context;
    const auto stream = server.stub().ProbePoints(&context);
    const v1::ProbePointsRequest request = probe_request(id_);
    v1::ProbePointsResponse response;
    ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
    EXPECT_EQ(response.locations(0), v1::POINT_LOCATION_INSIDE);
    ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }
  {
    TestServer server(options_of(store()));
    grpc::ClientContext context;
    v1::TessellateBoundaryRequest request;
    request.set_mesh_id(id_);
    v1::TessellateBoundaryResponse response;
    const auto stream = server.stub().TessellateBoundary(&context, request);
    while (stream->Read(&response)) {
    }
    EXPECT_TRUE(stream->Finish().ok());
  }
  {
    TestServer server(options_of(store()));
    grpc::ClientContext context;
    const auto stream = server.stub().Preview(&context);
    v1::PreviewResponse response;
    stream->Write(preview_request(id_));
    stream->WritesDone();
    while (stream->Read(&response)) {
    }
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.stage(), v1::PREVIEW_STAGE_FULL);
  }
}

TEST_F(MeshStoreRpcs, ManyCallsPrepareOnce) {
  {
    TestServer first(options_of(store()));
    first.upload_good(mesh_);
  }
  TestServer server(options_of(store()));
  std::vector<std::thread> callers;
  std::atomic<int> good{0};
  for (int i = 0; i < 8; ++i) {
    callers.emplace_back([&] { good += server.slice(slice_request(id_, 1, 0, 1)).status.ok() ? 1 : 0; });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(good, 8);
  EXPECT_EQ(server.server().state().cache.use().meshes, 1u);
}

/// A server with one place and a mesh that it has to prepare, which begins when the worker is free.
class MeshThatComesLate : public MeshStoreRpcs {
 protected:
  void start() {
    TestServer(options_of(store())).upload_good(mesh_);
    server_ = std::make_unique<TestServer>(one_place());
    other_id_ = server_->upload_good(make_box(1, 10));
    state().executor.make_lane("somebody else", Pieces::kBatch).post([opened = opened_] { opened.wait(); });
  }
  ~MeshThatComesLate() override { open(); }
  ServerOptions one_place() const {
    ServerOptions options = options_of(store());
    options.threads = 1;
    options.max_concurrent_calls = 1;
    return options;
  }
  ServiceState& state() { return server_->server().state(); }
  void open() {
    if (!std::exchange(is_open_, true)) open_.set_value();
  }
  /// Whether so many calls wait for the mesh, and without a place.
  bool is_awaited(std::size_t calls) {
    return eventually(
        [this, calls] {
          return state().cache.preparation(id_) && state().calls.open() == calls && state().admission.running() == 0;
        },
        5s);
  }
  grpc::Status plan(grpc::ClientContext& context) {
    v1::PlanSlicesRequest request;
    part_of(*request.mutable_job()).set_mesh_id(id_);
    *request.mutable_job()->mutable_grid() = slice_request(id_, 1, 0, 1).job().grid();
    v1::PlanSlicesResponse response;
    return server_->stub().PlanSlices(&context, request, &response);
  }
  grpc::Status get(grpc::ClientContext& context) {
    v1::GetMeshRequest request;
    request.set_mesh_id(id_);
    v1::GetMeshResponse response;
    return server_->stub().GetMesh(&context, request, &response);
  }
  grpc::Status slice(grpc::ClientContext& context) {
    const auto reader = server_->stub().SliceRange(&context, slice_request(id_, 1, 0, 10));
    v1::SliceRangeResponse message;
    while (reader->Read(&message)) {
    }
    return reader->Finish();
  }
  /// Of a call that is sent one message and answers with one: by `method` of the stub.
  template <class Request, class Response, class Method>
  grpc::Status ask(grpc::ClientContext& context, const Request& request, Method method) {
    const auto stream = (server_->stub().*method)(&context);
    stream->Write(request);
    stream->WritesDone();
    Response response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  }
  grpc::Status probe(grpc::ClientContext& context) {
    return ask<v1::ProbePointsRequest, v1::ProbePointsResponse>(context, probe_request(id_),
                                                                &v1::SlicerService::Stub::ProbePoints);
  }
  grpc::Status preview(grpc::ClientContext& context) {
    return ask<v1::PreviewRequest, v1::PreviewResponse>(context, preview_request(id_),
                                                        &v1::SlicerService::Stub::Preview);
  }
  using Calling = grpc::Status (MeshThatComesLate::*)(grpc::ClientContext&);
  /// All that have a place and give it up while their mesh comes.
  static constexpr std::array<Calling, 4> kCallings = {&MeshThatComesLate::slice, &MeshThatComesLate::plan,
                                                       &MeshThatComesLate::probe, &MeshThatComesLate::preview};

  static constexpr Calling kWithoutPlace = &MeshThatComesLate::get;

  /// Has a call wait for its place again, since another one has it when the mesh comes.
  void call_beside_another(Calling calling, grpc::ClientContext& context, grpc::Status& status,
                           const std::function<void()>& end) {
    std::thread calls([&] { status = (this->*calling)(context); });
    EXPECT_TRUE(is_awaited(1));
    state().admission.request(place_, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
    open();
    EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
    end();
    calls.join();
    EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
  }

  std::promise<void> open_;
  const std::shared_future<void> opened_ = open_.get_future().share();
  bool is_open_ = false;
  std::unique_ptr<TestServer> server_;
  std::string other_id_;
  Admission::Place place_{(start(), state().admission)};
};

TEST_F(MeshThatComesLate, LeavesItsPlaceToOthers) {
  std::atomic<std::size_t> good = 0;
  std::vector<std::thread> callers;
  for (const Calling calling : kCallings) {
    callers.emplace_back([&, calling] {
      grpc::ClientContext context;
      good += (this->*calling)(context).ok() ? 1 : 0;
    });
  }
  EXPECT_TRUE(is_awaited(kCallings.size()));
  EXPECT_TRUE(server_->slice(slice_request(other_id_, 1, 0, 10)).status.ok());
  open();
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(good, kCallings.size());
}

TEST_F(MeshThatComesLate, IsNotWaitedForByWhoIsStopped) {
  std::vector<Calling> callings(kCallings.begin(), kCallings.end());
  callings.push_back(kWithoutPlace);
  std::vector<grpc::ClientContext> contexts(callings.size());
  std::vector<std::thread> callers;
  for (std::size_t i = 0; i < callings.size(); ++i) {
    callers.emplace_back(
        [&, i] { EXPECT_EQ((this->*callings[i])(contexts[i]).error_code(), grpc::StatusCode::CANCELLED) << i; });
  }
  EXPECT_TRUE(is_awaited(callings.size()));
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (std::thread& caller : callers) caller.join();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0; }, 5s));
}

TEST_F(MeshThatComesLate, IsNotWaitedForBeyondAShutdown) {
  grpc::Status status;
  std::thread gets([&] {
    grpc::ClientContext context;
    status = get(context);
  });
  EXPECT_TRUE(is_awaited(1));
  state().calls.cut_off_all();
  gets.join();
  EXPECT_EQ(failure_of(status).reason, "SERVER_SHUTTING_DOWN");
}

class CallWhoseMeshComesLate : public MeshThatComesLate, public ::testing::WithParamInterface<std::size_t> {
 protected:
  Calling calling() const { return kCallings[GetParam()]; }
};
INSTANTIATE_TEST_SUITE_P(Of, CallWhoseMeshComesLate, ::testing::Range<std::size_t>(0, 4));

TEST_P(CallWhoseMeshComesLate, WaitsForAPlaceAgain) {
  grpc::ClientContext context;
  grpc::Status status;
  call_beside_another(calling(), context, status, [this] { state().admission.give_back(place_); });
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_P(CallWhoseMeshComesLate, IsCancelledWhileItWaitsAgain) {
  grpc::ClientContext context;
  grpc::Status status;
  call_beside_another(calling(), context, status, [&context] { context.TryCancel(); });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(MeshStoreRpcs, DamagedFilesAreMissesAndTheNextUploadRepairs) {
  {
    TestServer first(options_of(store()));
    first.upload_good(mesh_);
  }
  const auto size = fs::file_size(path_of(id_));
  for (const bool cut : {true, false}) {
    if (cut) {
      fs::resize_file(path_of(id_), size / 2);
    } else {
      std::fstream file(path_of(id_), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(size / 2));
      file.put('\x7f');
    }
    TestServer server(options_of(store()));
    EXPECT_EQ(server.slice_failure(slice_request(id_, 1, 0, 1)).reason, "MESH_MISSING");
    EXPECT_TRUE(is_missing(server, id_));
    EXPECT_EQ(server.server().state().store->count(StoreOperation::kRead, StoreOutcome::kDamaged), 1u);
    v1::UploadMeshResponse uploaded;
    ASSERT_TRUE(server.upload(mesh_, &uploaded).ok());
    EXPECT_TRUE(uploaded.stored());
    EXPECT_EQ(fs::file_size(path_of(id_)), size);
  }
  TestServer server(options_of(store()));
  EXPECT_TRUE(server.slice(slice_request(id_, 1, 0, 1)).status.ok());
}

TEST_F(MeshStoreRpcs, AnUploadBringsBackWhatTheStoreLost) {
  TestServer server(options_of(store()));
  server.upload_good(mesh_);
  fs::remove(path_of(id_));
  v1::UploadMeshResponse again;
  ASSERT_TRUE(server.upload(mesh_, &again).ok());
  EXPECT_TRUE(again.already_cached());
  EXPECT_TRUE(again.stored());
  EXPECT_TRUE(fs::exists(path_of(id_)));
}

TEST_F(MeshStoreRpcs, InvalidMeshesAreNotKept) {
  TestServer server(options_of(store()));
  EXPECT_FALSE(server.upload(v1::ControlMesh()).ok());
  v1::ControlMesh broken = mesh_;
  broken.mutable_positions_mm()->RemoveLast();
  EXPECT_FALSE(server.upload(broken).ok());
  EXPECT_FALSE(fs::exists(path_of(id_of(broken))));
}

TEST_F(MeshStoreRpcs, DeletingDropsBoth) {
  TestServer first(options_of(store())), second(options_of(store()));
  first.upload_good(mesh_);
  v1::DeleteMeshResponse response;
  ASSERT_TRUE(remove(second, id_, response).ok());
  EXPECT_TRUE(response.deleted());
  EXPECT_FALSE(fs::exists(path_of(id_)));
  EXPECT_EQ(second.slice_failure(slice_request(id_, 1, 0, 1)).reason, "MESH_MISSING");
  ASSERT_TRUE(remove(second, id_, response).ok());
  EXPECT_FALSE(response.deleted());
}

TEST_F(MeshStoreRpcs, WarmsUpBeforeItServes) {
  {
    TestServer first(options_of(store()));
    first.upload_good(mesh_);
    first.upload_good(make_block(1, 3));
  }
  ServerOptions options = options_of(store());
  options.warm_meshes = 5;
  TestServer server(options);
  EXPECT_EQ(server.server().state().cache.use().meshes, 2u);
}

TEST_F(MeshStoreRpcs, StopsWarmingUpWhenItIsToStop) {
  {
    TestServer server(options_of(store()));
    for (const int size : {10, 20}) server.upload_good(make_box(20, size));
  }
  ServerOptions options = options_of(store());
  options.warm_meshes = 2;
  EXPECT_EQ(Server(options, [] { return true; }).state().cache.use().meshes, 0u);
  int looks = 0;
  EXPECT_LE(Server(options, [&looks] { return ++looks > 1; }).state().cache.use().meshes, 1u);
}

TEST_F(MeshStoreRpcs, AWrongFolderIsToldAtTheStart) {
  std::ofstream(folder_ / "file") << "x";
  EXPECT_THROW(TestServer(options_of(store() + "/file")), std::runtime_error);
}

TEST_F(MeshStoreRpcs, ARedisThatIsDownIsAMissExceptForDeletions) {
  RedisProcess redis;
  const std::string place = "redis://127.0.0.1:" + std::to_string(redis.port());
  TestServer first(options_of(place)), second(options_of(place));
  v1::UploadMeshResponse uploaded;
  ASSERT_TRUE(first.upload(mesh_, &uploaded).ok());
  EXPECT_TRUE(uploaded.stored());
  EXPECT_TRUE(second.slice(slice_request(id_, 1, 0, 1)).status.ok());
  redis.kill();
  EXPECT_TRUE(second.slice(slice_request(id_, 1, 0, 1)).status.ok());  // Cached.
  const v1::ControlMesh other = make_block(1, 3);
  EXPECT_EQ(second.slice_failure(slice_request(id_of(other), 1, 0, 1)).reason, "MESH_MISSING");
  ASSERT_TRUE(second.upload(other, &uploaded).ok());
  EXPECT_FALSE(uploaded.stored());
  v1::DeleteMeshResponse response;
  const Failure failure = failure_of(remove(second, id_, response));
  EXPECT_EQ(failure.reason, "STORE_UNAVAILABLE") << failure.message;
  EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(failure.retry);
}

TEST_F(MeshStoreRpcs, ARedisThatHangsHoldsNobodyUp) {
  RedisProcess redis;
  TestServer server(options_of("redis://127.0.0.1:" + std::to_string(redis.port())));
  server.upload_good(mesh_);
  redis.stop_answering();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(server.slice_failure(slice_request(mesh_id_of("other"), 1, 0, 1)).reason, "MESH_MISSING");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 4s);
  EXPECT_TRUE(server.slice(slice_request(id_, 1, 0, 1)).status.ok());
  redis.answer_again();
}

}  // namespace
}  // namespace ccslice::server
