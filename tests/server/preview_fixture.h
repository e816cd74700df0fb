// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A server with a mesh, and previews of it.

#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {

/// A picture put together from its parts.
struct Shown {
  std::uint64_t number = 0;
  v1::PreviewStage stage = v1::PREVIEW_STAGE_UNSPECIFIED;
  v1::PreviewHeader header;
  std::string bytes;
  std::vector<v1::PreviewOutline> outlines;
};

class Preview : public testing::Test {
 protected:
  using Stream = grpc::ClientReaderWriter<v1::PreviewRequest, v1::PreviewResponse>;

  /// The middle of a cube of 10 mm, seen from above, 64 x 64 pixels of 0.2 mm.
  v1::PreviewRequest request(std::uint64_t number) const {
    v1::PreviewRequest request;
    request.set_number(number);
    request.set_mesh_id(id_);
    v1::FreePlane& plane = *request.mutable_plane()->mutable_free();
    plane.mutable_middle_mm()->set_x(5);
    plane.mutable_middle_mm()->set_y(5);
    plane.mutable_middle_mm()->set_z(5);
    plane.mutable_across()->set_x(1);
    plane.mutable_up()->set_y(1);
    plane.set_across_mm_per_pixel(0.2);
    request.set_width(64);
    request.set_height(64);
    request.mutable_content()->mutable_occupancy();
    request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
    return request;
  }

  /// A layer of the cube on a grid of this pitch.
  v1::PreviewRequest layer_request(std::uint64_t number, double pitch_mm, std::uint32_t layer) const {
    v1::PreviewRequest asked = request(number);
    asked.clear_mesh_id();
    asked.clear_width();
    asked.clear_height();
    v1::PreviewLayer& plane = *asked.mutable_plane()->mutable_layer();
    *plane.mutable_job() = slice_request(id_, pitch_mm, 0, 1).job();
    plane.set_layer(layer);
    return asked;
  }

  static std::vector<Shown> read_all(Stream& stream) {
    std::vector<Shown> all;
    v1::PreviewResponse message;
    bool open = false;
    while (stream.Read(&message)) {
      if (message.has_header()) {
        EXPECT_FALSE(open);
        all.push_back({message.number(), message.stage(), message.header(), "", {}});
      }
      EXPECT_LE(message.ByteSizeLong(), (1u << 20) + 1000);
      all.back().bytes += message.picture();
      for (const v1::PreviewOutline& outline : message.outlines()) all.back().outlines.push_back(outline);
      open = !message.last();
      if (!open) {
        EXPECT_EQ(all.back().bytes.size(), all.back().header.picture_bytes());
      }
    }
    EXPECT_FALSE(open);
    return all;
  }

  /// Sends the requests at once; what comes of them.
  std::vector<Shown> shown(const std::vector<v1::PreviewRequest>& requests, grpc::Status* status = nullptr) {
    grpc::ClientContext context;
    const auto stream = server_.stub().Preview(&context);
    for (const v1::PreviewRequest& request : requests) stream->Write(request);
    stream->WritesDone();
    std::vector<Shown> all = read_all(*stream);
    const grpc::Status end = stream->Finish();
    if (status != nullptr) {
      *status = end;
    } else {
      EXPECT_TRUE(end.ok()) << end.error_message();
    }
    return all;
  }

  Failure failure(const v1::PreviewRequest& request) {
    grpc::Status status;
    shown({request}, &status);
    return failure_of(status);
  }

  explicit Preview(const ServerOptions& options = test_options()) : server_(options) {}

  TestServer server_;
  const std::string id_ = server_.upload_good(make_box(2, 10));
};

}  // namespace ccslice::server
