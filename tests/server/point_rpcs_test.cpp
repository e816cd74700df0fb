// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/service/base/limits.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

class PointRpcs : public ::testing::Test {
 protected:
  /// Sends these messages, reads as many answers as come; how the call ended.
  grpc::Status probe(const std::vector<v1::ProbePointsRequest>& requests,
                     std::vector<v1::ProbePointsResponse>& responses) {
    grpc::ClientContext context;
    const auto stream = server_.stub().ProbePoints(&context);
    return converse(*stream, requests, responses);
  }
  grpc::Status evaluate(const std::vector<v1::EvaluatePointsRequest>& requests,
                        std::vector<v1::EvaluatePointsResponse>& responses) {
    grpc::ClientContext context;
    const auto stream = server_.stub().EvaluatePoints(&context);
    return converse(*stream, requests, responses);
  }

  v1::ProbePointsRequest points(std::initializer_list<double> numbers) const {
    v1::ProbePointsRequest request;
    request.set_mesh_id(id_);
    for (const double number : numbers) request.add_points_mm(number);
    return request;
  }

  Failure probe_failure(const v1::ProbePointsRequest& request) {
    std::vector<v1::ProbePointsResponse> responses;
    return failure_of(probe({request}, responses));
  }
  Failure evaluate_failure(const v1::EvaluatePointsRequest& request) {
    std::vector<v1::EvaluatePointsResponse> responses;
    return failure_of(evaluate({request}, responses));
  }

  TestServer server_;
  const std::string id_ = server_.upload_good(make_box(2, 10));

 private:
  template <class Stream, class Request, class Response>
  grpc::Status converse(Stream& stream, const std::vector<Request>& requests, std::vector<Response>& responses) {
    for (const Request& request : requests) {
      if (!stream.Write(request)) break;
      Response response;
      if (!stream.Read(&response)) break;
      responses.push_back(response);
    }
    stream.WritesDone();
    return stream.Finish();
  }
};

TEST_F(PointRpcs, ProbeTellsInsideFromNearFromOutside) {
  std::vector<v1::ProbePointsResponse> responses;
  const grpc::Status status = probe({points({1, 2, 3, 11, 5, 5, 10.0015, 5, 5, 7.5, 5, 5})}, responses);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const v1::ProbePointsResponse& answer = responses.at(0);
  ASSERT_EQ(answer.locations_size(), 4);
  EXPECT_EQ(answer.locations(0), v1::POINT_LOCATION_INSIDE);
  EXPECT_EQ(answer.locations(1), v1::POINT_LOCATION_OUTSIDE);
  EXPECT_EQ(answer.locations(2), v1::POINT_LOCATION_NEAR);
  EXPECT_EQ(answer.locations(3), v1::POINT_LOCATION_INSIDE);
  EXPECT_EQ(answer.uvw_size(), 12);
  EXPECT_NEAR(answer.channel_values(0), 1, 1e-5);
  EXPECT_EQ(answer.channel_values(1), 0);
  EXPECT_NEAR(answer.channel_values(3), 7.5, 1e-5);
  EXPECT_LE(answer.residuals_mm(0), 1e-6);
  EXPECT_NEAR(answer.residuals_mm(2), 0.0015, 1e-5);
  EXPECT_LT(answer.control_cells(0), 8u);
}

TEST_F(PointRpcs, PointsWithinTheContourToleranceAreInside) {
  v1::ProbePointsRequest by_default = points({10.0009, 5, 5}), strict = by_default, again = by_default,
                         wide = by_default;
  strict.set_contour_tolerance_mm(0);
  wide.set_contour_tolerance_mm(0.1);
  wide.set_points_mm(0, 10.09);
  v1::ProbePointsRequest scaled = wide;  // The tolerance is one of the world.
  scaled.set_points_mm(0, 100.2);
  for (const double number : {10, 0, 0, 0, 0, 10, 0, 0, 0, 0, 10, 0}) scaled.mutable_placement()->add_matrix(number);
  scaled.set_points_mm(1, 50);
  scaled.set_points_mm(2, 50);
  std::vector<v1::ProbePointsResponse> responses;
  ASSERT_TRUE(probe({by_default, strict, again, wide, scaled}, responses).ok());
  EXPECT_EQ(responses[0].locations(0), v1::POINT_LOCATION_INSIDE);
  EXPECT_NEAR(responses[0].residuals_mm(0), 0.0009, 1e-6);
  EXPECT_EQ(responses[1].locations(0), v1::POINT_LOCATION_NEAR);
  EXPECT_EQ(responses[2].locations(0), v1::POINT_LOCATION_NEAR) << "until another message sets it";
  EXPECT_EQ(responses[3].locations(0), v1::POINT_LOCATION_INSIDE);
  EXPECT_EQ(responses[4].locations(0), v1::POINT_LOCATION_OUTSIDE);
}

