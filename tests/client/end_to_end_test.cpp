// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The client library against a real server in this process: what is computed, and what happens when things break.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/placement.h"
#include "client/client.h"
#include "core/models/models.h"
#include "server/rpc/server/server.h"
#include "server/service/base/logging.h"
#include "tests/client/cutting_proxy.h"
#include "tests/client/local_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::client {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr RetryPolicy kQuick{.max_attempts = 8, .first_pause = milliseconds(20), .longest_pause = milliseconds(200)};

v1::SliceRangeRequest job(const std::string& mesh_id, double x_mm, double y_mm, double z_mm) {
  v1::SliceRangeRequest request;
  part_of(*request.mutable_job()).set_mesh_id(mesh_id);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(x_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(y_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(z_mm);
  return request;
}

void add_planes(v1::SliceRangeRequest& request, const std::string& channel) {
  request.mutable_job()->add_planes()->mutable_occupancy();
  v1::PlaneSpec& plane = *request.mutable_job()->add_planes();
  plane.mutable_channel()->set_name(channel);
  plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
}

/// Calls visit(x, y, z, value) for every voxel inside.
template <typename Visit>
void for_each_inside(const v1::Grid& grid, const Layer& layer, const Visit& visit) {
  const std::size_t columns = grid.extent().columns(), stride = (columns + 7) / 8;
  for (std::size_t row = 0; row < grid.extent().rows(); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      if (!(layer.planes[0].samples[row * stride + column / 8] >> (7 - column % 8) & 1)) continue;
      float value = 0;
      std::memcpy(&value, &layer.planes[1].samples[4 * (row * columns + column)], sizeof(value));
      visit(grid.origin_mm().x() + (static_cast<double>(column) + 0.5) * grid.pitch().x_mm(),
            grid.origin_mm().y() + (static_cast<double>(row) + 0.5) * grid.pitch().y_mm(), layer.z_mm, value);
    }
  }
}

class EndToEnd : public testing::Test {
 protected:
  EndToEnd() {
    server::set_up_logging(server::LogLevel::kWarning, server::LogFormat::kText);
    start("127.0.0.1:0");
  }

  void start(const std::string& address) { server_ = std::make_unique<server::Server>(local_server_options(address)); }
  int port() const { return std::stoi(server_->address().substr(server_->address().rfind(':') + 1)); }

  std::string upload(Client& client, const ControlMesh& mesh) {
    const auto bytes = std::make_shared<const MeshBytes>(cli::to_proto(mesh));
    client.ensure_uploaded(bytes);
    return bytes->id();
  }
  v1::PlanSlicesResponse plan(Client& client, const v1::SliceRangeRequest& request) {
    v1::PlanSlicesRequest plan;
    *plan.mutable_job() = request.job();
    return client.plan(plan);
  }
  /// Everything a job delivers, layer by layer.
  std::vector<std::string> bytes_of(Client& client, const v1::SliceRangeRequest& request,
                                    const std::function<void(std::uint32_t)>& after_layer = {}) {
    std::vector<std::string> layers;
    outcome_ = client.slice(request, [&](const v1::SliceHeader&, const Layer& layer) {
      EXPECT_EQ(layer.index, request.first_layer() + layers.size());
      std::string& bytes = layers.emplace_back();
      for (const Plane& plane : layer.planes) bytes += plane.samples;
      if (after_layer) after_layer(layer.index);
    });
    return layers;
  }

  std::unique_ptr<server::Server> server_;
  SliceOutcome outcome_;
};

TEST_F(EndToEnd, TheRingHasTheGridOfThePaper) {
  Client client({server_->address(), kQuick});
  const std::string id = upload(client, make_ring());
  EXPECT_EQ(client.mesh_summary(id).regular_cells(), 512u);
  const v1::PlanSlicesResponse answer = plan(client, job(id, 0.0423, 0.0846, 0.03));
  EXPECT_EQ(answer.grid().extent().columns(), 1975u);
  EXPECT_EQ(answer.grid().extent().rows(), 987u);
  EXPECT_EQ(answer.layer_count(), 576u);
}

TEST_F(EndToEnd, TheRingIsRoundAndGraded) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_ring()), 0.5, 0.5, 0.5);
  add_planes(request, "hardness");
  request.set_first_layer(17);
  request.set_layer_count(2);
  std::uint64_t inside = 0;
  outcome_ = client.slice(request, [&](const v1::SliceHeader& header, const Layer& layer) {
    for_each_inside(header.grid(), layer, [&](double x, double y, double, float value) {
      ++inside;
      const double radius = std::hypot(x, y);
      EXPECT_GT(radius, 27.2);
      EXPECT_LT(radius, 41.8);
      EXPECT_NEAR(value, (radius - 27.235) / (41.765 - 27.235), 1e-4);
    });
  });
  EXPECT_EQ(inside, outcome_.voxel_count);
  const double area = std::numbers::pi * (41.765 * 41.765 - 27.235 * 27.235);
  EXPECT_NEAR(static_cast<double>(inside), 2 * area / 0.25, 0.01 * 2 * area / 0.25);
  EXPECT_EQ(outcome_.voxels_unresolved, 0u);
}

