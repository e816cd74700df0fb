// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls beyond those that run: they wait, in every RPC that computes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

ServerOptions one_place(std::chrono::milliseconds wait) {
  ServerOptions options = test_options();
  options.max_concurrent_calls = 1;
  options.max_waiting_calls = 2;
  options.admission_wait = wait;
  return options;
}

/// A server whose only place is taken until it is given back.
class WaitingCalls : public ::testing::Test {
 protected:
  explicit WaitingCalls(std::chrono::milliseconds wait = 1h) : server_(one_place(wait)) {
    mesh_id_ = server_.upload_good(make_block(1, 10));
    EXPECT_TRUE(eventually([this] { return admission().running() == 0; }, 1s));
    take_place();
  }

  Admission& admission() { return server_.server().state().admission; }
  void take_place() {
    place_ = std::make_unique<Admission::Place>(admission());
    admission().request(*place_, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
  }

  /// Each makes one call and returns its status.
  std::map<std::string, std::function<grpc::Status(grpc::ClientContext&)>> calls() {
    return {{"PlanSlices",
             [this](grpc::ClientContext& context) {
               v1::PlanSlicesRequest request;
               part_of(*request.mutable_job()).set_mesh_id(mesh_id_);
               for (auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
                 (request.mutable_job()->mutable_grid()->mutable_pitch()->*set)(1);
               }
               v1::PlanSlicesResponse response;
               return server_.stub().PlanSlices(&context, request, &response);
             }},
            {"SliceRange",
             [this](grpc::ClientContext& context) {
               const auto reader = server_.stub().SliceRange(&context, slice_request(mesh_id_, 1, 0, 2));
               v1::SliceRangeResponse message;
               while (reader->Read(&message)) {
               }
               return reader->Finish();
             }},
            {"ProbePoints",
             [this](grpc::ClientContext& context) {
               const auto stream = server_.stub().ProbePoints(&context);
               v1::ProbePointsRequest request;
               request.set_mesh_id(mesh_id_);
               for (int i = 0; i < 3; ++i) request.add_points_mm(5);
               stream->Write(request);
               stream->WritesDone();
               v1::ProbePointsResponse response;
               while (stream->Read(&response)) {
               }
               return stream->Finish();
             }},
            {"TessellateBoundary",
             [this](grpc::ClientContext& context) {
               v1::TessellateBoundaryRequest request;
               request.set_mesh_id(mesh_id_);
               const auto reader = server_.stub().TessellateBoundary(&context, request);
               v1::TessellateBoundaryResponse message;
               while (reader->Read(&message)) {
               }
               return reader->Finish();
             }},
            {"UploadMesh", [this](grpc::ClientContext& context) {
               const std::string bytes = make_block(2, 11).SerializeAsString();
               v1::UploadMeshResponse response;
               const auto writer = server_.stub().UploadMesh(&context, &response);
               v1::UploadMeshRequest message;
               message.mutable_start()->set_mesh_id(mesh_id_of(bytes));
               message.mutable_start()->set_size_bytes(bytes.size());
               writer->Write(message);
               message.set_chunk(bytes);
               writer->Write(message);
               writer->WritesDone();
               return writer->Finish();
             }}};
  }

  TestServer server_;
  std::string mesh_id_;
  std::unique_ptr<Admission::Place> place_;
};

TEST_F(WaitingCalls, HaveTheirTurn) {
  for (const auto& [name, call] : calls()) {
    if (!place_) take_place();
    grpc::ClientContext context;
    auto status = std::async(std::launch::async, [&, &call = call] { return call(context); });
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s)) << name;
    EXPECT_EQ(status.wait_for(20ms), std::future_status::timeout) << name;
    place_ = nullptr;
    EXPECT_TRUE(status.get().ok()) << name;
    EXPECT_TRUE(eventually([this] { return admission().running() == 0; }, 1s)) << name;
  }
}

TEST_F(WaitingCalls, EndAtTheirDeadline) {
  for (const auto& [name, call] : calls()) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 150ms);
    EXPECT_EQ(call(context).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED) << name;
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 0; }, 1s)) << name << " left the queue";
    EXPECT_TRUE(eventually([this] { return server_.server().state().calls.open() == 0; }, 1s)) << name;
  }
}

TEST_F(WaitingCalls, EndWhenTheyAreCancelled) {
  for (const auto& [name, call] : calls()) {
    grpc::ClientContext context;
    auto status = std::async(std::launch::async, [&, &call = call] { return call(context); });
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s)) << name;
    context.TryCancel();
    EXPECT_EQ(status.get().error_code(), grpc::StatusCode::CANCELLED) << name;
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 0; }, 1s)) << name << " left the queue";
  }
}

