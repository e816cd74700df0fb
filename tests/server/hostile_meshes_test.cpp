// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes that are as bad to prepare as small ones get: prepared within what is told, stopped at once, and no harm to
// others.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

struct HostileMesh {
  const char* name;
  v1::ControlMesh (*make)(std::uint32_t);
  std::uint32_t size;
};

class HostileMeshes : public ::testing::TestWithParam<HostileMesh> {
 protected:
  static ServerOptions roomy() {
    ServerOptions options = test_options();
    options.preparation_budget_bytes = options.cache_bytes = 512 << 20;
    return options;
  }
  ServiceState& state() { return server_.server().state(); }
  static double side_mm(const v1::ControlMesh& mesh) {
    return *std::max_element(mesh.positions_mm().begin(), mesh.positions_mm().end());
  }
  v1::SliceRangeRequest one_layer(const std::string& id) const { return slice_request(id, side_mm(mesh_) / 300, 0, 1); }

  TestServer server_{roomy()};
  const v1::ControlMesh mesh_ = GetParam().make(GetParam().size);
};
INSTANTIATE_TEST_SUITE_P(Of, HostileMeshes,
                         ::testing::Values(HostileMesh{"OverlappingBoxes", &make_overlapping_boxes, 5000},
                                           HostileMesh{"AComb", &make_comb, 3000}),
                         [](const auto& mesh) { return mesh.param.name; });

TEST_P(HostileMeshes, AreStoppedAtOnceAndLeaveNothing) {
  const std::string bytes = mesh_.SerializeAsString(), id = mesh_id_of(bytes);
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server_.stub().UploadMesh(&context, &response);
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id(id);
  message.mutable_start()->set_size_bytes(bytes.size());
  ASSERT_TRUE(writer->Write(message));
  for (std::size_t at = 0; at < bytes.size(); at += 1 << 20) {
    message.set_chunk(bytes.substr(at, 1 << 20));
    ASSERT_TRUE(writer->Write(message));
  }
  writer->WritesDone();
  ASSERT_TRUE(eventually([&] { return state().cache.preparation(id).has_value(); }, 20s));
  std::this_thread::sleep_for(300ms);
  ASSERT_TRUE(state().cache.preparation(id).has_value()) << "it takes longer";
  context.TryCancel();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(eventually([&] { return !state().cache.preparation(id) && state().preparations.used_bytes() == 0; }, 5s));
  state().executor.wait_idle();
  EXPECT_EQ(state().cache.use().meshes, 0u);
}

TEST_P(HostileMeshes, ArePreparedWithinWhatIsToldBesideOthers) {
  const std::string other = server_.upload_good(make_box(2, 10));
  const std::size_t before = resident_bytes();
  std::atomic<bool> is_over = false;
  std::atomic<int> served = 0;
  std::thread others([&] {
    while (!is_over) {
      if (!server_.slice(slice_request(other, 0.1, 0, 1)).status.ok()) return;
      ++served;
    }
  });
  v1::UploadMeshResponse response;
  const grpc::Status status = server_.upload(mesh_, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  // All parts and walls in one layer, of as little memory: what that takes is told.
  const Failure sliced = server_.slice_failure(one_layer(response.mesh().mesh_id()));
  is_over = true;
  others.join();
  EXPECT_EQ(sliced.reason, "JOB_EXCEEDS_MEMORY") << sliced.message;
  EXPECT_NE(sliced.message.find("--scratch-budget-bytes"), std::string::npos) << sliced.message;
  EXPECT_GT(served, 20);
  if (!kKeepsFreedMemory) {
    EXPECT_LT(resident_bytes(), before + state().options.preparation_budget_bytes);
  }
}

/// The figure comes before any work.
TEST_P(HostileMeshes, AreRefusedByAServerWithoutTheMemory) {
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 8 << 20;
  TestServer small(options);
  const Failure failure = failure_of(small.upload(mesh_));
  EXPECT_EQ(failure.reason, "MESH_EXCEEDS_MEMORY");
  EXPECT_NE(failure.message.find("--preparation-budget-bytes"), std::string::npos) << failure.message;
}

}  // namespace
}  // namespace ccslice::server
