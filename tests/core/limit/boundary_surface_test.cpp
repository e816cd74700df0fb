// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/boundary_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

Vec3 evaluate(const BezierPatch& patch, double s, double t) {
  const auto bernstein = [](double x) {
    const double y = 1 - x;
    return std::array<double, 4>{y * y * y, 3 * y * y * x, 3 * y * x * x, x * x * x};
  };
  const auto bs = bernstein(s), bt = bernstein(t);
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < 16; ++i) sum += bs[i % 4] * bt[i / 4] * patch.b[i].head<3>();
  return sum;
}

/// Calls visit(face, s, t, surface point) on a grid of each regular face and of several levels of each irregular one.
template <typename Visit>
void sample(const BoundarySurface& surface, Visit visit) {
  for (const BoundaryFaceId f : surface.face_ids()) {
    const auto patch_at = [&](const BezierPatch& patch, double s0, double t0, double size) {
      for (int i = 0; i < 25; ++i) {
        const double s = i % 5 / 4.0, t = i / 5 / 4.0;
        visit(f, s0 + s * size, t0 + t * size, evaluate(patch, s, t));
      }
    };
    if (surface.faces()[f].regular) {
      patch_at(surface.regular_patch(f), 0, 0, 1);
      continue;
    }
    IrregularCorner corner;
    std::array<BezierPatch, 3> patches;
    surface.irregular_corner(f, corner);
    for (double size = 0.5; size > 1e-3; size /= 2) {
      surface.split(corner, patches);
      patch_at(patches[0], size, 0, size);
      patch_at(patches[1], 0, size, size);
      patch_at(patches[2], size, size, size);
    }
    visit(f, 0, 0, surface.corner_position(corner));
  }
}

TEST(BoundarySurface, IsWhereTheVolumeEndsOnTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    const double diagonal = solid->summary().bounding_box.diagonal().norm();
    LimitEvaluator evaluator(*solid);
    const BoundarySurface surface(*solid);
    double worst = 0;
    sample(surface, [&](BoundaryFaceId f, double s, double t, const Vec3& p) {
      worst = std::max(worst, (evaluator.geo(surface.cell_param(f, s, t)) - p).norm());
    });
    EXPECT_LT(worst, 1e-11 * diagonal) << name;
  }
}

TEST(BoundarySurface, FacesOutwards) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    LimitEvaluator evaluator(*solid);
    const BoundarySurface surface(*solid);
    for (const BoundaryFaceId f : surface.face_ids()) {
      const auto at = [&](double s, double t) { return evaluator.geo(surface.cell_param(f, s, t)); };
      const Vec3 normal = (at(0.51, 0.5) - at(0.5, 0.5)).cross(at(0.5, 0.51) - at(0.5, 0.5));
      CellParam inside = surface.cell_param(f, 0.5, 0.5);
      const int axis = surface.faces()[f].cell_side / 2;
      inside.uvw[axis] = surface.faces()[f].cell_side % 2 ? 0.9 : 0.1;
      EXPECT_LT(normal.dot(evaluator.geo(inside) - at(0.5, 0.5)), 0) << name << " face " << f;
    }
  }
}

TEST(BoundarySurface, KeysNamePlacesWhateverTheFace) {
  // Equal keys <=> equal places: on all dyadic places of a 4 x 4 grid of every face.
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    const double diagonal = solid->summary().bounding_box.diagonal().norm();
    LimitEvaluator evaluator(*solid);
    const BoundarySurface surface(*solid);
    std::map<SurfaceKey, Vec3> places;
    for (const BoundaryFaceId f : surface.face_ids()) {
      for (std::uint32_t i = 0; i < 25; ++i) {
        const std::uint32_t s = i % 5 * (kSurfaceOne / 4), t = i / 5 * (kSurfaceOne / 4);
        const Vec3 p = evaluator.geo(surface.cell_param(f, i % 5 / 4.0, i / 5 / 4.0));
        const auto [known, fresh] = places.try_emplace(surface.key(f, s, t), p);
        EXPECT_LT((known->second - p).norm(), 1e-11 * diagonal) << name << " face " << f;
      }
    }
    std::vector<Vec3> by_x;
    for (const auto& [key, place] : places) by_x.push_back(place);
    std::sort(by_x.begin(), by_x.end(), [](const Vec3& a, const Vec3& b) { return a.x() < b.x(); });
    std::size_t twice = 0;
    for (auto a = by_x.begin(); a != by_x.end(); ++a) {
      for (auto b = std::next(a); b != by_x.end() && b->x() - a->x() < 1e-9 * diagonal; ++b) {
        twice += (*a - *b).norm() < 1e-9 * diagonal;
      }
    }
    EXPECT_EQ(twice, 0u) << name;
  }
}

TEST(BoundarySurface, HullBoxesHoldTheirFaces) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    const BoundarySurface surface(*solid);
    sample(surface, [&](BoundaryFaceId f, double, double, const Vec3& p) {
      const Box3 box = surface.hull_box(f);
      EXPECT_LT(box.exteriorDistance(p), 1e-9) << name << " face " << f;
    });
  }
}

}  // namespace
}  // namespace ccslice