TEST_F(WaitingCalls, AreToldToGoElsewhereWhenTheServerDrains) {
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::future<grpc::Status>> waiting;
  const auto all = calls();
  for (const char* name : {"SliceRange", "PlanSlices"}) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    waiting.push_back(std::async(std::launch::async, all.at(name), std::ref(*contexts.back())));
  }
  EXPECT_TRUE(eventually([this] { return admission().waiting() == 2; }, 2s));
  admission().drain();
  for (std::future<grpc::Status>& status : waiting) EXPECT_EQ(failure_of(status.get()).reason, "SERVER_DRAINING");
}

TEST_F(WaitingCalls, EndOnceHoweverOftenTheyAreStopped) {
  const auto all = calls();
  for (const char* name : {"PlanSlices", "SliceRange", "TessellateBoundary"}) {
    for (int round = 0; round < 20; ++round) {
      grpc::ClientContext context;
      auto status = std::async(std::launch::async, all.at(name), std::ref(context));
      EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s)) << name;
      for (int i = 0; i < 20; ++i) server_.server().state().calls.cut_off_all();
      EXPECT_EQ(failure_of(status.get()).reason, "SERVER_SHUTTING_DOWN") << name;
    }
  }
}

TEST_F(WaitingCalls, MoreThanMayWaitAreRefusedWithAPushback) {
  std::vector<std::unique_ptr<Admission::Place>> others;
  for (int i = 0; i < 2; ++i) {
    others.push_back(std::make_unique<Admission::Place>(admission(), std::to_string(i)));  // None has two.
    admission().request(*others.back(), [](const std::exception_ptr&) {});
  }
  for (const auto& [name, call] : calls()) {
    grpc::ClientContext context;
    const Failure failure = failure_of(call(context));
    EXPECT_EQ(failure.reason, "SERVER_BUSY") << name;
    EXPECT_TRUE(failure.retry) << name;
    const auto& trailers = context.GetServerTrailingMetadata();
    const auto pushback = trailers.find("grpc-retry-pushback-ms");
    ASSERT_NE(pushback, trailers.end()) << name;
    EXPECT_GE(std::stoi(std::string(pushback->second.data(), pushback->second.size())), 1000) << name;
  }
}

TEST_F(WaitingCalls, HoldRequestsOfAllMemoryForThemButAQuarterIsNeverOneClients) {
  place_ = nullptr;
  MemoryBudget& requests = server_.server().state().requests;
  const std::uint64_t most = requests.capacity_bytes() / 4 * 3;
  MemoryBudget::Share others(requests, "somebody else"), more(requests, "somebody else");
  ASSERT_TRUE(others.resize(most));
  EXPECT_FALSE(more.resize(1));
  const auto all = calls();
  for (const char* const name : {"PlanSlices", "SliceRange", "TessellateBoundary"}) {
    grpc::ClientContext context;
    EXPECT_TRUE(all.at(name)(context).ok()) << name;
  }
  others.give_back();

  MemoryBudget::Share own(requests, "ipv4:127.0.0.1");
  ASSERT_TRUE(own.resize(most));
  for (const char* const name : {"PlanSlices", "SliceRange", "TessellateBoundary"}) {
    grpc::ClientContext context;
    const Failure failure = failure_of(all.at(name)(context));
    EXPECT_EQ(failure.reason, "SERVER_BUSY") << name;
    EXPECT_TRUE(failure.retry) << name;
    EXPECT_NE(failure.message.find("of one client"), std::string::npos) << failure.message;
  }
}

/// A call of ProbePoints, a point at a time.
class PointTalk {
 public:
  explicit PointTalk(std::unique_ptr<v1::SlicerService::Stub> stub)
      : stub_(std::move(stub)), stream_(stub_->ProbePoints(&context)) {}

  /// Its mesh goes without saying but for the first one.
  bool send(double x_mm, const std::string& mesh_id = "") {
    v1::ProbePointsRequest request;
    request.set_mesh_id(mesh_id);
    for (const double number : {x_mm, 5.0, 5.0}) request.add_points_mm(number);
    return stream_->Write(request);
  }
  /// The channel's value there, which is x; nothing if the call has ended.
  std::optional<double> read() {
    v1::ProbePointsResponse response;
    if (!stream_->Read(&response)) return std::nullopt;
    return response.channel_values(0);
  }
  std::optional<double> ask(double x_mm, const std::string& mesh_id = "") {
    return send(x_mm, mesh_id) ? read() : std::nullopt;
  }
  grpc::Status finish() {
    stream_->WritesDone();
    return stream_->Finish();
  }

  grpc::ClientContext context;

 private:
  std::unique_ptr<v1::SlicerService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>> stream_;
};

/// Calls that have been answered, while somebody else has the only place.
class PointTalks : public WaitingCalls {
 protected:
  explicit PointTalks(std::chrono::milliseconds wait = 1h) : WaitingCalls(wait) { place_ = nullptr; }

