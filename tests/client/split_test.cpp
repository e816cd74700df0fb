// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One job over several servers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "tests/client/fake_slicer.h"
#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

using std::chrono::milliseconds;

class Split : public testing::Test {
 protected:
  Split() { client_.ensure_uploaded(mesh_); }

  /// All samples of the layers, one after the other.
  std::string slice_all(Client& client, unsigned split, SlicePin* pin = nullptr) {
    std::string bytes;
    std::uint32_t next = kFirst;
    const auto on_layer = [&](const v1::SliceHeader& header, const Layer& layer) {
      EXPECT_EQ(layer.index, next++);
      EXPECT_EQ(header.first_layer(), kFirst);
      EXPECT_EQ(header.layer_count(), kCount);
      for (const Plane& plane : layer.planes) bytes += plane.encoded + plane.samples;
    };
    outcome_ = client.slice(some_request(mesh_->id(), kFirst, kCount), on_layer, {.split = split}, pin);
    return bytes;
  }

  std::uint64_t layers_asked_of(const FakeSlicer& server) const {
    std::uint64_t layers = 0;
    for (const v1::SliceRangeRequest& request : server.slice_requests) layers += request.layer_count();
    return layers;
  }

  static constexpr std::uint32_t kFirst = 3, kCount = 500;
  static constexpr RetryPolicy kPolicy{.max_attempts = 3, .first_pause = milliseconds(5)};

  FakeSlicer one_, two_;
  Client client_{ClientOptions{.retry = kPolicy, .addresses = {one_.address(), two_.address()}}};
  std::shared_ptr<const MeshBytes> mesh_ = some_mesh();
  SliceOutcome outcome_;
};

TEST_F(Split, GivesTheSameBytesInTheSameOrder) {
  const std::string bytes = slice_all(client_, 1);
  const SliceOutcome alone = outcome_;
  EXPECT_EQ(layers_asked_of(one_) + layers_asked_of(two_), kCount);
  EXPECT_TRUE(one_.slice_requests.empty() || two_.slice_requests.empty());
  one_.slice_requests.clear();
  two_.slice_requests.clear();
  EXPECT_EQ(slice_all(client_, 2), bytes);
  EXPECT_EQ(outcome_.layers, kCount);
  EXPECT_EQ(outcome_.voxel_count, alone.voxel_count);
  EXPECT_EQ(outcome_.encoded_bytes, alone.encoded_bytes);
  EXPECT_EQ(outcome_.header.SerializeAsString(), alone.header.SerializeAsString());
  EXPECT_GT(layers_asked_of(one_), 0u);
  EXPECT_GT(layers_asked_of(two_), 0u);
  EXPECT_EQ(one_.uploads + two_.uploads, 2) << "the second one got the mesh too";
  EXPECT_EQ(slice_all(client_, 8), bytes) << "there are but two";
}

TEST_F(Split, LeavesMoreToTheServerThatIsFaster) {
  one_.before_layer = [](std::uint32_t, grpc::ServerContext&) {
    std::this_thread::sleep_for(milliseconds(4));
    return grpc::Status::OK;
  };
  slice_all(client_, 2);
  EXPECT_LT(layers_asked_of(one_), layers_asked_of(two_));
}

TEST_F(Split, GoesOnWhereOneDies) {
  const std::string bytes = slice_all(client_, 1);
  std::atomic<int> layers = 0;
  one_.before_layer = [&](std::uint32_t, grpc::ServerContext&) {
    return ++layers > 20 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "killed") : grpc::Status::OK;
  };
  EXPECT_EQ(slice_all(client_, 2), bytes);
  EXPECT_GT(outcome_.resumes, 0);
}

TEST_F(Split, EndsWithTheErrorOfAnyStream) {
  for (FakeSlicer* server : {&one_, &two_}) {
    server->before_layer = [](std::uint32_t layer, grpc::ServerContext&) {
      return layer == 400 ? failure(grpc::StatusCode::INTERNAL, "INTERNAL", "a fault") : grpc::Status::OK;
    };
  }
  EXPECT_EQ(error_of([&] { slice_all(client_, 2); }).reason(), "INTERNAL");
}

TEST_F(Split, RefusesToMixEngines) {
  two_.engine_version = "engine-2";
  EXPECT_EQ(error_of([&] { slice_all(client_, 2); }).reason(), local_reason::kEngineMixed);
  SlicePin pin{.engine_version = "engine-1", .grid = {}};
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(slice_all(client_, 2, &pin).empty()) << "the one of the right engine does it alone";
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(Split, EndsWithAThrowingCallback) {
  const auto on_layer = [](const v1::SliceHeader&, const Layer& layer) {
    if (layer.index == 100) throw std::runtime_error("disk full");
  };
  EXPECT_THROW(client_.slice(some_request(mesh_->id(), 0, kCount), on_layer, {.split = 2}), std::runtime_error);
}

TEST_F(Split, CanBeCancelled) {
  Cancellation cancellation;
  for (FakeSlicer* server : {&one_, &two_}) {
    server->before_layer = [](std::uint32_t layer, grpc::ServerContext& context) {
      while (layer > 10 && !context.IsCancelled()) std::this_thread::sleep_for(milliseconds(1));
      return context.IsCancelled() ? grpc::Status::CANCELLED : grpc::Status::OK;
    };
  }
  const auto on_layer = [&](const v1::SliceHeader&, const Layer& layer) {
    if (layer.index == 10) cancellation.cancel();
  };
  const CallOptions call{.cancellation = &cancellation, .split = 2};
  EXPECT_EQ(error_of([&] { client_.slice(some_request(mesh_->id(), 0, kCount), on_layer, call); }).reason(),
            local_reason::kCancelledHere);
}

}  // namespace
}  // namespace ccslice::client