TEST_F(EndToEnd, ALinearGradientOnABoxIsReproduced) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_box()), 0.2, 0.4, 0.5);
  add_planes(request, "gradient");
  request.set_layer_count(16);
  std::uint64_t inside = 0;
  outcome_ = client.slice(request, [&](const v1::SliceHeader& header, const Layer& layer) {
    for_each_inside(header.grid(), layer, [&](double x, double, double, float value) {
      ++inside;
      EXPECT_NEAR(value, x / 24, 1e-6);
    });
  });
  EXPECT_EQ(inside, 120u * 40u * 16u);
}

TEST_F(EndToEnd, ARotatedPlacementGivesTheRotatedPart) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_box()), 0.5, 0.5, 0.5);
  add_planes(request, "gradient");
  // Stands the box on its end: x becomes z.
  placement_of(*request.mutable_job()) =
      cli::parse_placement({.scale = "", .rotate = {"y=-90"}, .translate = "0,0,100"});
  const v1::PlanSlicesResponse answer = plan(client, request);
  EXPECT_EQ(answer.grid().extent().columns(), 16u);
  EXPECT_EQ(answer.grid().extent().rows(), 32u);
  ASSERT_EQ(answer.layer_count(), 48u);
  request.set_layer_count(48);
  outcome_ = client.slice(request, [&](const v1::SliceHeader& header, const Layer& layer) {
    EXPECT_EQ(layer.end.voxel_count(), 16u * 32u);
    for_each_inside(header.grid(), layer,
                    [](double, double, double z, float value) { EXPECT_NEAR(value, (z - 100) / 24, 1e-6); });
  });
}

TEST_F(EndToEnd, AnObliquePlacementKeepsVolumeAndGradient) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_box()), 0.25, 0.25, 0.25);
  add_planes(request, "gradient");
  placement_of(*request.mutable_job()) =
      cli::parse_placement({.scale = "", .rotate = {"z=30", "x=40"}, .translate = ""});
  const v1::PlanSlicesResponse answer = plan(client, request);
  request.set_layer_count(answer.layer_count());
  const auto& m = request.job().parts(0).placements(0).matrix();
  outcome_ = client.slice(request, [&](const v1::SliceHeader& header, const Layer& layer) {
    for_each_inside(header.grid(), layer, [&](double x, double y, double z, float value) {
      const double mesh_x = m[0] * x + m[4] * y + m[8] * z;  // The inverse of a rotation.
      EXPECT_NEAR(value, mesh_x / 24, 1e-4);
    });
  });
  const double expected = 24 * 16 * 8 / (0.25 * 0.25 * 0.25);
  EXPECT_NEAR(static_cast<double>(outcome_.voxel_count), expected, 0.005 * expected);
}

