// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/material_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/limit/support.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr std::size_t kChannels = 3;  // Two random ones, and one that is linear in x.
constexpr double kOfRange = 1e-6;     // How near values have to be to exact ones.

/// Moved and scaled so that its longest side is `size_mm`, its lowest corner at `origin`.
ControlMesh shrunk(ControlMesh mesh, double size_mm, const Vec3& origin) {
  Box3 box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  const double length = box.sizes().maxCoeff();
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  oracle::add_random_channels(mesh, kChannels, 17);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3 share = (mesh.positions[v] - box.min()) / length;
    mesh.channel_values[kChannels * v + kChannels - 1] = static_cast<float>(share.x());
    mesh.positions[v] = origin + size_mm * share;
  }
  return mesh;
}

/// The parameter of a point, from one that is nearly right, to the last bits. Nothing if it lies in another cell.
std::optional<CellParam> polished(CellParam at, const Vec3& point, LimitEvaluator& evaluator) {
  Vec3 step = Vec3::Zero();
  for (int n = 0; n < 6; ++n) {
    const LimitSample sample = evaluator.sample(at);
    step = sample.jacobian.inverse() * (point - sample.position);
    at.uvw += step;
    if (!((at.uvw.array() > 0).all() && (at.uvw.array() < 1).all())) return std::nullopt;
  }
  return step.norm() < 1e-8 ? std::optional(at) : std::nullopt;
}

struct Compared {
  std::size_t points = 0;
  double worst = 0;  // Share of a channel's range.
};

void compare(const LimitSolid& solid, LimitEvaluator& evaluator, const CellParam& at, const Vec3& point,
             std::span<const double> values, Compared& compared) {
  const std::optional<CellParam> exact = polished(at, point, evaluator);
  if (!exact) return;
  std::vector<double> expected(kChannels);
  evaluator.mat(*exact, expected);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const ChannelRange& range = solid.summary().channels[c];
    compared.worst = std::max(compared.worst, std::abs(values[c] - expected[c]) / (range.max - range.min));
  }
  ++compared.points;
}

/// Rows through the solid in random directions, and each of their points alone.
Compared compare_rows(const Solid& solid, const Placement& placement, unsigned seed) {
  const auto field = make_material_field(solid, placement, kOutsideMm);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1), direction(-1, 1);
  const Box3 box = bounding_box(*solid, placement);
  Compared compared;
  SolvedRow row;
  std::vector<double> alone(kChannels);
  for (int i = 0; i < 60; ++i) {
    const Vec3 middle = box.min() + box.sizes().cwiseProduct(Vec3(share(random), share(random), share(random)));
    const Vec3 step = 0.02 * box.sizes().cwiseProduct(Vec3(direction(random), direction(random), direction(random)));
    const Vec3 first = middle - 20 * step;
    field->solve_row(first, step, 41, {}, {}, {}, row);
    for (std::uint32_t k = 0; k < 41; ++k) {
      const Vec3 point = first + k * step;
      const auto found = field->invert(point, {});
      if (!found || row.points[k] == RowPoint::kUnresolved) continue;
      const Vec3 in_mesh = placement.inverse() * point;
      compare(*solid, evaluator, found->at, in_mesh, std::span(row.values).subspan(kChannels * k, kChannels), compared);
      field->mat(found->at, alone);
      compare(*solid, evaluator, found->at, in_mesh, alone, compared);
    }
  }
  return compared;
}

void expect_exact(const ControlMesh& mesh, const Placement& placement, const std::string& name) {
  constexpr unsigned kSeed = 4;
  const Compared compared = compare_rows(prepare_solid(mesh), placement, kSeed);
  EXPECT_LT(compared.worst, kOfRange) << name << ", seed " << kSeed;
  EXPECT_GT(compared.points, 500u) << name;
}

TEST(MaterialField, HoldsTheMaterialsOfPartsOfAHundredthOfAMillimetre) {
  for (const char* name : {"sharp_box", "edge_valence_5_inside", "concave_corner", "box_3", "plate_3x3x1"}) {
    expect_exact(shrunk(oracle::tiny_mesh(name), 0.01, Vec3::Zero()), Placement::Identity(), name);
  }
}

// Where doubles are 2e-12 mm apart.
TEST(MaterialField, HoldsThemFarFromTheOrigin) {
  expect_exact(shrunk(oracle::tiny_mesh("sharp_box"), 0.01, Vec3(1e4, -1e4, 1e4)), Placement::Identity(), "far off");
}

TEST(MaterialField, HoldsThemOfPartsThatAPlacementShrinks) {
  Placement placement = Placement::Identity();
  placement.linear() *= 1e-3;
  expect_exact(shrunk(oracle::tiny_mesh("sharp_box"), 10, Vec3::Zero()), placement, "shrunk");
}

// Walls a hundredth of a millimetre thick in a part of ordinary size.
TEST(MaterialField, HoldsTheMaterialsOfThinWalls) {
  ControlMesh mesh = shrunk(oracle::tiny_mesh("sharp_plate"), 40, Vec3::Zero());
  for (Vec3& p : mesh.positions) p.z() *= 1e-3;
  expect_exact(mesh, Placement::Identity(), "wall");
}

}  // namespace
}  // namespace ccslice
