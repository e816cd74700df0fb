// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// SliceRange with every voxel inverted, ProbePoints at the voxels' centres and EvaluatePoints at what those answer
// speak of the same points: they have to say the same.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/meshes/mesh_convert.h"
#include "core/models/models.h"
#include "server/service/base/limits.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::server {
namespace {

constexpr double kOnSurfaceMm = 1e-6;
constexpr double kShareOfRange = 1e-6;

/// Turned, and by turns stretched, mirrored, sheared or moved: |scales| from 1/2 to 2.
Placement random_placement(std::mt19937& random, int kind) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> scale(0.5, 2);
  Placement placement(Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized());
  if (kind % 4 == 0) return placement;
  placement.linear() *= scale(random);
  if (kind % 4 == 2) placement.linear().col(0) *= -1;
  if (kind % 4 == 3) placement.linear() *= (Mat3() << 1, 0.5, 0, 0, 1, 0, 0, -0.3, 0.8).finished();
  placement.translation() = Vec3(normal(random), normal(random), normal(random)) * 20;
  return placement;
}

void set_placement(const Placement& from, v1::Placement& to) {
  to.clear_matrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) to.add_matrix(from(row, column));
  }
}

/// Voxels inside the contours, and their channels as SliceRange has them.
struct Voxels {
  std::vector<Vec3> centres;
  std::vector<float> materials;
};

/// How far the answers are from one another.
struct Agreement {
  std::size_t voxels = 0, not_inside = 0, off_the_solid = 0, unresolved = 0;
  double material = 0;            // Of the channel's range, of points on the solid; float's rounding taken off.
  double material_off = 0;        // Likewise, of points off the solid.
  double evaluated_material = 0;  // Between a probe and its evaluation.
  double position_mm = 0;         // Of an evaluation, from the point, on the solid.
  double residual_mm = 0;         // Between a probe's residual and that distance.
};

class PointAgreement : public ::testing::Test {
 protected:
  Agreement compare(const ControlMesh& mesh, const Placement& placement, std::optional<double> tolerance_mm = {}) {
    v1::UploadMeshResponse uploaded;
    const v1::ControlMesh message = cli::to_proto(mesh);
    EXPECT_TRUE(server_.upload(message, &uploaded).ok());
    summary_ = uploaded.mesh();
    Agreement result;
    const Voxels voxels = slice(placement, tolerance_mm, result);
    for (std::size_t first = 0; first < voxels.centres.size(); first += kMaxPointsPerMessage) {
      compare_batch(voxels, first, placement, tolerance_mm, result);
    }
    return result;
  }

 private:
  /// Three layers of about 24 columns.
  Voxels slice(const Placement& placement, std::optional<double> tolerance_mm, Agreement& result) {
    const v1::Box3& box = summary_.bounding_box();
    const Vec3 sizes(box.max_mm().x() - box.min_mm().x(), box.max_mm().y() - box.min_mm().y(),
                     box.max_mm().z() - box.min_mm().z());
    const double pitch_mm = sizes.maxCoeff() * std::cbrt(std::abs(placement.linear().determinant())) / 24;
    v1::SliceRangeRequest request = slice_request(summary_.mesh_id(), pitch_mm, 0, 1);
    set_placement(placement, placement_of(*request.mutable_job()));
    request.mutable_job()->mutable_tolerances()->set_channel(0);
    if (tolerance_mm) request.mutable_job()->mutable_tolerances()->set_contour_mm(*tolerance_mm);
    request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    v1::PlaneSpec& plane = *request.mutable_job()->add_planes();
    plane.mutable_channels();
    plane.set_encoding(v1::PLANE_ENCODING_RAW);
    Voxels voxels;
    const std::uint32_t layers = server_.slice(request).header.grid().extent().layers();
    for (const std::uint32_t layer : {layers / 5, layers / 2, layers * 4 / 5}) {
      request.set_first_layer(layer);
      const Sliced sliced = server_.slice(request);
      EXPECT_TRUE(sliced.status.ok()) << sliced.status.error_message();
      if (!sliced.status.ok()) break;
      collect(sliced, layer, voxels);
      result.unresolved += sliced.summary.voxels_unresolved();
    }
    return voxels;
  }