TEST_F(EndToEnd, ProbesTheBox) {
  Client client({server_->address(), kQuick});
  const std::string id = upload(client, make_box());
  const auto answers = client.probe(id, {}, {6, 8, 4, 12, 1, 7, 30, 0, 0});
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].locations(0), v1::POINT_LOCATION_INSIDE);
  EXPECT_NEAR(answers[0].channel_values(0), 0.25, 1e-6);
  EXPECT_NEAR(answers[0].channel_values(1), 0.5, 1e-6);
  EXPECT_EQ(answers[0].locations(2), v1::POINT_LOCATION_OUTSIDE);
}

TEST_F(EndToEnd, AMeshThatTheServerLostIsUploadedAgain) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_box()), 0.5, 0.5, 0.5);
  add_planes(request, "gradient");
  request.set_layer_count(4);
  EXPECT_TRUE(client.delete_mesh(request.job().parts(0).mesh_id()));
  EXPECT_EQ(bytes_of(client, request).size(), 4u);
  EXPECT_EQ(outcome_.reuploads, 1);
}

TEST_F(EndToEnd, AServerThatRestartsInTheMiddleChangesNothing) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_ring()), 0.1, 0.1, 0.1);
  add_planes(request, "hardness");
  // Raw and 0.7 MB each, so that the layers to come don't all wait in the connection already when it breaks: gRPC lets
  // some MB go ahead of the reader.
  for (v1::PlaneSpec& plane : *request.mutable_job()->mutable_planes()) plane.set_encoding(v1::PLANE_ENCODING_RAW);
  request.set_layer_count(30);
  const std::vector<std::string> whole = bytes_of(client, request);
  const std::string address = server_->address();
  const std::vector<std::string> broken = bytes_of(client, request, [&](std::uint32_t layer) {
    if (layer != 2) return;
    server_.reset();
    start(address);
  });
  EXPECT_EQ(broken, whole);
  EXPECT_GE(outcome_.resumes, 1);
  EXPECT_EQ(outcome_.reuploads, 1);
}

TEST_F(EndToEnd, AServerThatIsBackIsFoundWithinASecond) {
  Client client(
      {server_->address(), {.max_attempts = 1000, .first_pause = milliseconds(20), .longest_pause = milliseconds(20)}});
  client.server_info();
  const std::string address = server_->address();
  server_.reset();
  std::chrono::steady_clock::time_point back;
  std::thread restart([&] {
    std::this_thread::sleep_for(milliseconds(3000));  // gRPC's own pauses would have grown to several seconds.
    start(address);
    back = std::chrono::steady_clock::now();
  });
  client.server_info();
  const auto found = std::chrono::steady_clock::now();
  restart.join();
  EXPECT_LT(found - back, milliseconds(1500));
}

