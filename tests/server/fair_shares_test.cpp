// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who gets an answer while others keep the workers busy.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <string>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// A server whose workers are all busy, but for the one that takes interactive work alone.
class FairShares : public ::testing::Test {
 protected:
  FairShares() {
    Executor& executor = server_.server().state().executor;
    for (std::size_t i = 0; i < executor.threads(); ++i) {
      executor.make_lane("somebody else", Pieces::kBatch).post([this, opened = opened_] {
        ++busy_;
        opened.wait();
      });
    }
    EXPECT_TRUE(eventually([&] { return busy_ == executor.threads(); }, 5s));
  }
  ~FairShares() override { open_.set_value(); }

  static void bound(grpc::ClientContext& context, std::chrono::milliseconds time) {
    context.set_deadline(std::chrono::system_clock::now() + time);
  }
  grpc::Status slice(double pitch_mm, std::uint32_t layers, std::chrono::milliseconds time) {
    grpc::ClientContext context;
    bound(context, time);
    const auto reader = server_.stub().SliceRange(&context, slice_request(id_, pitch_mm, 0, layers));
    v1::SliceRangeResponse message;
    while (reader->Read(&message)) {
    }
    return reader->Finish();
  }

  TestServer server_;
  const std::string id_ = server_.upload_good(make_box(2, 10));

 private:
  std::atomic<std::size_t> busy_ = 0;
  std::promise<void> open_;
  const std::shared_future<void> opened_ = open_.get_future().share();
};

TEST_F(FairShares, PlansAreMadeAtOnce) {
  grpc::ClientContext context;
  bound(context, 10s);
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(id_);
  *request.mutable_job()->mutable_grid() = slice_request(id_, 0.1, 0, 1).job().grid();
  v1::PlanSlicesResponse response;
  const grpc::Status status = server_.stub().PlanSlices(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(FairShares, PointsAreProbedAndEvaluatedAtOnce) {
  {
    grpc::ClientContext context;
    bound(context, 10s);
    v1::ProbePointsRequest request;
    request.set_mesh_id(id_);
    for (int i = 0; i < 3; ++i) request.add_points_mm(5);
    v1::ProbePointsResponse response;
    const auto stream = server_.stub().ProbePoints(&context);
    EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }
  grpc::ClientContext context;
  bound(context, 10s);
  v1::EvaluatePointsRequest request;
  request.set_mesh_id(id_);
  request.add_limit_cells(0);
  for (int i = 0; i < 3; ++i) request.add_uvw(0.5);
  v1::EvaluatePointsResponse response;
  const auto stream = server_.stub().EvaluatePoints(&context);
  EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(FairShares, RangesOfUpTo4MiBAreSlicedAtOnce) {
  EXPECT_TRUE(slice(/*pitch_mm=*/0.01, /*layers=*/33, 10s).ok()) << "33 layers of 1000 x 1000 bits";
}

TEST_F(FairShares, LargerRangesWaitForTheirTurn) {
  EXPECT_EQ(slice(/*pitch_mm=*/0.01, /*layers=*/34, 300ms).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

}  // namespace
}  // namespace ccslice::server