  void collect(const Sliced& sliced, std::uint32_t layer, Voxels& voxels) const {
    const v1::Grid& grid = sliced.header.grid();
    const std::uint32_t columns = grid.extent().columns();
    const std::string &bits = sliced.planes.at(layer).at(0), &samples = sliced.planes.at(layer).at(1);
    const auto channels = static_cast<std::size_t>(summary_.channels_size());
    for (std::uint32_t y = 0; y < grid.extent().rows(); ++y) {
      for (std::uint32_t x = 0; x < columns; ++x) {
        if ((bits[std::size_t{y} * ((columns + 7) / 8) + x / 8] >> (7 - x % 8) & 1) == 0) continue;
        voxels.centres.emplace_back(grid.origin_mm().x() + (x + 0.5) * grid.pitch().x_mm(),
                                    grid.origin_mm().y() + (y + 0.5) * grid.pitch().y_mm(),
                                    grid.origin_mm().z() + (layer + 0.5) * grid.pitch().z_mm());
        for (std::size_t c = 0; c < channels; ++c) {
          float value;
          std::memcpy(&value, &samples[sizeof value * ((std::size_t{y} * columns + x) * channels + c)], sizeof value);
          voxels.materials.push_back(value);
        }
      }
    }
  }

  void compare_batch(const Voxels& voxels, std::size_t first, const Placement& placement,
                     std::optional<double> tolerance_mm, Agreement& result) {
    const std::size_t count = std::min<std::size_t>(kMaxPointsPerMessage, voxels.centres.size() - first);
    v1::ProbePointsRequest request;
    request.set_mesh_id(summary_.mesh_id());
    set_placement(placement, *request.mutable_placement());
    if (tolerance_mm) request.set_contour_tolerance_mm(*tolerance_mm);
    for (std::size_t p = first; p < first + count; ++p) {
      for (const double x : voxels.centres[p]) request.add_points_mm(x);
    }
    const auto probed =
        answer<v1::ProbePointsResponse>(request, [&](auto* context) { return server_.stub().ProbePoints(context); });
    v1::EvaluatePointsRequest back;
    back.set_mesh_id(summary_.mesh_id());
    *back.mutable_placement() = request.placement();
    *back.mutable_limit_cells() = probed.limit_cells();
    *back.mutable_uvw() = probed.uvw();
    const auto evaluated =
        answer<v1::EvaluatePointsResponse>(back, [&](auto* context) { return server_.stub().EvaluatePoints(context); });
    for (std::size_t p = 0; p < count; ++p)
      compare_point(voxels, first + p, static_cast<int>(p), probed, evaluated, result);
  }

