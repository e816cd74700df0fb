// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a client does with several servers.

#include "client/attempts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "client/preview.h"
#include "tests/client/fake_slicer.h"
#include "tests/client/sample_calls.h"
#include "tests/support/job_parts.h"

namespace ccslice::client {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;

/// Pauses that a test would notice.
constexpr RetryPolicy kSlow{
    .max_attempts = 2, .first_pause = milliseconds(30'000), .longest_pause = milliseconds(30'000)};
constexpr milliseconds kAtOnce(5'000);  // On a busy machine, too.

class Fleet : public testing::Test {
 protected:
  Fleet() {
    for (int i = 0; i < 3; ++i) servers_.push_back(std::make_unique<FakeSlicer>());
    // The first in the mesh's order is number 0.
    const EndpointList order = Endpoints(options(kSlow)).in_order(mesh_->id());
    std::ranges::sort(servers_, {}, [&](const std::unique_ptr<FakeSlicer>& server) {
      return std::ranges::find(order, server->address(), [](const auto& at) { return at->address; }) - order.begin();
    });
  }

  ClientOptions options(const RetryPolicy& policy) const {
    ClientOptions options;
    options.retry = policy;
    for (const auto& server : servers_) options.addresses.push_back(server->address());
    return options;
  }

  FakeSlicer& server(std::size_t i) { return *servers_[i]; }

  /// The layers delivered, and that they are those of an undisturbed job.
  std::vector<std::uint32_t> slice_all(Client& client, const std::function<void(std::uint32_t)>& on_layer = {}) {
    std::vector<std::uint32_t> indices;
    outcome_ = client.slice(some_request(mesh_->id()), [&](const v1::SliceHeader&, const Layer& layer) {
      indices.push_back(layer.index);
      EXPECT_EQ(layer.planes[1].samples[1], static_cast<char>(7 + layer.index));
      if (on_layer) on_layer(layer.index);
    });
    return indices;
  }

  static milliseconds since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration_cast<milliseconds>(std::chrono::steady_clock::now() - begin);
  }

  std::shared_ptr<const MeshBytes> mesh_ = some_mesh();
  std::vector<std::unique_ptr<FakeSlicer>> servers_;
  SliceOutcome outcome_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

TEST_F(Fleet, CallsOfAMeshGoToOneServer) {
  Client client(options(kSlow));
  client.ensure_uploaded(mesh_);
  EXPECT_EQ(slice_all(client).size(), 6u);
  EXPECT_EQ(client.probe(mesh_->id(), {}, {1, 2, 3}).size(), 1u);
  EXPECT_EQ(server(0).uploads, 1);
  EXPECT_EQ(server(0).slice_requests.size(), 1u);
  EXPECT_EQ(server(1).metadata().size() + server(2).metadata().size(), 0u);
}

TEST_F(Fleet, EachCallOfAMeshNamesItForProxies) {
  Client client(options(kSlow));
  client.ensure_uploaded(mesh_);
  client.mesh_summary(mesh_->id());
  v1::PlanSlicesRequest plan;
  part_of(*plan.mutable_job()).set_mesh_id(mesh_->id());
  client.plan(plan);
  slice_all(client);
  client.probe(mesh_->id(), {}, {1, 2, 3});
  std::vector<std::string> named;
  for (const char* method : {"FindMissingMeshes", "UploadMesh", "GetMesh", "PlanSlices", "SliceRange", "ProbePoints"}) {
    named.push_back(method + (" ccslice-mesh-id=" + mesh_->id()));
  }
  EXPECT_EQ(server(0).metadata(), named);
  EXPECT_EQ(error_of([&] { client.mesh_summary("no id\n"); }).reason(), "MESH_MISSING") << "it is sent, if not named";
}

TEST_F(Fleet, OneThatIsDeadIsPassedOverAtOnce) {
  server(0).stop();
  Client client(options(kSlow));
  client.ensure_uploaded(mesh_);
  EXPECT_EQ(slice_all(client).size(), 6u);
  EXPECT_EQ(client.server_info().engine_version(), "engine-1");
  EXPECT_EQ(server(1).slice_requests.size(), 1u);
  EXPECT_LT(since(begin_), kAtOnce);
}

TEST_F(Fleet, OneThatDiesAmidAJobIsFollowedByTheNextAtTheNextLayer) {
  Client client(options(kSlow));
  client.ensure_uploaded(mesh_);
  server(0).before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    return layer == 3 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "killed") : grpc::Status::OK;
  };
  EXPECT_THAT(slice_all(client), testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(server(1).uploads, 1) << "it hadn't met the mesh";
  EXPECT_EQ(server(1).slice_requests.back().first_layer(), 3u);
  EXPECT_EQ(outcome_.resumes, 2) << "the second one asks for the mesh first";
  EXPECT_LT(since(begin_), kAtOnce);
}

TEST_F(Fleet, OneThatIsBusyIsPassedOverBeforeAnybodyWaits) {
  server(0).failing_info_calls = server(1).failing_info_calls = server(2).failing_info_calls = 1;
  Client client(options({.max_attempts = 2, .first_pause = milliseconds(100), .longest_pause = milliseconds(100)}));
  client.server_info();
  EXPECT_EQ(server(0).info_calls + server(1).info_calls + server(2).info_calls, 4) << "each one, a pause, the first";
  EXPECT_GE(since(begin_), milliseconds(70));
}

TEST_F(Fleet, AllThatAreDeadAreNamedWithTheirErrors) {
  for (const auto& server : servers_) server->stop();
  Client client(options({.max_attempts = 2, .first_pause = milliseconds(5)}));
  const ClientError error = error_of([&] { client.mesh_summary(mesh_->id()); });
  EXPECT_EQ(error.code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(error.reason(), "");
  EXPECT_THAT(error.what(), HasSubstr("none of 3 servers took the call: " + server(0).address() + ": "));
  for (const auto& server : servers_) EXPECT_THAT(error.what(), HasSubstr(server->address() + ": failed to connect"));
}

TEST_F(Fleet, OneThatAnswersSaysMoreThanThoseThatDoNot) {
  server(0).stop();
  server(2).stop();
  server(1).failing_info_calls = 1'000;
  Client client(options({.max_attempts = 2, .first_pause = milliseconds(5)}));
  const ClientError error = error_of([&] { client.server_info(); });
  EXPECT_EQ(error.reason(), "SERVER_BUSY");
  EXPECT_THAT(error.what(), HasSubstr(server(1).address() + ": busy"));
}

TEST_F(Fleet, AMeshThatIsNotAtHandIsLookedForOnAllOfThem) {
  server(2).meshes.insert(mesh_->id());
  server(0).stop();
  Client client(options(kSlow));
  EXPECT_EQ(client.mesh_summary(mesh_->id()).mesh_id(), mesh_->id());
  server(2).meshes.clear();
  const ClientError error = error_of([&] { client.mesh_summary(mesh_->id()); });
  EXPECT_EQ(error.missing_mesh_id(), mesh_->id());
  EXPECT_LT(since(begin_), kAtOnce) << "nobody waits for a mesh that nobody uploads";
}

TEST_F(Fleet, WhatWillNotPassIsNotTriedElsewhere) {
  server(0).upload_failures = {failure(grpc::StatusCode::INVALID_ARGUMENT, "MESH_NON_FINITE", "vertex 3 is NaN")};
  Client client(options(kSlow));
  EXPECT_EQ(error_of([&] { client.ensure_uploaded(mesh_); }).reason(), "MESH_NON_FINITE");
  EXPECT_EQ(server(1).uploads, 0);
}

TEST_F(Fleet, OneOfAnotherEngineIsPassedOver) {
  Client client(options(kSlow));
  client.ensure_uploaded(mesh_);
  server(1).engine_version = "engine-2";
  server(0).before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    return layer == 3 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "killed") : grpc::Status::OK;
  };
  EXPECT_EQ(slice_all(client).size(), 6u);
  EXPECT_EQ(server(2).slice_requests.back().first_layer(), 3u);
  for (const auto& server : servers_) server->engine_version = "engine-2";
  server(0).engine_version = "engine-1";
  EXPECT_EQ(error_of([&] { slice_all(client); }).reason(), local_reason::kEngineMixed);
}

