// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// What every call that computes refuses alike: fields of a newer contract, and degenerate placements.

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "server/rpc/calls/unknown_fields.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

void add_unknown(google::protobuf::Message& message, int number) {
  message.GetReflection()->MutableUnknownFields(&message)->AddVarint(number, 1);
}

constexpr std::string_view kPlacement = "placement";

class EveryCall : public ::testing::Test {
 protected:
  using Spoil = std::function<void(google::protobuf::Message& request, v1::Placement& placement)>;

  /// The failures of all calls with a placement, by call.
  std::vector<std::pair<std::string, Failure>> failures(const Spoil& spoil) {
    return {{"SliceRange", slice(spoil)},
            {"PlanSlices", plan(spoil)},
            {"ProbePoints", probe(spoil)},
            {"EvaluatePoints", evaluate(spoil)},
            {"TessellateBoundary", tessellate(spoil)}};
  }

  /// `field`: that of calls with a placement of their own; those with a job have it in the job's part.
  void expect(const Spoil& spoil, const std::string& reason, const std::string& field) {
    for (const auto& [call, failure] : failures(spoil)) {
      const bool has_job = (call == "SliceRange" || call == "PlanSlices") && field.starts_with(kPlacement);
      const std::string own = has_job ? "job.parts[0].placements[0]" + field.substr(kPlacement.size()) : field;
      EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT) << call;
      EXPECT_EQ(failure.reason, reason) << call << ": " << failure.message;
      EXPECT_EQ(failure.field, own) << call << ": " << failure.message;
    }
  }

  void expect_placement(const std::vector<double>& matrix, const std::string& reason, const std::string& field) {
    const auto set = [&](google::protobuf::Message&, v1::Placement& placement) {
      placement.mutable_matrix()->Assign(matrix.begin(), matrix.end());
    };
    expect(set, reason, field);
  }

 private:
  Failure slice(const Spoil& spoil) {
    v1::SliceRangeRequest request = slice_request(id_, 1, 0, 1);
    spoil(request, placement_of(*request.mutable_job()));
    return server_.slice_failure(request);
  }

  Failure plan(const Spoil& spoil) {
    v1::PlanSlicesRequest request;
    part_of(*request.mutable_job()).set_mesh_id(id_);
    *request.mutable_job()->mutable_grid() = slice_request(id_, 1, 0, 1).job().grid();
    spoil(request, placement_of(*request.mutable_job()));
    grpc::ClientContext context;
    v1::PlanSlicesResponse response;
    return failure_of(server_.stub().PlanSlices(&context, request, &response));
  }

  Failure probe(const Spoil& spoil) {
    v1::ProbePointsRequest request;
    request.set_mesh_id(id_);
    spoil(request, *request.mutable_placement());
    grpc::ClientContext context;
    const auto stream = server_.stub().ProbePoints(&context);
    stream->WriteLast(request, grpc::WriteOptions());
    return failure_of(stream->Finish());
  }

  Failure evaluate(const Spoil& spoil) {
    v1::EvaluatePointsRequest request;
    request.set_mesh_id(id_);
    spoil(request, *request.mutable_placement());
    grpc::ClientContext context;
    const auto stream = server_.stub().EvaluatePoints(&context);
    stream->WriteLast(request, grpc::WriteOptions());
    return failure_of(stream->Finish());
  }

  Failure tessellate(const Spoil& spoil) {
    v1::TessellateBoundaryRequest request;
    request.set_mesh_id(id_);
    spoil(request, *request.mutable_placement());
    grpc::ClientContext context;
    const auto reader = server_.stub().TessellateBoundary(&context, request);
    v1::TessellateBoundaryResponse response;
    while (reader->Read(&response)) {
    }
    return failure_of(reader->Finish());
  }

  TestServer server_;
  const std::string id_ = server_.upload_good(make_block(1, 10));
};

TEST_F(EveryCall, RefusesFieldsOfANewerContract) {
  expect([](google::protobuf::Message& request, v1::Placement&) { add_unknown(request, 18); }, "REQUEST_UNKNOWN_FIELD",
         "18");
  expect([](google::protobuf::Message&, v1::Placement& placement) { add_unknown(placement, 2); },
         "REQUEST_UNKNOWN_FIELD", "placement.2");
}

TEST_F(EveryCall, RefusesDegeneratePlacements) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const auto scaled = [](double s) { return std::vector<double>{s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0}; };
  for (const double scale : {1e-200, 1e-7, 1e7, 1e300, 1e308}) {
    expect_placement(scaled(scale), "PLACEMENT_OUT_OF_RANGE", "placement.matrix");
  }
  expect_placement(scaled(0), "PLACEMENT_SINGULAR", "placement.matrix");
  expect_placement({1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0}, "PLACEMENT_SINGULAR", "placement.matrix");
  for (const double number : {nan, infinity, -infinity}) {
    expect_placement({1, 0, 0, 0, 0, 1, number, 0, 0, 0, 1, 0}, "PLACEMENT_NON_FINITE", "placement.matrix[6]");
  }
  for (const double far : {1e8, -1e308}) {
    expect_placement({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, far}, "PLACEMENT_OUT_OF_RANGE", "placement.matrix[11]");
  }
  expect_placement({1, 0, 0, 9'999'999, 0, 1, 0, 0, 0, 0, 1, 0}, "PLACEMENT_OUT_OF_RANGE", "placement");
  expect_placement({1, 2, 3}, "REQUEST_MALFORMED", "placement.matrix");
}

TEST(FirstUnknownField, IsFoundAtAnyDepth) {
  v1::SliceRangeRequest request = slice_request("x", 1, 0, 1);
  EXPECT_EQ(first_unknown_field(request), "");
  request.mutable_job()->add_planes()->mutable_channel()->set_name("x");
  add_unknown(*request.mutable_job()->mutable_planes(1)->mutable_channel(), 5);
  EXPECT_EQ(first_unknown_field(request), "job.planes[1].channel.5");
  add_unknown(*request.mutable_job()->mutable_grid()->mutable_pitch(), 4);
  EXPECT_EQ(first_unknown_field(request), "job.grid.pitch.4");
  add_unknown(request, 18);
  EXPECT_EQ(first_unknown_field(request), "18");
}

}  // namespace
}  // namespace ccslice::server
