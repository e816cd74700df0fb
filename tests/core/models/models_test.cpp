// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/models/models.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "core/mesh/validate.h"

namespace ccslice {
namespace {

/// Limit radius at parameter t in [0,1] between two knots of the closed uniform cubic B-spline round the ring.
double ring_limit_radius(double control_radius, int cells_round, double t) {
  const double s = 1 - t;
  const double weights[4] = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
                             t * t * t / 6};
  double x = 0, y = 0;
  for (int i = 0; i < 4; ++i) {
    const double angle = (i - 1) * 2 * std::numbers::pi / cells_round;
    x += weights[i] * control_radius * std::cos(angle);
    y += weights[i] * control_radius * std::sin(angle);
  }
  return std::hypot(x, y);
}

/// Area inside the closed B-spline, by Simpson's rule on the radius (the parameter's angle is uniform to 1e-6).
double ring_limit_area(double control_radius, int cells_round) {
  constexpr int kSteps = 2000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double radius = ring_limit_radius(control_radius, cells_round, (i + 0.5) / kSteps);
    sum += radius * radius;
  }
  return std::numbers::pi * sum / kSteps;
}

double control_radius(const ControlMesh& mesh, bool outer) {
  double found = outer ? 0 : 1e9;
  for (const Vec3& p : mesh.positions) {
    const double radius = std::hypot(p.x(), p.y());
    found = outer ? std::max(found, radius) : std::min(found, radius);
  }
  return found;
}

TEST(Ring, HasTheSizeOfThePapersRing) {
  const ControlMesh mesh = make_ring();
  EXPECT_EQ(mesh.cell_count(), 512u);
  EXPECT_EQ(mesh.vertex_count(), 800u);
  EXPECT_EQ(mesh.sharp_edges.size(), 128u);
  const double extent = 2 * ring_limit_radius(control_radius(mesh, true), 32, 0);
  EXPECT_NEAR(extent, 83.53, 1e-12);
  EXPECT_EQ(std::floor(extent / 0.0423 + 0.5), 1975);
  EXPECT_EQ(std::floor(extent / 0.0846 + 0.5), 987);
  EXPECT_EQ(std::floor(17.28 / 0.03 + 0.5), 576);
}

TEST(Ring, HasAbout507MillionVoxelsInside) {
  const ControlMesh mesh = make_ring();
  const double area =
      ring_limit_area(control_radius(mesh, true), 32) - ring_limit_area(control_radius(mesh, false), 32);
  EXPECT_NEAR(area * 17.28 / (0.0423 * 0.0846 * 0.03), 507e6, 0.5e6);
}

TEST(Ring, IsGradedFromTheInnerToTheOuterRadius) {
  const ControlMesh mesh = make_ring();
  const double inner = control_radius(mesh, false), outer = control_radius(mesh, true);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const double radius = std::hypot(mesh.positions[v].x(), mesh.positions[v].y());
    EXPECT_NEAR(mesh.channel_values[v], (radius - inner) / (outer - inner), 1e-6);
  }
}

TEST(Models, AreValidAndNotMirrored) {
  for (const SampleModel& model : sample_models()) {
    ControlMesh mesh = model.make();
    const std::vector<std::uint32_t> corners = mesh.cell_vertices;
    EXPECT_NO_THROW(validate(mesh)) << model.name;
    EXPECT_EQ(mesh.cell_vertices, corners) << model.name;
  }
}

TEST(Models, AreFoundByName) {
  ASSERT_NE(find_sample_model("ring"), nullptr);
  EXPECT_EQ(find_sample_model("ring")->make().cell_count(), 512u);
  EXPECT_EQ(find_sample_model("rings"), nullptr);
}

TEST(Box, HasTwelveSharpEdges) {
  const ControlMesh mesh = make_box();
  EXPECT_EQ(mesh.cell_count(), 48u);
  EXPECT_EQ(mesh.sharp_edges.size(), 4u * (6 + 4 + 2));
  std::set<std::array<std::uint32_t, 2>> distinct(mesh.sharp_edges.begin(), mesh.sharp_edges.end());
  EXPECT_EQ(distinct.size(), mesh.sharp_edges.size());
}

}  // namespace
}  // namespace ccslice
