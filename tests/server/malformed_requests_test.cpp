// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Bytes that no client of the contract sends.

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/sync_stream.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <functional>
#include <future>
#include <string>
#include <string_view>
#include <vector>

#include "core/printing/printing.h"
#include "server/service/base/limits.h"
#include "server/service/meshes/mesh_id.h"
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

/// A field of so many bytes, below 128. `tag`: its number and wire type, as they travel.
std::string field(char tag, const std::string& bytes) { return tag + std::string(1, char(bytes.size())) + bytes; }

/// 2 MiB, less a bit, of a job of empty planes.
std::string growing_request() {
  v1::SliceRangeRequest request;
  for (std::size_t i = 0; i < (kMaxJobRequestBytes - 4096) / 2; ++i) request.mutable_job()->add_planes();
  return request.SerializeAsString();
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

/// 64 MB of the same byte take 64 KB on their way: what they become is bounded by nothing.
TEST(CompressedRequests, AreNotTaken) {
  TestServer server;
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::ListMeshesRequest request;
  request.set_page_token(std::string(64 << 20, 'x'));
  v1::ListMeshesResponse response;
  const grpc::Status status = server.stub().ListMeshes(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << status.error_message();
}

TEST_F(MalformedRequests, AreRefusedWhereTheyGrowTooMuch) {
  const std::string groups = repeated("\x7b\x7c", kMaxRequestBytes / 2);  // Of a field that no request has.
  for (const char* const method : kMethods) {
    SCOPED_TRACE(method);
    const End end = call(method, {groups});
    expect(end, 0, "BATCH_TOO_LARGE");
    EXPECT_TRUE(end.failure.message.starts_with("unpacked, the message takes more than ")) << end.failure.message;
  }
  for (const char* const method : {"GetServerInfo", "FindMissingMeshes", "GetMesh", "ListMeshes", "DeleteMesh"}) {
    SCOPED_TRACE(method);
    expect(call(method, {repeated("\x7b\x7c", 8'000)}), 0, "BATCH_TOO_LARGE");
  }
  expect(call("SliceRange", {growing_request()}), 0, "BATCH_TOO_LARGE");
  expect(call("PlanSlices", {growing_request()}), 0, "BATCH_TOO_LARGE");
}

TEST_F(MalformedRequests, ThatGrowKeepNobodyElseFromSlicing) {
  const std::string id = server_.upload_good(make_block(1, 10)), bytes = growing_request();
  std::atomic<bool> is_over = false;
  std::vector<std::future<int>> growing;
  for (int i = 0; i < 8; ++i) {
    growing.push_back(std::async(std::launch::async, [&] {
      int refused = 0;
      while (!is_over) refused += call("SliceRange", {bytes}).failure.reason == "BATCH_TOO_LARGE";
      return refused;
    }));
  }
  for (int i = 0; i < 50; ++i) {
    const Failure failure = server_.slice_failure(slice_request(id, 1, 0, 1));
    EXPECT_EQ(failure.code, grpc::StatusCode::OK) << failure.message;
  }
  is_over = true;
  for (std::future<int>& each : growing) EXPECT_GT(each.get(), 0);
}

TEST_F(MalformedRequests, AreNotTheLargestJobsThereAre) {
  const std::string id = server_.upload_good(make_block(1, 10)), name(64, 'm');
  const auto expect_parsed = [&](std::size_t least_bytes, const std::function<void(v1::MaterialMap&)>& fill) {
    v1::SliceRangeRequest request = slice_request(id, 1, 0, 1);
    for (int region = 0; region < 255; ++region) {
      v1::CellRegionMap& map = *request.mutable_job()->mutable_printing()->add_cell_region_maps();
      map.set_cell_region("region " + std::to_string(region) + std::string(240, 'r'));
      fill(*map.mutable_map());
    }
    ASSERT_GT(request.ByteSizeLong(), least_bytes);
    const Failure failure = call("SliceRange", {request.SerializeAsString()}).failure;
    EXPECT_NE(failure.reason, "BATCH_TOO_LARGE") << failure.message;
    EXPECT_NE(failure.reason, "REQUEST_MALFORMED") << failure.message;
  };
  expect_parsed(1'300'000, [](v1::MaterialMap& map) {
    for (std::size_t i = 0; i < kMaxCurvePoints; ++i) {
      v1::CalibrationPoint& point = *map.mutable_calibration()->add_points();
      point.set_property(static_cast<double>(i + 1));
      point.set_fraction(0.5);
    }
  });
  expect_parsed(1'200'000, [&](v1::MaterialMap& map) {
    for (std::size_t i = 0; i < kMaxBlendStops; ++i) {
      v1::BlendStop& stop = *map.mutable_blend()->add_stops();
      stop.set_value(static_cast<double>(i + 1));
      stop.set_material(name);
    }
  });
  expect_parsed(300'000, [&](v1::MaterialMap& map) {
    for (std::size_t i = 0; i < kMaxPrintMaterials; ++i) {
      v1::DirectShare& share = *map.mutable_direct()->add_shares();
      share.set_channel(name);
      share.set_material(name);
    }
  });
}

/// Requests as they were before there was a SliceJob, byte by byte.
class OldRequests : public MalformedRequests {
 protected:
  void expect(const std::string& method, const std::string& bytes, const std::string& reason,
              const std::string& path = "") {
    const End end = call(method, {bytes});
    MalformedRequests::expect(end, 0, reason);
    EXPECT_EQ(end.failure.field, path) << end.failure.message;
  }

  const std::string one_ = std::string("\0\0\0\0\0\0\xf0\x3f", 8);  // A double.
  const std::string pitch_ = "\x09" + one_ + "\x11" + one_ + "\x19" + one_;
  const std::string grid_ = field('\x0a', pitch_);
  const std::string id_ = server_.upload_good(make_block(1, 10));
};

TEST_F(OldRequests, OfJobsAreRefused) {
  const std::string occupancy("\x0a\0", 2);
  const std::string mesh = field('\x0a', id_), grid = field('\x1a', grid_);
  // Mesh, grid, layer_count, planes; and mesh, grid, planes.
  expect("SliceRange", mesh + grid + "\x28\x01" + field('\x32', occupancy), "REQUEST_MALFORMED");
  expect("PlanSlices", mesh + grid + field('\x22', occupancy), "REQUEST_MALFORMED");
  expect("SliceRange", grid + "\x28\x01" + field('\x32', occupancy), "REQUEST_UNKNOWN_FIELD", "3");
  expect("PlanSlices", grid, "REQUEST_UNKNOWN_FIELD", "3");
  expect("PlanSlices", "", "PARTS_MISSING", "job.parts");
}

TEST_F(OldRequests, OfJobsNeverParseWhateverTheirMesh) {
  for (int i = 0; i < 1000; ++i) {
    const std::string id = mesh_id_of(std::to_string(i));
    EXPECT_FALSE(v1::SliceJob().ParseFromString(id)) << id;
  }
}

TEST_F(OldRequests, OfLayersToBeShownAreRefused) {
  const auto request = [&](const std::string& layer) {
    const std::string plane = field('\x12', layer), occupancy("\x0a\0", 2);
    return "\x08\x01" + field('\x12', id_) + field('\x22', plane) + field('\x3a', occupancy);
  };
  const std::string origin = field('\x12', pitch_), printer = field('\x12', field('\x0a', "j750-hq"));
  // Grid and layer; a grid without a pitch; a printer instead; nothing of these.
  expect("Preview", request(field('\x0a', grid_) + "\x18\x02"), "REQUEST_UNKNOWN_FIELD", "plane.layer.3");
  expect("Preview", request(field('\x0a', grid_)), "REQUEST_UNKNOWN_FIELD", "plane.layer.job.parts[0].1");
  expect("Preview", request(field('\x0a', origin)), "REQUEST_UNKNOWN_FIELD", "plane.layer.job.grid.1");
  expect("Preview", request(printer), "REQUEST_UNKNOWN_FIELD", "plane.layer.2");
  expect("Preview", request(""), "PARTS_MISSING", "plane.layer.job.parts");
}

}  // namespace
}  // namespace ccslice::server
