// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/canonical_rings.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using Keys = std::set<std::vector<std::uint32_t>>;

// A box of 4 x 4 x 4 cells: cells at its corners, by corner bits.
constexpr std::array<std::uint32_t, 8> kCornerCells = {0, 3, 12, 15, 48, 51, 60, 63};

TEST(CanonicalRings, OfAllCornersOfABoxAreOne) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  KnownStarts known;
  Keys stars, rings;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const CellId cell{kCornerCells[corner]};
    const VertexId vertex = complex.cell_vertices(cell)[corner];
    const VertexStar star = canonical_star(walker, vertex);
    EXPECT_EQ(star.points[0], vertex);
    stars.insert(star.key);
    const FramedVertexRing found = canonical_vertex_ring(walker, known, cell, vertex, star.points);
    EXPECT_EQ(found.frame.origin, corner);
    EXPECT_TRUE(found.frame.proper());
    rings.insert(found.ring.key);
  }
  EXPECT_EQ(stars.size(), 1u);
  EXPECT_EQ(rings.size(), 1u);
}

TEST(CanonicalRings, OfALineDontDependOnItsDirection) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  // The second and the third cell of the box's edge along x: mirror images, the line is local edge 0 of both.
  KnownStarts known;
  const FramedLineRing second = canonical_line_ring(walker, known, CellId{1}, 0);
  const FramedLineRing third = canonical_line_ring(walker, known, CellId{2}, 0);
  EXPECT_EQ(second.ring.key, third.ring.key);
  EXPECT_EQ(second.ring.count, 9u);
}

/// What is known of other rings spares walks and changes nothing: neither the start nor the ring.
TEST(CanonicalRings, AreThoseOfAllStartsWhateverIsKnown) {
  KnownStarts known;
  std::size_t lines = 0, vertices = 0;
  for (const auto& tiny : oracle::tiny_meshes()) {
    CellComplex complex = make_cell_complex(tiny.mesh);
    for (int level = 0; level < 2; ++level) complex = refine(complex, complex.cells().to_vector()).complex;
    Classifier classifier(complex);
    RingWalker walker(complex);
    for (const CellId cell : complex.cells()) {
      const auto found = classifier.classify(cell);
      KnownStarts none;
      if (found->cell_class == CellClass::kLine) {
        ++lines;
        const FramedLineRing direct = canonical_line_ring(walker, none, cell, found->anchor);
        const FramedLineRing quick = canonical_line_ring(walker, known, cell, found->anchor);
        ASSERT_EQ(quick.frame, direct.frame) << tiny.name;
        ASSERT_EQ(quick.ring.points, direct.ring.points) << tiny.name;
        ASSERT_EQ(quick.ring.key, direct.ring.key) << tiny.name;
      } else if (found->cell_class == CellClass::kVertex) {
        ++vertices;
        const VertexId vertex = complex.cell_vertices(cell)[found->anchor];
        const VertexStar star = canonical_star(walker, vertex);
        const FramedVertexRing direct = canonical_vertex_ring(walker, none, cell, vertex, star.points);
        const FramedVertexRing quick = canonical_vertex_ring(walker, known, cell, vertex, star.points);
        ASSERT_EQ(quick.frame, direct.frame) << tiny.name;
        ASSERT_EQ(quick.ring.points, direct.ring.points) << tiny.name;
        ASSERT_EQ(quick.ring.shared, direct.ring.shared) << tiny.name;
        ASSERT_EQ(quick.ring.key, direct.ring.key) << tiny.name;
      }
    }
  }
  EXPECT_GT(lines, 4 * known.of_lines.size());
  EXPECT_GT(vertices, 4 * known.of_vertices.size());
}

/// The star of a regular vertex has 24 starts that are alike: any gives the key that all have.
TEST(CanonicalRings, AreTheSmallestOfAllStarts) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  const CellId cell{0};
  const VertexId vertex = complex.cell_vertices(cell)[7];
  const std::vector<std::uint32_t> canonical = canonical_star(walker, vertex).key;
  for (const CellId at : complex.vertex_cells(vertex)) {
    const auto vertices = complex.cell_vertices(at);
    for (std::uint8_t corner = 0; corner < 8; ++corner) {
      if (vertices[corner] != vertex) continue;
      for (std::uint8_t along = 0; along < 3; ++along) {
        EXPECT_LE(canonical, walker.star(at, frame_at(corner, along)).key);
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