TEST_F(Fleet, StreamsOfPicturesAreAskedOfTheFirstThatAnswers) {
  Client client(options(kSlow));
  server(0).meshes.insert(mesh_->id());
  EXPECT_EQ(client.endpoint_of(mesh_->id(), {})->address, server(0).address());
  server(0).stop();
  server(1).meshes.insert(mesh_->id());
  EXPECT_EQ(client.endpoint_of(mesh_->id(), {})->address, server(1).address());
  for (const auto& server : servers_) server->stop();
  EXPECT_EQ(client.endpoint_of(mesh_->id(), {})->address, server(0).address());
  PreviewStream stream(client, mesh_->id());
  stream.ask({});
  EXPECT_EQ(error_of([&] { stream.next(); }).code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Fleet, ANameWhoseAddressesAllChangeIsFollowedAmidAJob) {
  struct Known {
    std::mutex mutex;
    std::vector<std::string> addresses;
  };
  const auto known = std::make_shared<Known>();
  known->addresses = {server(0).address(), server(1).address()};
  Client client({.address = "slicers.example:1", .resolver = [known](const auto&, const auto&) {
                   const std::lock_guard lock(known->mutex);
                   return known->addresses;
                 }});
  client.ensure_uploaded(mesh_);
  std::promise<void> third_came;  // What is on its way as a server stops may be lost.
  std::thread mover;
  for (FakeSlicer* old : {&server(0), &server(1)}) {
    old->before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
      if (layer < 3) return grpc::Status::OK;
      if (!mover.joinable()) {
        mover = std::thread([&] {
          third_came.get_future().wait();
          server(0).stop();
          server(1).stop();
          const std::lock_guard lock(known->mutex);
          known->addresses = {server(2).address()};
        });
      }
      return grpc::Status(grpc::StatusCode::UNAVAILABLE, "moving");
    };
  }
  const auto on_layer = [&](std::uint32_t layer) {
    if (layer == 2) third_came.set_value();
  };
  EXPECT_THAT(slice_all(client, on_layer), testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(server(2).slice_requests.back().first_layer(), 3u);
  mover.join();
}

TEST_F(Fleet, AMeshIsDeletedEverywhere) {
  Client client(options(kSlow));
  server(2).meshes.insert(mesh_->id());
  server(0).stop();
  EXPECT_TRUE(client.delete_mesh(mesh_->id()));
  EXPECT_FALSE(client.delete_mesh(mesh_->id()));
  EXPECT_TRUE(server(2).meshes.empty());
}

TEST_F(Fleet, AProxyThatKnowsNoMeshesIsNamedWithTheRemedy) {
  // The server that gets the mesh never is the one that slices.
  FakeSlicer& proxy = server(0);
  Client client({.address = proxy.address(), .retry = kSlow});
  proxy.tamper_answer = [&](google::protobuf::Message& answer) {
    if (dynamic_cast<v1::UploadMeshResponse*>(&answer)) proxy.meshes.clear();
  };
  client.ensure_uploaded(mesh_);
  const ClientError error = error_of([&] { slice_all(client); });
  EXPECT_EQ(error.reason(), "MESH_MISSING");
  EXPECT_THAT(error.what(), AllOf(HasSubstr(proxy.address() + " was given the mesh 3 times"),
                                  HasSubstr("ccslice-mesh-id"), HasSubstr("--mesh-store")));
  EXPECT_EQ(proxy.uploads, 4);
}

TEST(Attempts, EndWithPatienceWhenTheServersOfANameKeepChanging) {
  const auto looked_up = std::make_shared<std::atomic<int>>(0);  // The thread may outlive this.
  const Endpoints endpoints({.address = "slicers.example:1", .resolver = [looked_up](const auto&, const auto&) {
                               return std::vector<std::string>{"127.0.0.1:" + std::to_string(++*looked_up)};
                             }});
  const CallOptions call;
  Attempts attempts({.patience = milliseconds(1'000)}, call, endpoints, {mesh_id_of("a mesh")});
  const auto fail_slowly = [&] {
    for (int i = 0; i < 6; ++i) {
      attempts.go_on_after(ClientError(busy_for(0, 0)));
      std::this_thread::sleep_for(milliseconds(1'100));  // Until the name stands for another server.
    }
  };
  EXPECT_EQ(error_of(fail_slowly).reason(), "SERVER_BUSY");
}

TEST(ClientError, AsksForAPauseOfNoMoreThanAnHourAndNeverForLessThanNone) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  constexpr std::int32_t kMostNanos = std::numeric_limits<std::int32_t>::max();
  constexpr std::chrono::hours kHour(1);
  const auto delay = [](std::int64_t seconds, std::int32_t nanos) {
    return ClientError(busy_for(seconds, nanos)).retry_delay().value();
  };
  EXPECT_EQ(delay(2, 500'000'000), milliseconds(2'500));
  EXPECT_EQ(delay(3'599, 999'000'000), milliseconds(3'599'999));
  EXPECT_EQ(delay(3'600, 1'000'000), kHour);
  EXPECT_EQ(delay(10'000'000'000, 0), kHour) << "beyond 64 bits as nanoseconds";
  EXPECT_EQ(delay(kMost, kMostNanos), kHour) << "beyond 64 bits as milliseconds";
  EXPECT_EQ(delay(kMost / 1'000 + 1, 0), kHour);
  EXPECT_EQ(delay(-1, 0), milliseconds(0));
  EXPECT_EQ(delay(-kMost - 1, -kMostNanos - 1), milliseconds(0));
  // The nanoseconds of a duration are less than a second and of its sign. These aren't.
  EXPECT_EQ(delay(0, kMostNanos), milliseconds(2'147));
  EXPECT_EQ(delay(0, -kMostNanos - 1), milliseconds(0));
  EXPECT_EQ(delay(1, -500'000'000), milliseconds(500));
}

TEST(ClientError, PassesWhereTheServersTransportHasNoMemory) {
  const ClientError refused(
      grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "Received RST_STREAM with error code 11"));
  EXPECT_TRUE(refused.is_passing());
  EXPECT_TRUE(ClientError(refused, "in other words").is_passing());
  const grpc::Status too_large(grpc::StatusCode::RESOURCE_EXHAUSTED, "Received message larger than max (5 vs. 4)");
  EXPECT_FALSE(ClientError(too_large).is_passing());
}

}  // namespace
}  // namespace ccslice::client
