// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/surface_ring.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

struct RingCounts {
  int regular = 0, irregular = 0;
};

RingCounts count_rings(const CellComplex& complex) {
  SurfaceWalker walker(complex);
  RingCounts counts;
  for (const FaceId f : complex.faces()) {
    if (!complex.face_on_boundary(f)) continue;
    ++(walker.walk(f).regular ? counts.regular : counts.irregular);
  }
  return counts;
}

TEST(SurfaceRing, SmoothEdgesAreRegularOnTheSurfaceAndCornersAreNot) {
  const RingCounts counts = count_rings(make_cell_complex(oracle::box_mesh(4, 4, 4)));
  EXPECT_EQ(counts.irregular, 24);  // Three faces at each of eight vertices of valence 3.
  EXPECT_EQ(counts.regular, 96 - 24);
}

TEST(SurfaceRing, SharpBoxesAreRegularEverywhere) {
  for (const int n : {1, 2, 3}) {
    ControlMesh mesh = oracle::box_mesh(n, n, n);
    oracle::sharpen_by_cells(mesh, 1);
    const RingCounts counts = count_rings(make_cell_complex(mesh));
    EXPECT_EQ(counts.irregular, 0);
    EXPECT_EQ(counts.regular, 6 * n * n);
  }
}

TEST(SurfaceRing, OfARegularFaceRunsCounterClockwiseFromOutside) {
  const ControlMesh mesh = oracle::box_mesh(4, 4, 4, 1);
  const CellComplex complex = make_cell_complex(mesh);
  SurfaceWalker walker(complex);
  const Vec3 centre(2, 2, 2);
  for (const FaceId f : complex.faces()) {
    if (!complex.face_on_boundary(f)) continue;
    const SurfaceRing ring = walker.walk(f);
    const auto at = [&](std::size_t i, std::size_t j) {
      return mesh.positions[ring.points[ring.regular ? i + 4 * j : ring.quads[0][(i - 1) + 2 * (j - 1)]]];
    };
    const Vec3 normal = (at(2, 1) - at(1, 1)).cross(at(1, 2) - at(1, 1));
    EXPECT_GT(normal.dot(at(1, 1) - centre), 0);
  }
}

TEST(SurfaceRing, HasPhantomsAcrossSharpSidesOnly) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  oracle::sharpen(mesh, [](const Vec3& a, const Vec3& b) {
    const auto both = [&](int axis, double value) { return a[axis] == value && b[axis] == value; };
    return both(2, 0) && (both(0, 0) || both(0, 40) || both(1, 0) || both(1, 40));
  });
  const CellComplex complex = make_cell_complex(mesh);
  SurfaceWalker walker(complex);
  int creased = 0;
  for (const FaceId f : complex.faces()) {
    if (!complex.face_on_boundary(f)) continue;
    const SurfaceRing ring = walker.walk(f);
    if (!ring.regular) continue;
    creased += ring.phantoms != 0;
    EXPECT_EQ(std::count(ring.points.begin(), ring.points.end(), kNone), ring.phantoms == 0 ? 0 : 4);
  }
  EXPECT_GT(creased, 0);
}

}  // namespace
}  // namespace ccslice