TEST_F(PointRpcs, EvaluateUndoesProbe) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(0.01, 9.99);
  v1::ProbePointsRequest request;
  request.set_mesh_id(id_);
  for (int i = 0; i < 3000; ++i) request.add_points_mm(coordinate(random));
  std::vector<v1::ProbePointsResponse> probed;
  ASSERT_TRUE(probe({request}, probed).ok());
  v1::EvaluatePointsRequest back;
  back.set_mesh_id(id_);
  *back.mutable_limit_cells() = probed.at(0).limit_cells();
  *back.mutable_uvw() = probed.at(0).uvw();
  std::vector<v1::EvaluatePointsResponse> evaluated;
  ASSERT_TRUE(evaluate({back}, evaluated).ok());
  for (int i = 0; i < 3000; ++i) ASSERT_NEAR(evaluated.at(0).positions_mm(i), request.points_mm(i), 1e-5);
  EXPECT_EQ(evaluated.at(0).jacobians_mm_size(), 9000);
  EXPECT_EQ(evaluated.at(0).channel_values_size(), 1000);
}

TEST_F(PointRpcs, APlacementHoldsUntilAnotherOneIsSet) {
  v1::ProbePointsRequest moved = points({105, 5, 5});
  for (const double number : {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0}) moved.mutable_placement()->add_matrix(number);
  v1::ProbePointsRequest again = points({105, 5, 5});
  again.clear_mesh_id();
  v1::ProbePointsRequest home = points({5, 5, 5});
  home.mutable_placement();
  std::vector<v1::ProbePointsResponse> responses;
  ASSERT_TRUE(probe({moved, again, home}, responses).ok());
  ASSERT_EQ(responses.size(), 3u);
  for (const auto& response : responses) EXPECT_EQ(response.locations(0), v1::POINT_LOCATION_INSIDE);
}

TEST_F(PointRpcs, JacobiansAreThoseOfTheWorld) {
  v1::EvaluatePointsRequest request;
  request.set_mesh_id(id_);
  for (const double number : {0, -2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0}) request.mutable_placement()->add_matrix(number);
  request.add_limit_cells(0);
  for (int i = 0; i < 3; ++i) request.add_uvw(0.5);
  std::vector<v1::EvaluatePointsResponse> base;
  v1::EvaluatePointsRequest step = request;
  std::vector<v1::EvaluatePointsResponse> moved;
  step.set_uvw(1, 0.5 + 1e-5);
  ASSERT_TRUE(evaluate({request}, base).ok());
  ASSERT_TRUE(evaluate({step}, moved).ok());
  for (int row = 0; row < 3; ++row) {
    const double slope = (moved[0].positions_mm(row) - base[0].positions_mm(row)) / 1e-5;
    EXPECT_NEAR(base[0].jacobians_mm(3 * row + 1), slope, 1e-3);
  }
}

TEST_F(PointRpcs, EmptyBatchesAreAnswered) {
  std::vector<v1::ProbePointsResponse> responses;
  ASSERT_TRUE(probe({points({}), points({5, 5, 5})}, responses).ok());
  EXPECT_EQ(responses.size(), 2u);
}

TEST_F(PointRpcs, CallsWithoutAnyMessageAnswerNothing) {
  std::vector<v1::ProbePointsResponse> probed;
  EXPECT_TRUE(probe({}, probed).ok());
  EXPECT_TRUE(probed.empty());
  std::vector<v1::EvaluatePointsResponse> evaluated;
  EXPECT_TRUE(evaluate({}, evaluated).ok());
  EXPECT_TRUE(evaluated.empty());
}

TEST_F(PointRpcs, PointsAsFarAsNumbersGoAreOutside) {
  std::vector<v1::ProbePointsResponse> responses;
  ASSERT_TRUE(probe({points({1e308, -1e308, 1e308, 5e-324, 1e308, 0})}, responses).ok());
  for (const int location : responses[0].locations()) EXPECT_EQ(location, v1::POINT_LOCATION_OUTSIDE);
}