  std::unique_ptr<PointTalk> answered_once() {
    auto call = std::make_unique<PointTalk>(server_.new_stub());
    const auto answer = call->ask(2, mesh_id_);
    EXPECT_TRUE(answer.has_value());
    EXPECT_NEAR(answer.value_or(0), 2, 1e-5);
    EXPECT_TRUE(eventually([this] { return admission().running() == 0; }, 2s)) << "between two batches";
    return call;
  }
  /// One that waits for its place again.
  std::unique_ptr<PointTalk> waiting_again() {
    auto call = answered_once();
    take_place();
    EXPECT_TRUE(call->send(3));
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s));
    return call;
  }
  void expect_nothing_is_left() {
    EXPECT_TRUE(
        eventually([this] { return server_.server().state().calls.open() == 0 && admission().waiting() == 0; }, 2s));
    place_ = nullptr;
    EXPECT_TRUE(eventually([this] { return admission().running() == 0; }, 2s));
  }
};

TEST_F(PointTalks, TakeTurnsWithMoreOfThemThanThereArePlaces) {
  std::vector<std::unique_ptr<PointTalk>> open;
  for (int i = 0; i < 4; ++i) open.push_back(answered_once());
  for (int round = 0; round < 3; ++round) {
    for (const auto& call : open) EXPECT_NEAR(call->ask(3 + round).value_or(0), 3 + round, 1e-5);
    grpc::ClientContext context;
    EXPECT_TRUE(calls().at("PlanSlices")(context).ok()) << "as others do";
  }
  for (const auto& call : open) EXPECT_TRUE(call->finish().ok());
  expect_nothing_is_left();
}

TEST_F(PointTalks, GoOnInOrderWhenTheyHaveWaitedAgain) {
  const auto call = waiting_again();
  for (const double x_mm : {4, 5, 6}) EXPECT_TRUE(call->send(x_mm));
  place_ = nullptr;
  for (const double x_mm : {3, 4, 5, 6}) EXPECT_NEAR(call->read().value_or(0), x_mm, 1e-5);
  EXPECT_TRUE(call->finish().ok());
  expect_nothing_is_left();
}

TEST_F(PointTalks, MayGoOnWhileCallsDrain) {
  const auto call = waiting_again();
  admission().drain();
  EXPECT_EQ(admission().waiting(), 1u);
  place_ = nullptr;
  EXPECT_NEAR(call->read().value_or(0), 3, 1e-5);
  EXPECT_NEAR(call->ask(4).value_or(0), 4, 1e-5);
  EXPECT_TRUE(call->finish().ok());
}

TEST_F(PointTalks, AreCancelledWhileTheyWaitAgain) {
  const auto call = waiting_again();
  call->context.TryCancel();
  EXPECT_EQ(call->finish().error_code(), grpc::StatusCode::CANCELLED);
  expect_nothing_is_left();
}

TEST_F(PointTalks, AreCutOffWhileTheyWaitAgain) {
  const auto call = waiting_again();
  for (int i = 0; i < 20; ++i) server_.server().state().calls.cut_off_all();
  EXPECT_FALSE(call->read());
  EXPECT_EQ(failure_of(call->finish()).reason, "SERVER_SHUTTING_DOWN");
  expect_nothing_is_left();
}

/// Whose solvers have gone, and all memory with them.
class PointTalksWithoutMemory : public PointTalks {
 protected:
  explicit PointTalksWithoutMemory(std::chrono::milliseconds wait = 1h) : PointTalks(wait) {}

  ServiceState& state() { return server_.server().state(); }
  std::unique_ptr<PointTalk> waiting_for_memory() {
    auto call = answered_once();
    EXPECT_GE(state().scratch.used_bytes(), 16u << 20) << "the first solver counts, too";
    EXPECT_TRUE(eventually(
        [this] {
          state().idle_watch.sweep();
          return state().scratch.used_bytes() == 0;
        },
        10s));
    EXPECT_TRUE(all_.resize(state().scratch.capacity_bytes()));
    EXPECT_TRUE(call->send(3));
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s));
    EXPECT_EQ(admission().running(), 0u) << "others have its place";
    return call;
  }
  void expect_nothing_is_held() {
    expect_nothing_is_left();
    all_.give_back();
    EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() == 0; }, 2s));
  }

  MemoryBudget::Share all_{state().scratch};
};

