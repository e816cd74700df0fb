// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boundary of the limit against OpenSubdiv's surface, and the boundary's patches and keys against the limit.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "core/limit/boundary_surface.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/surface_view.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1e-6;  // Of the box diagonal: OpenSubdiv's approximation, not ours.
constexpr double kLeastParameter = 0x1p-10;

/// Parameters in [2^-10, 1 - 2^-10], thick near both ends.
double random_parameter(std::mt19937& random) {
  const double depth = std::uniform_real_distribution<double>(1, 10)(random);
  return random() % 2 ? std::exp2(-depth) : 1 - std::exp2(-depth);
}

double worst_against_bfr(const Subject& subject, int samples_a_face, std::string& where) {
  const SurfaceView view(subject);
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(1);
  double worst = 0;
  for (std::uint32_t f = 0; f < view.surface().faces().size(); ++f) {
    for (int i = 0; i < samples_a_face; ++i) {
      const double s = i == 0 ? kLeastParameter : random_parameter(random);
      const double t = i <= 1 ? kLeastParameter : random_parameter(random);
      const CellParam at = view.param(f, s, t);
      const double error = (evaluator.geo(at) - view.surface().position(f, s, t)).norm() / subject.diagonal_mm();
      if (error <= worst) continue;
      worst = error;
      where = to_text(at);
    }
  }
  return worst;
}

class Boundary : public testing::TestWithParam<std::size_t> {};

TEST_P(Boundary, LimitAgreesWithOpenSubdiv) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  std::string where;
  EXPECT_LT(worst_against_bfr(subject, 100, where), kTolerance) << where;
}

Vec3 evaluate(const BezierPatch& patch, double s, double t) {
  const auto weights = [](double x) {
    return Eigen::Vector4d(std::pow(1 - x, 3), 3 * x * (1 - x) * (1 - x), 3 * x * x * (1 - x), x * x * x);
  };
  Vec3 sum = Vec3::Zero();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column)
      sum += weights(t)[row] * weights(s)[column] * patch.b[4 * row + column].head<3>();
  }
  return sum;
}

TEST_P(Boundary, PatchesOfFacesAgreeWithTheLimit) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const BoundarySurface surface(subject.solid());
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  const double tolerance = 1e-11 * subject.diagonal_mm();
  const auto expect_agreement = [&](BoundaryFaceId f, const BezierPatch& patch, const Vec2& corner, double size) {
    const double s = unit(random), t = unit(random);
    const CellParam at = surface.cell_param(f, corner.x() + s * size, corner.y() + t * size);
    EXPECT_LT((evaluate(patch, s, t) - evaluator.geo(at)).norm(), tolerance) << "face " << f << " " << to_text(at);
    EXPECT_TRUE(surface.hull_box(f).exteriorDistance(evaluator.geo(at)) < tolerance);
  };
  for (const BoundaryFaceId f : surface.face_ids()) {
    if (surface.faces()[f].regular) {
      for (int i = 0; i < 4; ++i) expect_agreement(f, surface.regular_patch(f), Vec2::Zero(), 1);
      continue;
    }
    IrregularCorner corner;
    surface.irregular_corner(f, corner);
    std::array<BezierPatch, 3> patches;
    for (int level = 1; level <= 12; ++level) {
      surface.split(corner, patches);
      const double size = std::exp2(-level);
      expect_agreement(f, patches[0], {size, 0}, size);
      expect_agreement(f, patches[1], {0, size}, size);
      expect_agreement(f, patches[2], {size, size}, size);
    }
    EXPECT_LT((surface.corner_position(corner) - evaluator.geo(surface.cell_param(f, 0, 0))).norm(), tolerance);
  }
}

TEST_P(Boundary, KeysAreEqualExactlyWherePlacesAre) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const BoundarySurface surface(subject.solid());
  LimitEvaluator evaluator(subject.solid());
  constexpr std::uint32_t kSteps = 4;
  std::map<SurfaceKey, Vec3> places;
  for (const BoundaryFaceId f : surface.face_ids()) {
    for (std::uint32_t j = 0; j <= kSteps; ++j) {
      for (std::uint32_t i = 0; i <= kSteps; ++i) {
        const Vec3 p = evaluator.geo(surface.cell_param(f, double(i) / kSteps, double(j) / kSteps));
        const SurfaceKey key = surface.key(f, kSurfaceOne / kSteps * i, kSurfaceOne / kSteps * j);
        const auto [it, added] = places.try_emplace(key, p);
        EXPECT_LT((it->second - p).norm(), 1e-11 * subject.diagonal_mm()) << "face " << f;
      }
    }
  }
  std::map<std::array<long, 3>, SurfaceKey> keys;
  for (const auto& [key, p] : places) {
    const double grain = 1e-7 * subject.diagonal_mm();
    const auto [it, added] =
        keys.try_emplace({std::lround(p.x() / grain), std::lround(p.y() / grain), std::lround(p.z() / grain)}, key);
    EXPECT_TRUE(added) << "two keys at " << p.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Boundary, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

class RealBoundary : public testing::TestWithParam<std::string> {};

TEST_P(RealBoundary, LimitAgreesWithOpenSubdiv) {
  std::optional<ControlMesh> mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  for (const bool sharp : {false, true}) {
    if (sharp) {
      mesh->sharp_edges.clear();  // The ring has them.
      sharpen_by_cells(*mesh, 1);
    }
    mesh->allow_folds = true;
    const Subject subject(*mesh);
    std::string where;
    EXPECT_LT(worst_against_bfr(subject, 6, where), kTolerance) << where << (sharp ? ", convex edges sharp" : "");
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, RealBoundary, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealBoundary, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealBoundary, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