TEST_F(EndToEnd, AServerThatDropsEachCallIsCalledWithPauses) {
  // Enough for the connection, and not for an answer.
  const CuttingProxy proxy(port(), std::vector<std::size_t>(10'000, 20));
  Client client({proxy.address(), {.patience = milliseconds(2500)}});
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW(client.server_info(), ClientError);
  EXPECT_GT(std::chrono::steady_clock::now() - begin, milliseconds(500)) << "it goes on, too";
  // Mostly some ten; but gRPC calls anew at once what it thinks that no server has seen, sometimes a hundred times.
  EXPECT_LT(proxy.connections(), 500);
}

TEST_F(EndToEnd, BrokenConnectionsChangeNothing) {
  Client direct({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(direct, make_ring()), 0.1, 0.2, 0.2);
  add_planes(request, "hardness");
  for (v1::PlaneSpec& plane : *request.mutable_job()->mutable_planes()) plane.set_encoding(v1::PLANE_ENCODING_RAW);
  request.set_first_layer(10);
  request.set_layer_count(5);
  const std::vector<std::string> whole = bytes_of(direct, request);
  const std::size_t layer_bytes = whole.front().size();
  ASSERT_GT(layer_bytes, 1u << 20);
  CuttingProxy proxy(port(), {layer_bytes * 3 / 2, layer_bytes * 3 / 2, 20});
  Client client({proxy.address(), kQuick});
  EXPECT_EQ(bytes_of(client, request), whole);
  // A client that hasn't read what came before the cut loses it, and has no layer to go on after.
  EXPECT_GE(outcome_.resumes, 1);
  EXPECT_GE(proxy.connections(), 3);
}

TEST_F(EndToEnd, AnUploadSurvivesABrokenConnection) {
  ControlMesh mesh = make_box({.size_mm = Vec3(20, 20, 20), .cells_x = 20, .cells_y = 20, .cells_z = 20});
  CuttingProxy proxy(port(), {100});
  Client client({proxy.address(), kQuick});
  const auto bytes = std::make_shared<const MeshBytes>(cli::to_proto(mesh));
  EXPECT_EQ(client.ensure_uploaded(bytes).mesh.control_cells(), 8000u);
}

TEST_F(EndToEnd, ReasonsOfRefusalsArrive) {
  Client client({server_->address(), kQuick});
  v1::SliceRangeRequest request = job(upload(client, make_box()), 0, 0.5, 0.5);
  add_planes(request, "gradient");
  request.set_layer_count(1);
  const auto reason_of = [&] {
    try {
      bytes_of(client, request);
    } catch (const ClientError& error) {
      return error.reason();
    }
    return std::string("none");
  };
  EXPECT_EQ(reason_of(), "PITCH_INVALID");
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.5);
  request.set_layer_count(1000);
  EXPECT_EQ(reason_of(), "LAYER_RANGE_OUT_OF_BOUNDS");
  request.set_layer_count(1);
  request.mutable_job()->mutable_planes(1)->mutable_channel()->set_name("stiffness");
  EXPECT_EQ(reason_of(), "CHANNEL_UNKNOWN");
}

/// Real meshes, graded along x: whatever the cells are like, the channel is linear in x (see
/// core/mesh_authoring/grade.h), so every voxel's value is known.
class RealMeshesEndToEnd : public EndToEnd, public testing::WithParamInterface<const char*> {};

TEST_P(RealMeshesEndToEnd, AreGradedAlongX) {
  const fs::path path = fs::path(CCSLICE_SHARED_MESHES_DIR) / GetParam();
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path;
  const cli::LoadedMesh loaded = cli::load_mesh({.mesh = path.string(), .grades = {"mix=x"}});
  Box3 box;
  for (const Vec3& position : loaded.mesh.positions) box.extend(position);
  const double size = box.sizes().x();

  Client client({server_->address(), kQuick});
  client.ensure_uploaded(loaded.bytes);
  constexpr double kVoxelsAcross = 120;
  const double pitch = box.sizes().maxCoeff() / kVoxelsAcross;
  v1::SliceRangeRequest request = job(loaded.bytes->id(), pitch, pitch, pitch);
  add_planes(request, "mix");
  const std::uint32_t layers = plan(client, request).layer_count();
  std::uint64_t inside = 0;
  for (const double height : {0.25, 0.5, 0.75}) {
    request.set_first_layer(static_cast<std::uint32_t>(height * layers));
    request.set_layer_count(1);
    outcome_ = client.slice(request, [&](const v1::SliceHeader& header, const Layer& layer) {
      // An inverted point is off by the residual and the contour's tolerance at most.
      const double tolerance = (outcome_.max_residual_mm + 0.002) / size + 1e-6;
      for_each_inside(header.grid(), layer, [&](double x, double, double, float value) {
        ++inside;
        ASSERT_NEAR(value, (x - box.min().x()) / size, tolerance);
      });
      EXPECT_LE(layer.end.statistics().max_residual_mm(), 0.002);
    });
  }
  EXPECT_GT(inside, 500u);
}

INSTANTIATE_TEST_SUITE_P(EndToEnd, RealMeshesEndToEnd,
                         testing::Values("rod.vtk", "fertility_cmu.vtk", "mountwithhole.vtk", "bone_octree.vtk",
                                         "mixed_small.vtk", "screw2.mesh", "joint_limit_folds.vtk"),
                         [](const auto& info) {
                           const std::string name = info.param;
                           return name.substr(0, name.find('.'));
                         });

}  // namespace
}  // namespace ccslice::client
