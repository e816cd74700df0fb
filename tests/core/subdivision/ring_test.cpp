// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/ring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/subdivision/classify.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(RegularRing, OfAGridIsTheGrid) {
  const ControlMesh mesh = oracle::box_mesh(3, 3, 3, 1);
  const CellComplex complex = make_cell_complex(mesh);
  const RegularRing ring = RingWalker(complex).regular(CellId{13});
  EXPECT_EQ(ring.phantoms, 0);
  const Vec3 origin = mesh.positions[ring.points[0]];
  for (int i = 0; i < 64; ++i) {
    const Vec3 expected = origin + Vec3(i & 3, i >> 2 & 3, i >> 4);
    EXPECT_LT((mesh.positions[ring.points[static_cast<std::size_t>(i)]] - expected).norm(), 1e-12) << i;
  }
}

TEST(RegularRing, MarksPhantomLayersOnBothSidesOfAPlate) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  const CellComplex complex = make_cell_complex(mesh);
  RingWalker walker(complex);
  EXPECT_EQ(walker.regular(CellId{4}).phantoms, 0b110000);
  const RegularRing corner = walker.regular(CellId{0});
  EXPECT_EQ(corner.phantoms, 0b110101);
  EXPECT_EQ(std::count(corner.points.begin(), corner.points.end(), kNone), 64 - 3 * 3 * 2);
}

TEST(RegularRing, FollowsItsFrame) {
  const ControlMesh mesh = oracle::box_mesh(3, 3, 3, 1);
  const CellComplex complex = make_cell_complex(mesh);
  const RingWalker walker(complex);
  const RegularRing plain = walker.regular(CellId{13});
  for (std::uint8_t corner = 0; corner < 8; ++corner) {
    const Frame frame = frame_at(corner, 1);
    const RegularRing turned = walker.regular(CellId{13}, frame);
    for (unsigned j = 0; j < 8; ++j) {
      const auto inner = [](unsigned bits) {
        return 1 + (bits & 1) + 4 * (1 + (bits >> 1 & 1)) + 16 * (1 + (bits >> 2));
      };
      EXPECT_EQ(turned.points[inner(j)], plain.points[inner(frame.corner(j))]);
    }
  }
}

/// Cells of one class in a complex.
std::vector<std::pair<CellId, Classification>> cells_of(const CellComplex& complex, CellClass wanted) {
  Classifier classifier(complex);
  std::vector<std::pair<CellId, Classification>> result;
  for (const CellId c : complex.cells()) {
    const auto found = classifier.classify(c);
    if (found && found->cell_class == wanted) result.emplace_back(c, *found);
  }
  return result;
}

TEST(LineRing, OfASmoothBoxEdgeHasNinePointsALayer) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  std::set<std::vector<std::uint32_t>> keys;
  const auto lines = cells_of(complex, CellClass::kLine);
  ASSERT_EQ(lines.size(), 24u);
  for (const auto& [cell, found] : lines) {
    const auto& ends = cell_tables::kHexEdges[found.anchor];
    const auto along = static_cast<std::uint8_t>(found.anchor / 4);
    const LineRing ring = walker.line(cell, frame_at(ends[0], along));
    EXPECT_EQ(ring.count, 9u);
    EXPECT_EQ(ring.quads.size(), 4u);
    EXPECT_EQ(ring.phantoms, 0);
    EXPECT_EQ(std::set(ring.points.begin(), ring.points.end()).size(), 36u);
    keys.insert(std::min(ring.key, walker.line(cell, frame_at(ends[1], along)).key));
  }
  EXPECT_EQ(keys.size(), 1u) << "all edges of a box have one topology";
}

/// The edges that bound the two end faces of a bar of 20 x 20 x 30 mm.
bool round_the_cap(const Vec3& a, const Vec3& b) {
  const auto both = [&](int axis, double value) { return a[axis] == value && b[axis] == value; };
  return (both(2, 0) || both(2, 30)) && (both(0, 0) || both(0, 20) || both(1, 0) || both(1, 20));
}

TEST(LineRing, EndsInAPhantomLayerAtACap) {
  ControlMesh bar = oracle::box_mesh(2, 2, 3);
  oracle::sharpen(bar, round_the_cap);
  const CellComplex complex = make_cell_complex(bar);
  RingWalker walker(complex);
  int capped = 0;
  for (const auto& [cell, found] : cells_of(complex, CellClass::kLine)) {
    const LineRing ring = walker.line(cell, frame_at(cell_tables::kHexEdges[found.anchor][0], 2));
    capped += ring.phantoms != 0;
    EXPECT_EQ(std::count(ring.points.begin(), ring.points.end(), kNone), ring.phantoms != 0 ? 9 : 0);
  }
  EXPECT_EQ(capped, 8);
}

TEST(VertexRing, KeysOfABoxsCornersAgreeUpToRotation) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  std::set<std::vector<std::uint32_t>> keys;
  for (const auto& [cell, found] : cells_of(complex, CellClass::kVertex)) {
    std::vector<std::uint32_t> best;
    for (std::uint8_t axis = 0; axis < 3; ++axis) {
      const Frame frame = frame_at(found.anchor, axis);
      const VertexStar star = walker.star(cell, frame);
      EXPECT_EQ(star.points.size(), 8u);
      EXPECT_EQ(star.points[0], complex.cell_vertices(cell)[found.anchor]);
      const VertexRing ring = walker.vertex(cell, frame, star.points);
      EXPECT_EQ(ring.points.size(), 27u);
      EXPECT_EQ(ring.shared.size(), 8u);
      for (std::size_t n = 0; n < ring.shared.size(); ++n) EXPECT_EQ(ring.points[n], star.points[ring.shared[n]]);
      if (best.empty() || ring.key < best) best = ring.key;
    }
    keys.insert(best);
  }
  EXPECT_EQ(keys.size(), 1u);
}

TEST(VertexRing, LeavesOutCellsThatTouchTheVertexAlone) {
  // Eight boxes round the middle of a box of four: one of them touches its opposite in the vertex alone.
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  const CellId cell{1 + 4 + 16};
  const VertexStar star = walker.star(cell, frame_at(7, 0));
  EXPECT_EQ(star.points.size(), 27u);
  EXPECT_EQ(star.cells.size(), 8u);
  const VertexRing ring = walker.vertex(cell, frame_at(7, 0), star.points);
  EXPECT_EQ(ring.cells.size(), 26u);
  EXPECT_EQ(ring.own().size(), 64u - 27u);
  EXPECT_EQ(ring.shared.size(), 26u) << "the far corner of the opposite box isn't needed";
  EXPECT_EQ(walker.neighbourhood(cell, frame_at(7, 0)).cells.size(), 27u);
}

TEST(VertexRing, TellsSharpFromSmooth) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  const auto key_of_corner = [](const ControlMesh& m) {
    const CellComplex complex = make_cell_complex(m);
    RingWalker walker(complex);
    return walker.star(CellId{0}, frame_at(0, 0)).key;
  };
  const auto smooth = key_of_corner(mesh);
  mesh.sharp_vertices = {0};
  EXPECT_NE(key_of_corner(mesh), smooth);
  mesh.sharp_vertices.clear();
  mesh.sharp_edges = {{0, 1}};
  EXPECT_NE(key_of_corner(mesh), smooth);
}

}  // namespace
}  // namespace ccslice
