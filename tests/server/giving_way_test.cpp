// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Long ranges and hard points of a client with many, while one with fewer waits.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/range_reader.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// Two ranges of one client that have begun, and another client that waits for a bit more memory than they leave.
class GivingWay : public ::testing::Test {
 protected:
  /// Calls on one thread have one slicer, and none to give back before they give way.
  static ServerOptions options() {
    ServerOptions options = test_options();
    options.threads = 1;
    return options;
  }
  GivingWay() : server_(options()) {}

  std::unique_ptr<RangeReader> begin_range() {
    auto range = std::make_unique<RangeReader>();
    range->stub = server_.new_stub();
    range->stream = range->stub->SliceRange(&range->context, request_);
    EXPECT_TRUE(range->read());
    return range;
  }
  ServiceState& state() { return server_.server().state(); }
  bool one_gives_way() {
    return eventually([this] { return state().metrics.gave_way.load() == 1; }, 10s);
  }
  /// Whichever of them it was has asked for its next turn.
  bool one_waits() {
    return eventually([this] { return state().admission.waiting() == 1; }, 5s);
  }
  void end_other() {
    taken_.give_back();
    state().admission.give_back(other_);
  }

  void SetUp() override {
    request_ = slice_request(server_.upload_good(make_block(2, 10)), 0.01, 50, 400);
    request_.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    whole_ = begin_range();
    whole_->read_all();
    ASSERT_TRUE(whole_->status.ok());
    ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() == 0; }, 5s));
    for (auto* range : {&first_, &second_}) *range = begin_range();
    ASSERT_TRUE(eventually([this] { return state().admission.running() == 2; }, 5s));
    const std::uint64_t more_than_is_free = state().scratch.capacity_bytes() - state().scratch.used_bytes() + 1;
    state().admission.request(other_, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
    state().admission.request_memory(
        other_, {.reserve = [this, more_than_is_free] { return taken_.resize(more_than_is_free); }},
        [this](const std::exception_ptr& refusal) { (refusal ? is_refused_ : runs_) = true; });
    ASSERT_FALSE(runs_);
  }
  void TearDown() override {
    for (auto* range : {first_.get(), second_.get()}) range->context.TryCancel();
  }

  TestServer server_;
  v1::SliceRangeRequest request_;
  std::unique_ptr<RangeReader> whole_, first_, second_;
  MemoryBudget::Share taken_{state().scratch};
  Admission::Place other_{state().admission, "another client"};
  std::atomic<bool> runs_{false}, is_refused_{false};
};

TEST_F(GivingWay, LetsTheOtherBeginAndGoesOnWithTheSameBytes) {
  ASSERT_TRUE(one_gives_way());
  EXPECT_TRUE(eventually([this] { return runs_.load(); }, 5s));
  std::thread reads_first([this] { first_->read_all(); });
  std::thread reads_second([this] { second_->read_all(); });
  std::this_thread::sleep_for(100ms);
  end_other();
  reads_first.join();
  reads_second.join();
  for (const RangeReader* range : {first_.get(), second_.get()}) {
    EXPECT_TRUE(range->status.ok()) << range->status.error_message();
    EXPECT_TRUE(range->bytes == whole_->bytes);
  }
  EXPECT_EQ(state().metrics.shed.load(), 0u);
  EXPECT_FALSE(is_refused_);
}

TEST_F(GivingWay, CanBeStoppedWhileItWaits) {
  ASSERT_TRUE(one_gives_way());
  EXPECT_TRUE(eventually([this] { return runs_.load(); }, 5s));
  std::thread reads_first([this] { first_->read_all(); });
  std::thread reads_second([this] { second_->read_all(); });
  EXPECT_TRUE(one_waits());
  for (auto* range : {first_.get(), second_.get()}) range->context.TryCancel();
  reads_first.join();
  reads_second.join();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 5s));
  EXPECT_EQ(state().admission.running(), 1u) << "the other one";
}

TEST_F(GivingWay, IsNotRefusedByAShutdownButCutOff) {
  ASSERT_TRUE(one_gives_way());
  EXPECT_TRUE(eventually([this] { return runs_.load(); }, 5s));
  std::thread reads_first([this] { first_->read_all(); });
  std::thread reads_second([this] { second_->read_all(); });
  EXPECT_TRUE(one_waits());
  state().admission.drain();
  EXPECT_EQ(state().admission.waiting(), 1u);
  state().calls.cut_off_all();
  reads_first.join();
  reads_second.join();
  EXPECT_EQ(state().admission.waiting(), 0u);
}

/// Points that take long.
class HardPoints : public ::testing::Test {
 protected:
  static constexpr int kPoints = 4096;

  /// A call of one batch.
  struct Probe {
    grpc::ClientContext context;
    std::unique_ptr<v1::SlicerService::Stub> stub;
    std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>> stream;
    v1::ProbePointsResponse response;
    grpc::Status status;

