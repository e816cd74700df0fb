// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/classify.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/subdivision/refine.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// The edges that bound the two end faces of a bar of 20 x 20 x 30 mm.
bool round_a_cap(const Vec3& a, const Vec3& b) {
  const auto both = [&](int axis, double value) { return a[axis] == value && b[axis] == value; };
  return (both(2, 0) || both(2, 30)) && (both(0, 0) || both(0, 20) || both(1, 0) || both(1, 20));
}

struct Counts {
  int regular = 0, line = 0, vertex = 0, refused = 0;
  friend bool operator==(const Counts&, const Counts&) = default;
};

Counts count(const CellComplex& complex) {
  Classifier classifier(complex);
  Counts counts;
  for (const CellId c : complex.cells()) {
    const auto found = classifier.classify(c);
    ++(!found                                     ? counts.refused
       : found->cell_class == CellClass::kRegular ? counts.regular
       : found->cell_class == CellClass::kLine    ? counts.line
                                                  : counts.vertex);
  }
  return counts;
}

Counts count(const ControlMesh& mesh) { return count(make_cell_complex(mesh)); }

TEST(Classify, BoxesDependOnWhatIsSharp) {
  // Smooth: corner cells have an irregular vertex, edge cells a line, the rest is regular.
  EXPECT_EQ(count(oracle::box_mesh(4, 4, 4)), (Counts{8 + 24, 24, 8, 0}));
  ControlMesh sharp = oracle::box_mesh(4, 4, 4);
  oracle::sharpen_by_cells(sharp, 1);
  EXPECT_EQ(count(sharp), (Counts{64, 0, 0, 0}));
  // A single smooth hexahedron has eight irregular vertices; sharp edges make it regular.
  EXPECT_EQ(count(oracle::box_mesh(1, 1, 1)), (Counts{0, 0, 0, 1}));
  ControlMesh one = oracle::box_mesh(1, 1, 1);
  oracle::sharpen_by_cells(one, 1);
  EXPECT_EQ(count(one), (Counts{1, 0, 0, 0}));
}

TEST(Classify, OnlyEdgesRoundACapMakeALineEnd) {
  // A bar of 2 x 2 x 3 whose end faces are bounded by sharp edges: its four long smooth edges end on faces.
  ControlMesh bar = oracle::box_mesh(2, 2, 3);
  oracle::sharpen(bar, round_a_cap);
  EXPECT_EQ(count(bar), (Counts{0, 12, 0, 0}));
}

TEST(Classify, ExtraordinaryEdgesMakeLineCells) {
  for (const int valence : {3, 5, 6, 7}) {
    ControlMesh fan = oracle::fan_mesh(valence, 3, 2);
    oracle::sharpen(fan, [](const Vec3&, const Vec3&) { return true; });
    const CellComplex complex = make_cell_complex(fan);
    Classifier at(complex);
    int irregular_inside = 0;
    for (const EdgeId e : complex.edges()) {
      irregular_inside += !complex.edge_on_boundary(e) && at.irregular(e);
    }
    EXPECT_EQ(irregular_inside, 2) << valence;
  }
}

std::uint32_t vertex_at(const ControlMesh& mesh, const Vec3& place) {
  const auto found = std::find(mesh.positions.begin(), mesh.positions.end(), place);
  return static_cast<std::uint32_t>(found - mesh.positions.begin());
}

TEST(Classify, ACreaseThatTurnsMeetsInAnIrregularVertex) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  mesh.sharp_edges = {{vertex_at(mesh, Vec3(10, 20, 40)), vertex_at(mesh, Vec3(20, 20, 40))},
                      {vertex_at(mesh, Vec3(20, 20, 40)), vertex_at(mesh, Vec3(20, 10, 40))}};
  const CellComplex complex = make_cell_complex(mesh);
  const auto found = Classifier(complex).classify(complex.vertex_cells(VertexId{vertex_at(mesh, Vec3(20, 20, 40))})[3]);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->cell_class, CellClass::kVertex);
}

TEST(Classify, ATaggedVertexIsIrregularUnlessItIsACorner) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  oracle::sharpen_by_cells(mesh, 1);
  mesh.sharp_vertices = {vertex_at(mesh, Vec3(0, 0, 0))};
  EXPECT_EQ(count(mesh), (Counts{64, 0, 0, 0}));
  mesh.sharp_vertices = {vertex_at(mesh, Vec3(20, 0, 0))};  // In the middle of an edge of the box: two cells.
  EXPECT_EQ(count(mesh), (Counts{62, 0, 2, 0}));
}

TEST(Classify, TetsAndWedgesAndWhatTouchesThemMustBeRefined) {
  ControlMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.cell_kinds = {CellKind::kTet};
  mesh.cell_vertices = {0, 1, 2, 3};
  EXPECT_EQ(count(mesh), (Counts{0, 0, 0, 1}));
}

TEST(Classify, TwoRefinementsMakeEveryCellOfTheCatalogueLimitReady) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    CellComplex complex = make_cell_complex(mesh);
    for (int i = 0; i < 2; ++i) {
      const std::vector<CellId> cells = complex.cells().to_vector();
      complex = refine(complex, cells).complex;
    }
    EXPECT_EQ(count(complex).refused, 0) << name;
  }
}

}  // namespace
}  // namespace ccslice
