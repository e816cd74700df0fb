// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_stencils.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// In [0,1], often on the irregular place or on a patch's side, and as deep as patches go.
Vec3 somewhere(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1);
  std::uniform_int_distribution<int> kind(0, 3), level(0, 30);
  Vec3 at;
  for (double& t : at) {
    switch (kind(random)) {
      case 0: t = 0; break;
      case 1: t = std::ldexp(1.0, -level(random)); break;
      case 2: t = std::ldexp(u(random), -level(random)); break;
      default: t = u(random);
    }
  }
  return at;
}

/// The cell's parameters of what is at `framed` in its frame.
Vec3 unframed(const Frame& frame, const Vec3& framed) {
  Vec3 uvw;
  for (std::size_t a = 0; a < 3; ++a) {
    const double t = framed[static_cast<Eigen::Index>(a)];
    uvw[frame.axis[a]] = frame.is_mirrored(a) ? 1 - t : t;
  }
  return uvw;
}

std::vector<Lanes> ring_points(const LimitSolid::Data& data, const LimitCell& cell) {
  std::vector<Lanes> points;
  data.for_each_point(cell, [&](std::size_t, std::uint32_t id) {
    points.push_back(Lanes{});
    for (std::size_t d = 0; id != kNone && d < kLanes; ++d) points.back()[d] = data.point(id)[d];
  });
  return points;
}

// The evaluator walks from the ring down to patches, stencils from patches up to the ring.
TEST(LimitStencils, WeighAsTheEvaluatorWalks) {
  std::mt19937 random(9);
  std::size_t line_cells = 0, vertex_cells = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() == 0) continue;
    const LimitSolid::Data& data = solid->data();
    LimitEvaluator evaluator(*solid);
    std::vector<double> channels(solid->channel_count());
    for (LimitCellId c; c < solid->cell_count(); c += 1 + solid->cell_count() / 8) {
      const LimitCell& cell = data.cells[c];
      if (cell.cell_class == CellClass::kRegular) continue;
      ++(cell.cell_class == CellClass::kLine ? line_cells : vertex_cells);
      std::vector<Vec3> places;
      while (places.size() < 3 * kStencilStrip - 5) places.push_back(somewhere(random));
      places[3] = places[7] = Vec3::Zero();
      const LimitStencils stencils(data, cell, places);
      stencils.apply(ring_points(data, cell).data(), [&](std::size_t strip, const auto& first, const auto& last) {
        for (std::size_t n = strip * kStencilStrip; n < std::min(places.size(), (strip + 1) * kStencilStrip); ++n) {
          const auto& half = n % kStencilStrip < kLanes ? first : last;
          const Vec3 expected = evaluator.geo_and_mat({c, unframed(cell.frame, places[n])}, channels);
          for (std::size_t d = 0; d < 3; ++d) {
            EXPECT_NEAR(half[d][n % kLanes], expected[static_cast<Eigen::Index>(d)], 1e-11) << name << " " << c;
          }
          EXPECT_NEAR(half[3][n % kLanes], channels[0], 1e-12) << name << " " << c;
        }
      });
    }
  }
  EXPECT_GT(line_cells, 20u);
  EXPECT_GT(vertex_cells, 20u);
}

}  // namespace
}  // namespace ccslice