    void read_all() {
      EXPECT_TRUE(stream->Read(&response));
      status = stream->Finish();
    }
  };

  static ServerOptions options(std::uint64_t scratch_bytes) {
    ServerOptions options = test_options();
    options.threads = 1;
    options.scratch_budget_bytes = scratch_bytes;
    return options;
  }
  explicit HardPoints(std::uint64_t scratch_bytes) : server_(options(scratch_bytes)) {
    request_.set_mesh_id(server_.upload_good(make_overlapping_boxes(1800)));
    std::mt19937 random(2);
    for (int i = 0; i < 3 * kPoints; ++i) request_.add_points_mm(2 + 6.0 * random() / std::mt19937::max());
  }

  std::unique_ptr<Probe> begin_probe() {
    auto probe = std::make_unique<Probe>();
    probe->stub = server_.new_stub();
    probe->stream = probe->stub->ProbePoints(&probe->context);
    EXPECT_TRUE(probe->stream->Write(request_));
    probe->stream->WritesDone();
    return probe;
  }
  ServiceState& state() { return server_.server().state(); }

  TestServer server_;
  v1::ProbePointsRequest request_;
};

/// A client has two calls, and another one waits for memory. There is some for three solvers and most of a fourth.
class GivingWayWithPoints : public HardPoints {
 protected:
  GivingWayWithPoints() : HardPoints(64 << 20) {}

  /// Once both are being worked on, somebody else waits for what is left and half of what one of them has.
  void SetUp() override {
    for (auto* probe : {&first_, &second_}) *probe = begin_probe();
    ASSERT_TRUE(eventually([this] { return state().scratch.used_bytes() >= (32u << 20); }, 10s));
    const std::uint64_t bytes = state().scratch.capacity_bytes() - state().scratch.used_bytes() + (8 << 20);
    state().admission.request(other_, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
    state().admission.request_memory(
        other_, {.reserve = [this, bytes] { return taken_.resize(bytes); }},
        [this](const std::exception_ptr& refusal) { (refusal ? is_refused_ : runs_) = true; });
    ASSERT_FALSE(runs_);
    ASSERT_TRUE(eventually([this] { return runs_.load(); }, 20s));
    ASSERT_EQ(state().metrics.gave_way.load(), 1u) << "it didn't just end";
  }
  void end_other() {
    taken_.give_back();
    state().admission.give_back(other_);
  }

  std::unique_ptr<Probe> first_, second_;
  MemoryBudget::Share taken_{state().scratch};
  Admission::Place other_{state().admission, "another client"};
  std::atomic<bool> runs_{false}, is_refused_{false};
};

/// The server has memory for nearly five solvers, half of which is for short work.
class PointsOfManyCalls : public HardPoints {
 protected:
  PointsOfManyCalls() : HardPoints(80 << 20) {}
};

TEST_F(PointsOfManyCalls, LeaveHalfOfTheMemoryForShortWork) {
  std::vector<std::unique_ptr<Probe>> calls;
  for (int i = 0; i < 6; ++i) calls.push_back(begin_probe());
  EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 3; }, 10s));
  EXPECT_GE(state().scratch.used_bytes(), 48u << 20) << "three work";
  EXPECT_LE(state().scratch.used_bytes(), (80u - 20u) << 20);
  for (const auto& call : calls) call->context.TryCancel();
  EXPECT_TRUE(eventually([this] { return state().scratch.used_bytes() == 0; }, 10s));
}

TEST_F(GivingWayWithPoints, LetsTheOtherBeginAndAnswersAllTheSame) {
  EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
  end_other();
  first_->read_all();
  second_->read_all();
  EXPECT_TRUE(first_->status.ok() && second_->status.ok()) << second_->status.error_message();
  EXPECT_EQ(first_->response.locations_size(), kPoints);
  EXPECT_EQ(first_->response.SerializeAsString(), second_->response.SerializeAsString());
  EXPECT_FALSE(is_refused_);
}

TEST_F(GivingWayWithPoints, CanBeStoppedWhileItWaits) {
  EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
  for (auto* probe : {first_.get(), second_.get()}) probe->context.TryCancel();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 5s));
  EXPECT_EQ(state().admission.running(), 1u) << "the other one";
}

TEST_F(GivingWayWithPoints, IsNotRefusedByAShutdownButCutOff) {
  EXPECT_TRUE(eventually([this] { return state().admission.waiting() == 1; }, 5s));
  state().admission.drain();
  EXPECT_EQ(state().admission.waiting(), 1u);
  state().calls.cut_off_all();
  EXPECT_TRUE(eventually([this] { return state().calls.open() == 0 && state().admission.waiting() == 0; }, 5s));
}

}  // namespace
}  // namespace ccslice::server