TEST_F(PointRpcs, AHundredThousandPointsFitIntoBatches) {
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  std::size_t inside = 0;
  v1::ProbePointsRequest request;
  request.set_mesh_id(id_);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(0.01, 9.99);
  for (std::size_t sent = 0; sent < 100'000; sent += kMaxPointsPerMessage) {
    request.clear_points_mm();
    for (std::uint32_t i = 0; i < 3 * kMaxPointsPerMessage; ++i) request.add_points_mm(coordinate(random));
    ASSERT_TRUE(stream->Write(request));
    v1::ProbePointsResponse response;
    ASSERT_TRUE(stream->Read(&response));
    for (const int location : response.locations()) inside += location == v1::POINT_LOCATION_INSIDE ? 1 : 0;
  }
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(inside, 25u * kMaxPointsPerMessage);
}

TEST_F(PointRpcs, ProbeRefusesWrongBatches) {
  EXPECT_EQ(probe_failure(points({1, 2})).reason, "REQUEST_MALFORMED");
  EXPECT_EQ(probe_failure(points({1, 2})).field, "points_mm");
  const Failure not_finite = probe_failure(points({1, 2, 3, 4, std::numeric_limits<double>::quiet_NaN(), 6}));
  EXPECT_EQ(not_finite.reason, "POINT_NON_FINITE");
  EXPECT_EQ(not_finite.field, "points_mm[4]");
  EXPECT_EQ(not_finite.ids, "1");
  v1::ProbePointsRequest large = points({});
  for (std::uint32_t i = 0; i <= 3 * kMaxPointsPerMessage + 2; ++i) large.add_points_mm(1);
  EXPECT_EQ(probe_failure(large).reason, "BATCH_TOO_LARGE");
  for (const double tolerance : {-1e-9, 1.5, std::numeric_limits<double>::quiet_NaN()}) {
    v1::ProbePointsRequest request = points({1, 2, 3});
    request.set_contour_tolerance_mm(tolerance);
    EXPECT_EQ(probe_failure(request).reason, "TOLERANCE_INVALID");
    EXPECT_EQ(probe_failure(request).field, "contour_tolerance_mm");
  }
  v1::ProbePointsRequest flat = points({1, 2, 3});
  for (int i = 0; i < 12; ++i) flat.mutable_placement()->add_matrix(0);
  EXPECT_EQ(probe_failure(flat).reason, "PLACEMENT_SINGULAR");
}

TEST_F(PointRpcs, RefuseUnknownAndChangingMeshes) {
  v1::ProbePointsRequest request = points({1, 2, 3});
  request.set_mesh_id("");
  EXPECT_EQ(probe_failure(request).reason, "MESH_ID_INVALID");
  request.set_mesh_id(mesh_id_of("unknown"));
  EXPECT_EQ(probe_failure(request).missing, request.mesh_id());
  std::vector<v1::ProbePointsResponse> responses;
  const Failure failure = failure_of(probe({points({1, 2, 3}), request}, responses));
  EXPECT_EQ(failure.reason, "REQUEST_MALFORMED");
  EXPECT_EQ(failure.field, "mesh_id");
  EXPECT_EQ(responses.size(), 1u) << "the first batch was answered";
}

