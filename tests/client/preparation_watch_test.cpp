// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/preparation_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "tests/client/fake_slicer.h"
#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr RetryPolicy kOneAttempt{.max_attempts = 1};

v1::GetPreparationResponse at(v1::PreparationPhase phase, std::uint64_t done) {
  v1::GetPreparationResponse answer;
  answer.set_phase(phase);
  answer.set_done_cells(done);
  answer.set_total_cells(10);
  return answer;
}

/// An upload that the server answers once `release_` is set.
class PreparationWatchTest : public testing::Test {
 protected:
  PreparationWatchTest() {
    server_.before_upload_ends = [this](grpc::ServerContext& context) {
      while (!released_ && !context.IsCancelled()) std::this_thread::sleep_for(milliseconds(1));
    };
  }

  void upload(const PreparationReport& report, Cancellation* cancellation = nullptr) {
    client_.ensure_uploaded(mesh_, {}, {.cancellation = cancellation}, report);
  }
  void release_after(milliseconds time) {
    releaser_ = std::async(std::launch::async, [this, time] {
      std::this_thread::sleep_for(time);
      released_ = true;
    });
  }

  FakeSlicer server_;
  Client client_{ClientOptions{server_.address(), kOneAttempt}};
  std::shared_ptr<const MeshBytes> mesh_ = some_mesh();
  std::atomic<bool> released_ = false;
  std::future<void> releaser_;
  std::vector<std::pair<int, std::uint64_t>> reported_;
  const PreparationReport report_ = [this](const v1::GetPreparationResponse& answer) {
    reported_.emplace_back(answer.phase(), answer.done_cells());
  };
};

TEST_F(PreparationWatchTest, ReportsWhatIsFurtherThanBefore) {
  const std::vector<v1::GetPreparationResponse> answers = {
      at(v1::PREPARATION_PHASE_UNSPECIFIED, 0), at(v1::PREPARATION_PHASE_BUILDING, 3),
      at(v1::PREPARATION_PHASE_PREPARED, 0),    at(v1::PREPARATION_PHASE_BUILDING, 2),
      at(v1::PREPARATION_PHASE_BOUNDING, 1),    at(v1::PREPARATION_PHASE_WAITING, 0)};
  std::size_t next = 0;
  server_.preparation = [&](grpc::ServerContext&, v1::GetPreparationResponse& response) {
    response = answers[next++];
    released_ = next == answers.size();
    return grpc::Status::OK;
  };
  upload(report_);
  EXPECT_THAT(reported_, ElementsAre(std::pair(v1::PREPARATION_PHASE_BUILDING, 3u),
                                     std::pair(v1::PREPARATION_PHASE_BOUNDING, 1u)));
  EXPECT_EQ(server_.metadata().back(), "GetPreparation ccslice-mesh-id=" + mesh_->id()) << "so proxies find the server";
}

TEST_F(PreparationWatchTest, GoesOnAfterErrors) {
  int asked = 0;
  server_.preparation = [&](grpc::ServerContext&, v1::GetPreparationResponse& response) {
    if (++asked == 1) return failure(grpc::StatusCode::UNAVAILABLE, "SERVER_DRAINING", "draining");
    response = at(v1::PREPARATION_PHASE_BUILDING, 1);
    released_ = true;
    return grpc::Status::OK;
  };
  upload(report_);
  EXPECT_THAT(reported_, ElementsAre(std::pair(v1::PREPARATION_PHASE_BUILDING, 1u)));
}

TEST_F(PreparationWatchTest, AsksAnOlderServerOnce) {
  release_after(milliseconds(1700));
  upload(report_);
  EXPECT_THAT(reported_, IsEmpty());
  EXPECT_EQ(server_.preparation_calls, 1);
}

TEST_F(PreparationWatchTest, AsksNothingForNobodyOrForAShortWhile) {
  server_.preparation = [&](grpc::ServerContext&, v1::GetPreparationResponse&) { return grpc::Status::OK; };
  release_after(milliseconds(1200));
  upload({});
  server_.meshes.clear();
  upload(report_);  // Released already.
  EXPECT_EQ(server_.preparation_calls, 0);
}

TEST_F(PreparationWatchTest, EndsWithTheCallAlthoughAnAnswerIsLate) {
  std::atomic<bool> hangs = false;
  server_.preparation = [&](grpc::ServerContext& context, v1::GetPreparationResponse&) {
    hangs = true;
    released_ = true;
    while (!context.IsCancelled()) std::this_thread::sleep_for(milliseconds(1));
    return grpc::Status::OK;
  };
  const auto begin = std::chrono::steady_clock::now();
  upload(report_);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(4)) << "it waited for an answer";
  EXPECT_TRUE(hangs);
}

TEST_F(PreparationWatchTest, CancelsTheUploadIfTheReportThrows) {
  server_.preparation = [&](grpc::ServerContext&, v1::GetPreparationResponse& response) {
    response = at(v1::PREPARATION_PHASE_BUILDING, 1);
    return grpc::Status::OK;
  };
  EXPECT_THROW(upload([](const v1::GetPreparationResponse&) { throw std::logic_error("mine"); }), std::logic_error);
  EXPECT_FALSE(released_);
}

TEST_F(PreparationWatchTest, LeavesAnUploadCancellable) {
  Cancellation cancellation;
  server_.preparation = [&](grpc::ServerContext&, v1::GetPreparationResponse& response) {
    response = at(v1::PREPARATION_PHASE_BUILDING, 1);
    return grpc::Status::OK;
  };
  const auto report = [&](const v1::GetPreparationResponse&) { cancellation.cancel(); };
  EXPECT_EQ(error_of([&] { upload(report, &cancellation); }).reason(), "CANCELLED_HERE");
  EXPECT_FALSE(released_);
}

}  // namespace
}  // namespace ccslice::client