  void compare_point(const Voxels& voxels, std::size_t voxel, int p, const v1::ProbePointsResponse& probed,
                     const v1::EvaluatePointsResponse& evaluated, Agreement& result) const {
    ++result.voxels;
    result.not_inside += probed.locations(p) == v1::POINT_LOCATION_INSIDE ? 0 : 1;
    if (probed.locations(p) == v1::POINT_LOCATION_OUTSIDE) return;
    const Vec3 position(evaluated.positions_mm(3 * p), evaluated.positions_mm(3 * p + 1),
                        evaluated.positions_mm(3 * p + 2));
    const double distance_mm = (position - voxels.centres[voxel]).norm();
    result.residual_mm = std::max(result.residual_mm, std::abs(distance_mm - probed.residuals_mm(p)));
    const bool off = probed.residuals_mm(p) > kOnSurfaceMm;
    result.off_the_solid += off ? 1 : 0;
    if (!off) result.position_mm = std::max(result.position_mm, distance_mm);
    const int channels = summary_.channels_size();
    for (int c = 0; c < channels; ++c) {
      const double range = summary_.channels(c).max_value() - summary_.channels(c).min_value();
      const double value = probed.channel_values(channels * p + c);
      const double sliced = static_cast<double>(
          voxels.materials[voxel * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)]);
      const double rounding = static_cast<double>(std::numeric_limits<float>::epsilon()) * std::abs(value);
      double& worst = off ? result.material_off : result.material;
      worst = std::max(worst, (std::abs(value - sliced) - rounding) / range);
      result.evaluated_material =
          std::max(result.evaluated_material, std::abs(value - evaluated.channel_values(channels * p + c)) / range);
    }
  }

  template <class Response, class Request, class Begin>
  Response answer(const Request& request, const Begin& begin) {
    grpc::ClientContext context;
    const auto stream = begin(&context);
    Response response;
    EXPECT_TRUE(stream->Write(request));
    EXPECT_TRUE(stream->Read(&response));
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  TestServer server_;
  v1::MeshSummary summary_;
};

/// What holds everywhere.
void expect_agreement(const Agreement& a, const std::string& name) {
  EXPECT_GT(a.voxels, 0u) << name;
  EXPECT_EQ(a.not_inside, 0u) << name;
  EXPECT_LE(a.evaluated_material, 1e-12) << name;
  EXPECT_LE(a.residual_mm, 1e-12) << name;
  EXPECT_LE(a.position_mm, kOnSurfaceMm) << name;
  EXPECT_LE(a.material, kShareOfRange) << name;
  EXPECT_LE(a.material_off, kShareOfRange) << name;
  EXPECT_EQ(a.unresolved, 0u) << name;
}

TEST_F(PointAgreement, SlicesProbesAndEvaluationsSayTheSameOfTinyMeshes) {
  const std::uint32_t seed = 20;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int kind = 0;
  for (const oracle::TinyMesh& tiny : oracle::tiny_meshes()) {
    for (int repeat = 0; repeat < 2; ++repeat) {
      const Agreement a = compare(tiny.mesh, random_placement(random, kind++));
      expect_agreement(a, tiny.name);
      EXPECT_LE(a.off_the_solid, a.voxels / 100) << tiny.name;
    }
  }
}

TEST_F(PointAgreement, SlicesProbesAndEvaluationsSayTheSameOfSamples) {
  const std::uint32_t seed = 21;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::pair<const char*, ControlMesh> samples[] = {
      {"ring", make_ring()}, {"bracket", make_bracket()}, {"box", make_box()}};
  for (const auto& [name, mesh] : samples) {
    for (int kind = 0; kind < 4; ++kind) expect_agreement(compare(mesh, random_placement(random, kind)), name);
  }
}

TEST_F(PointAgreement, VoxelsInsideWideContoursAreInsideForProbesOfTheSameTolerance) {
  const std::uint32_t seed = 22;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::size_t off = 0;
  int kind = 0;
  for (const oracle::TinyMesh& tiny : oracle::tiny_meshes()) {
    const Agreement a = compare(tiny.mesh, random_placement(random, kind++), 0.2);
    expect_agreement(a, tiny.name);
    off += a.off_the_solid;
  }
  EXPECT_GT(off, 0u);
}

TEST_F(PointAgreement, SmallPartsAgreeAsLargeOnesDo) {
  const std::uint32_t seed = 23;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int kind = 0;
  for (const double scale : {0.1, 0.01}) {
    for (const oracle::TinyMesh& tiny : oracle::tiny_meshes()) {
      Placement placement = random_placement(random, kind++);
      placement.prescale(scale);
      expect_agreement(compare(tiny.mesh, placement, 1e-3 * scale), tiny.name + ", scale " + std::to_string(scale));
    }
  }
}

}  // namespace
}  // namespace ccslice::server