TEST_F(PointTalksWithoutMemory, WaitForIt) {
  const auto call = waiting_for_memory();
  EXPECT_EQ(admission().waiting_for_memory(), 1u);
  const DurationHistogram::Counts before = state().metrics.seconds_for_memory.counts();
  std::this_thread::sleep_for(100ms);
  all_.give_back();
  EXPECT_NEAR(call->read().value_or(0), 3, 1e-5);
  const DurationHistogram::Counts after = state().metrics.seconds_for_memory.counts();
  EXPECT_GE(after.sum_s, before.sum_s + 0.1);
  EXPECT_GT(after.all, before.all);
  EXPECT_LT(state().metrics.seconds_for_place.counts().sum_s, 0.1);
  EXPECT_TRUE(call->finish().ok());
  expect_nothing_is_held();
}

TEST_F(PointTalksWithoutMemory, AreCancelledThen) {
  const auto call = waiting_for_memory();
  call->context.TryCancel();
  EXPECT_EQ(call->finish().error_code(), grpc::StatusCode::CANCELLED);
  expect_nothing_is_held();
}

TEST_F(PointTalksWithoutMemory, AreCutOffThen) {
  const auto call = waiting_for_memory();
  for (int i = 0; i < 20; ++i) state().calls.cut_off_all();
  EXPECT_FALSE(call->read());
  EXPECT_EQ(failure_of(call->finish()).reason, "SERVER_SHUTTING_DOWN");
  expect_nothing_is_held();
}

/// The one that waits gets the memory of the other one, which asks for it again.
TEST_F(PointTalksWithoutMemory, TakeTurnsWhereThereIsEnoughForOne) {
  const auto first = answered_once();
  EXPECT_TRUE(all_.resize(state().scratch.capacity_bytes() - state().scratch.used_bytes() - (1 << 20)));
  PointTalk second(server_.new_stub());
  for (int round = 0; round < 4; ++round) {
    EXPECT_TRUE(second.send(4, mesh_id_));
    EXPECT_TRUE(eventually([this] { return admission().waiting() == 1; }, 2s)) << round;
    EXPECT_TRUE(first->send(3, mesh_id_));
    EXPECT_NEAR(second.read().value_or(0), 4, 1e-5);
    EXPECT_NEAR(first->read().value_or(0), 3, 1e-5);
  }
  EXPECT_TRUE(first->finish().ok());
  EXPECT_TRUE(second.finish().ok());
  expect_nothing_is_held();
}

class ImpatientPointTalksWithoutMemory : public PointTalksWithoutMemory {
 protected:
  ImpatientPointTalksWithoutMemory() : PointTalksWithoutMemory(300ms) {}
};

TEST_F(ImpatientPointTalksWithoutMemory, AreToldThatTheServerIsBusy) {
  const auto call = waiting_for_memory();
  EXPECT_FALSE(call->read());
  const Failure failure = failure_of(call->finish());
  EXPECT_EQ(failure.reason, "SERVER_BUSY");
  EXPECT_NE(failure.message.find("all memory"), std::string::npos) << failure.message;
  expect_nothing_is_held();
}

class ImpatientPointTalks : public PointTalks {
 protected:
  ImpatientPointTalks() : PointTalks(100ms) {}
};

TEST_F(ImpatientPointTalks, AreToldInTheirTurnThatTheServerIsBusy) {
  const auto call = waiting_again();
  EXPECT_FALSE(call->read());
  EXPECT_EQ(failure_of(call->finish()).reason, "SERVER_BUSY");
  EXPECT_EQ(call->context.GetServerTrailingMetadata().count("grpc-retry-pushback-ms"), 1u);
  expect_nothing_is_left();
}

class ImpatientCalls : public WaitingCalls {
 protected:
  ImpatientCalls() : WaitingCalls(50ms) {}
};

TEST_F(ImpatientCalls, AreRefusedAfterTheLongestWait) {
  for (const auto& [name, call] : calls()) {
    grpc::ClientContext context;
    EXPECT_EQ(failure_of(call(context)).reason, "SERVER_BUSY") << name;
    EXPECT_EQ(admission().waiting(), 0u) << name;
  }
}

TEST_F(WaitingCalls, UploadsWhoseBytesArriveTakeNoPlace) {
  place_ = nullptr;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<v1::UploadMeshResponse> responses(5);
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadMeshRequest>>> uploads;
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id("sha256:" + std::string(64, 'a'));
  message.mutable_start()->set_size_bytes(1000);
  for (v1::UploadMeshResponse& response : responses) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    uploads.push_back(server_.stub().UploadMesh(contexts.back().get(), &response));
    ASSERT_TRUE(uploads.back()->Write(message));
  }
  EXPECT_TRUE(eventually([this] { return server_.server().state().calls.open() == 5; }, 2s));
  EXPECT_EQ(admission().running(), 0u);
  grpc::ClientContext context;
  EXPECT_TRUE(calls().at("PlanSlices")(context).ok());
  for (const auto& open : contexts) open->TryCancel();
  for (const auto& upload : uploads) EXPECT_EQ(upload->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace ccslice::server