TEST_F(PointRpcs, EvaluateRefusesUnknownCellsAndParameters) {
  v1::EvaluatePointsRequest request;
  request.set_mesh_id(id_);
  request.add_limit_cells(4'000'000'000);
  EXPECT_EQ(evaluate_failure(request).reason, "REQUEST_MALFORMED");
  for (int i = 0; i < 3; ++i) request.add_uvw(0.5);
  EXPECT_EQ(evaluate_failure(request).reason, "LIMIT_CELL_UNKNOWN");
  EXPECT_EQ(evaluate_failure(request).field, "limit_cells[0]");
  request.set_limit_cells(0, 0);
  for (const double wrong : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    request.set_uvw(1, wrong);
    EXPECT_EQ(evaluate_failure(request).reason, "PARAMETER_INVALID");
    EXPECT_EQ(evaluate_failure(request).field, "uvw[1]");
  }
}

/// Many batches without waiting for their answers.
class BatchesAhead : public PointRpcs {
 protected:
  using Stream = grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>;

  BatchesAhead() {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> coordinate(-2, 12);
    for (int batch = 0; batch < 40; ++batch) {
      v1::ProbePointsRequest& request = requests_.emplace_back();
      if (batch == 0) request.set_mesh_id(id_);
      // Batches of very different lengths overtake one another, unless they are kept from it.
      for (int i = 0; i < (batch % 3 ? 30 : 3 * 4096); ++i) request.add_points_mm(coordinate(random));
      if (batch % 5 == 3) {
        for (const double number : {1.0, 0.0, 0.0, 0.1 * batch, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) {
          request.mutable_placement()->add_matrix(number);
        }
        request.set_contour_tolerance_mm(0.01 * batch);
      }
    }
  }

  /// Writes all at once, and reads until the stream ends.
  grpc::Status stream_all(std::vector<v1::ProbePointsResponse>& responses) {
    grpc::ClientContext context;
    const auto stream = server_.stub().ProbePoints(&context);
    std::thread writer([&] {
      for (const v1::ProbePointsRequest& request : requests_) {
        if (!stream->Write(request)) return;
      }
      stream->WritesDone();
    });
    v1::ProbePointsResponse response;
    while (stream->Read(&response)) responses.push_back(response);
    writer.join();
    return stream->Finish();
  }

  std::vector<v1::ProbePointsRequest> requests_;
};

TEST_F(BatchesAhead, AreAnsweredInOrderAsOneByOne) {
  std::vector<v1::ProbePointsResponse> one_by_one, together;
  ASSERT_TRUE(probe(requests_, one_by_one).ok());
  const grpc::Status status = stream_all(together);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(together.size(), requests_.size());
  for (std::size_t i = 0; i < together.size(); ++i) {
    EXPECT_EQ(together[i].SerializeAsString(), one_by_one[i].SerializeAsString()) << i;
  }
}

TEST_F(BatchesAhead, AreAnsweredUpToTheFirstThatFails) {
  for (const int wrong : {1, 17, 39}) {
    std::vector<v1::ProbePointsRequest> good = requests_;
    // Found out by a worker, and when it is accepted.
    requests_[static_cast<std::size_t>(wrong)].set_points_mm(0, std::numeric_limits<double>::infinity());
    std::vector<v1::ProbePointsResponse> responses;
    EXPECT_EQ(failure_of(stream_all(responses)).reason, "POINT_NON_FINITE");
    EXPECT_EQ(responses.size(), static_cast<std::size_t>(wrong));
    requests_ = good;
    requests_[static_cast<std::size_t>(wrong)].set_contour_tolerance_mm(-1);
    responses.clear();
    EXPECT_EQ(failure_of(stream_all(responses)).reason, "TOLERANCE_INVALID");
    EXPECT_EQ(responses.size(), static_cast<std::size_t>(wrong));
    requests_ = good;
  }
}

TEST_F(BatchesAhead, AreCancelledInTheMiddle) {
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  std::thread writer([&] {
    for (int i = 0; stream->Write(requests_[static_cast<std::size_t>(i % 40)]); ++i) {
    }
  });
  v1::ProbePointsResponse response;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(stream->Read(&response));
  context.TryCancel();
  writer.join();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(eventually(
      [this] {
        return server_.server().state().admission.running() == 0 && server_.server().state().scratch.used_bytes() == 0;
      },
      std::chrono::seconds(10)));
}

TEST_F(BatchesAhead, GiveTheirMemoryBackWhenTheClientLags) {
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  std::thread writer([&] {
    for (const v1::ProbePointsRequest& request : requests_) ASSERT_TRUE(stream->Write(request));
  });
  std::vector<v1::ProbePointsResponse> responses(requests_.size());
  for (v1::ProbePointsResponse& response : responses) ASSERT_TRUE(stream->Read(&response));
  writer.join();
  const MemoryBudget& scratch = server_.server().state().scratch;
  EXPECT_TRUE(eventually(
      [&] {
        server_.server().sweep();
        return scratch.used_bytes() == 0;
      },
      std::chrono::seconds(10)));
  v1::ProbePointsRequest again = requests_[1];
  ASSERT_TRUE(stream->Write(again));
  v1::ProbePointsResponse response;
  EXPECT_TRUE(stream->Read(&response)) << "and it goes on";
  EXPECT_EQ(response.locations_size(), 10);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

}  // namespace
}  // namespace ccslice::server
