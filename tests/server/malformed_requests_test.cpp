// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Bytes that no client of the contract sends.

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/sync_stream.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "server/service/limits.h"
#include "server/service/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::string_view_literals;

constexpr std::array kMethods = {"GetServerInfo", "FindMissingMeshes", "UploadMesh",         "GetMesh",
                                 "ListMeshes",    "DeleteMesh",        "PlanSlices",         "SliceRange",
                                 "ProbePoints",   "EvaluatePoints",    "TessellateBoundary", "Preview",
                                 "GetPreparation"};

struct End {
  int answers = 0;
  Failure failure;
};

class MalformedRequests : public testing::Test {
 protected:
  /// Sends these messages, whatever they are, and reads to the end. To a server all methods look like streams.
  End call(const std::string& method, const std::vector<std::string>& messages) {
    const std::string path = "/ccslice.v1.SlicerService/" + method;
    const grpc::internal::RpcMethod rpc(path.c_str(), grpc::internal::RpcMethod::BIDI_STREAMING);
    grpc::ClientContext context;
    const std::unique_ptr<grpc::ClientReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>> stream(
        grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, grpc::ByteBuffer>::Create(server_.channel().get(),
                                                                                              rpc, &context));
    for (const std::string& message : messages) {
      const grpc::Slice slice(message);
      if (!stream->Write(grpc::ByteBuffer(&slice, 1))) break;
    }
    stream->WritesDone();
    End end;
    grpc::ByteBuffer answer;
    while (stream->Read(&answer)) ++end.answers;
    end.failure = failure_of(stream->Finish());
    return end;
  }

  void expect(const End& end, int answers, const std::string& reason) {
    EXPECT_EQ(end.answers, answers);
    EXPECT_EQ(end.failure.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(end.failure.reason, reason);
  }

  TestServer server_;
};

/// Empty sub-messages of a field with this number.
std::string empty_messages(int field, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes += {static_cast<char>(field << 3 | 2), '\0'};
  return bytes;
}

TEST_F(MalformedRequests, EndEveryCallWithTheirReason) {
  for (const char* const method : kMethods) {
    for (const std::string_view bad : {"\x0a\x7f"sv, "\x0f"sv, "\x0a\x05"sv, "\x08\xff\xff\xff"sv}) {
      SCOPED_TRACE(method);
      expect(call(method, {std::string(bad)}), 0, "REQUEST_MALFORMED");
    }
  }
}

TEST_F(MalformedRequests, EndAStreamOfPointsAfterTheAnswersBeforeThem) {
  v1::ProbePointsRequest probe;
  probe.set_mesh_id(server_.upload_good(make_block(1, 10)));
  for (const double x : {1.0, 1.0, 1.0}) probe.add_points_mm(x);
  const std::string good = probe.SerializeAsString();
  expect(call("ProbePoints", {good, "\x0a\x7f", good}), 1, "REQUEST_MALFORMED");
  v1::EvaluatePointsRequest evaluate;
  evaluate.set_mesh_id(probe.mesh_id());
  expect(call("EvaluatePoints", {evaluate.SerializeAsString(), "\x0a\x7f"}), 1, "REQUEST_MALFORMED");
}

TEST_F(MalformedRequests, EndAnUploadAfterItsStart) {
  const std::string bytes = make_block(2, 10).SerializeAsString();
  v1::UploadMeshRequest start, chunk;
  start.mutable_start()->set_mesh_id(mesh_id_of(bytes));
  start.mutable_start()->set_size_bytes(bytes.size());
  chunk.set_chunk(bytes);
  const std::string good = start.SerializeAsString();
  expect(call("UploadMesh", {good, "\x0a\x7f", chunk.SerializeAsString()}), 0, "REQUEST_MALFORMED");
  EXPECT_EQ(call("UploadMesh", {good, chunk.SerializeAsString()}).failure.code, grpc::StatusCode::OK);
}

TEST_F(MalformedRequests, AreRefusedBeforeTheyAreParsedWhereTheyAreTooLarge) {
  for (const char* const method :
       {"GetServerInfo", "FindMissingMeshes", "GetPreparation", "ProbePoints", "TessellateBoundary"}) {
    SCOPED_TRACE(method);
    expect(call(method, {std::string(kMaxRequestBytes + 1, '\x01')}), 0, "BATCH_TOO_LARGE");
  }
  for (const char* const method : {"PlanSlices", "SliceRange"}) {
    SCOPED_TRACE(method);
    expect(call(method, {std::string(kMaxJobRequestBytes + 1, '\x01')}), 0, "BATCH_TOO_LARGE");
  }
}

TEST_F(MalformedRequests, AreRefusedWhereTheyGrowTooMuch) {
  expect(call("SliceRange", {empty_messages(6, 500'000)}), 0, "BATCH_TOO_LARGE");
  expect(call("PlanSlices", {empty_messages(4, 500'000)}), 0, "BATCH_TOO_LARGE");
}

TEST_F(MalformedRequests, AreNotTheLargestJobsThereAre) {
  v1::SliceRangeRequest request = slice_request(server_.upload_good(make_block(1, 10)), 1, 0, 1);
  v1::Printing& printing = *request.mutable_printing();
  for (int region = 0; region < 255; ++region) {
    v1::CellRegionMap& map = *printing.add_cell_region_maps();
    map.set_cell_region("region " + std::to_string(region));
    v1::CurveMap& curve = *map.mutable_map()->mutable_curve();
    for (int i = 0; i < 256; ++i) {
      v1::CurvePoint& point = *curve.add_points();
      point.set_property(i + 1);
      point.set_fraction(0.5);
    }
  }
  ASSERT_GT(request.ByteSizeLong(), 1u << 20);
  const Failure failure = call("SliceRange", {request.SerializeAsString()}).failure;
  EXPECT_NE(failure.reason, "BATCH_TOO_LARGE") << failure.message;
  EXPECT_NE(failure.reason, "REQUEST_MALFORMED") << failure.message;
}

}  // namespace
}  // namespace ccslice::server
