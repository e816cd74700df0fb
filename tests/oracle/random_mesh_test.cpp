// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Consistency on random meshes: evaluation against brute force, round trips, voxels. CCSLICE_RANDOM_SEED=n tries
// others.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "core/inversion/point_inverter.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/descents.h"
#include "tests/oracle/slicing.h"
#include "tests/support/random_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr int kMeshesPerKind = 10;

std::uint32_t first_seed() {
  const char* text = std::getenv("CCSLICE_RANDOM_SEED");
  return text ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : 1;
}

void expect_limit_agrees(const Subject& subject, std::mt19937& random) {
  LimitEvaluator evaluator(subject.solid());
  WorstError worst;
  const std::uint32_t stride = subject.solid().cell_count() / 25 + 1;
  for (LimitCellId cell; cell < subject.solid().cell_count(); cell += stride) {
    for (int i = 0; i < 3; ++i) {
      compare_on_descent(subject, evaluator, cell, random_descent(random, 8, i == 0 && cell % 5 == 0), random, worst);
    }
  }
  EXPECT_LT(worst.position, 1e-9) << worst.position_at;
  EXPECT_LT(worst.channel, 1e-9) << worst.channel_at;
}

void expect_round_trips(const Subject& subject, std::mt19937& random) {
  PointInverter inverter(subject.solid());
  for (int i = 0; i < 40; ++i) {
    CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % subject.solid().cell_count())}, Vec3::Zero()};
    for (int d = 0; d < 3; ++d) {
      const double x = std::exp2(-std::uniform_real_distribution<double>(0.5, 8)(random));
      at.uvw[d] = random() % 2 ? x : 1 - x;
    }
    const Vec3 point = inverter.evaluator().geo(at);
    const auto found = inverter.invert(point);
    ASSERT_TRUE(found) << to_text(at);
    EXPECT_LT((inverter.evaluator().geo(found->at) - point).norm(), 3e-6) << to_text(at);
  }
}

void expect_voxels_at_their_places(const Subject& subject) {
  ControlMesh graded = subject.control();
  graded.channel_names.clear();
  grade_by_coordinates(graded);
  const Subject by_coordinates(graded);
  const SliceJob job = float_job(by_coordinates, 36);
  const Layer layer = LayerSlicer(by_coordinates.shared_solid(), job).slice(job.grid.extent.layers * 2 / 5, {});
  const LayerView view(job, layer);
  EXPECT_EQ(layer.stats.voxels_unresolved, 0u);
  for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
      if (!view.inside(x, y)) continue;
      const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
      EXPECT_LT((place - view.centre(x, y)).norm(), 1e-3 + job.contour_tolerance_mm) << x << " " << y;
    }
  }
}

class RandomMeshes : public testing::TestWithParam<RandomKind> {};

TEST_P(RandomMeshes, AgreeWithTheOracles) {
  int valid = 0;
  std::uint32_t seed = first_seed();
  for (; valid < kMeshesPerKind; ++seed) {
    ControlMesh mesh;
    try {
      mesh = random_mesh(GetParam(), seed);
      validate(mesh);
    } catch (const std::exception&) {
      continue;  // Pieces that touch at a vertex or an edge only.
    }
    ++valid;
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Subject subject(mesh);
    std::mt19937 random(seed);
    expect_limit_agrees(subject, random);
    expect_round_trips(subject, random);
    expect_voxels_at_their_places(subject);
  }
  EXPECT_LT(seed, first_seed() + 20 * kMeshesPerKind);
}

std::string kind_name(RandomKind kind) {
  switch (kind) {
    case RandomKind::kPolycube: return "polycube";
    case RandomKind::kHexStar: return "hex_star";
    case RandomKind::kTetStar: return "tet_star";
    default: return "terrain";
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, RandomMeshes,
                         testing::Values(RandomKind::kPolycube, RandomKind::kHexStar, RandomKind::kTetStar,
                                         RandomKind::kTerrain),
                         [](const auto& info) { return kind_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
