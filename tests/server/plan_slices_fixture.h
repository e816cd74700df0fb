// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Plans of a server, for a box of 10 mm unless a test asks for another mesh.

#pragma once

#include <gtest/gtest.h>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {

class PlanSlices : public ::testing::Test {
 protected:
  PlanSlices() {
    part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_box(2, 10)));
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.1);
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(0.2);
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(0.5);
  }

  grpc::Status plan() {
    grpc::ClientContext context;
    return server_.stub().PlanSlices(&context, request_, &response_);
  }
  Failure failure() { return failure_of(plan()); }
  bool warns_of(v1::PlanWarningKind kind) {
    const grpc::Status status = plan();
    EXPECT_TRUE(status.ok()) << status.error_message();
    for (const v1::PlanWarning& warning : response_.warnings()) {
      if (warning.kind() == kind) return !warning.message().empty();
    }
    return false;
  }

  TestServer server_;
  v1::PlanSlicesRequest request_;
  v1::PlanSlicesResponse response_;
};

}  // namespace ccslice::server
