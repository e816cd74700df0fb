// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/operators.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Operators of every limit-ready cell and boundary face of the catalogue after one and two refinements.
OperatorTable operators_of_catalogue() {
  OperatorTable table;
  for (const auto& tiny : oracle::tiny_meshes()) {
    CellComplex complex = make_cell_complex(tiny.mesh);
    for (int level = 0; level < 2; ++level) {
      const std::vector<CellId> cells = complex.cells().to_vector();
      complex = refine(complex, cells).complex;
    }
    Classifier classifier(complex);
    RingWalker walker(complex);
    SurfaceWalker surface(complex);
    for (const CellId c : complex.cells()) {
      const auto found = classifier.classify(c);
      if (found->cell_class == CellClass::kLine) {
        const auto along = static_cast<std::uint8_t>(found->anchor / 4);
        table.line(walker.line(c, frame_at(cell_tables::kHexEdges[found->anchor][0], along)));
      } else if (found->cell_class == CellClass::kVertex) {
        table.vertex(walker.vertex(c, frame_at(found->anchor, 0)));
      }
    }
    for (const FaceId f : complex.faces()) {
      if (!complex.face_on_boundary(f)) continue;
      const SurfaceRing ring = surface.walk(f);
      if (!ring.regular) table.surface(ring);
    }
  }
  return table;
}

class Operators : public testing::Test {
 protected:
  static const OperatorTable& table() {
    static const OperatorTable made = operators_of_catalogue();
    return made;
  }
  template <typename Visit>
  static void for_each(Visit visit) {
    for (const auto& op : table().lines()) visit(op, "line");
    for (const auto& op : table().surfaces()) visit(op, "surface");
    for (const auto& op : table().vertices()) visit(op, "vertex");
  }
};

TEST_F(Operators, ExistForManyTopologies) {
  EXPECT_GE(table().lines().size(), 8u);
  EXPECT_GE(table().surfaces().size(), 5u);
  EXPECT_GE(table().vertices().size(), 20u);
}

TEST_F(Operators, HaveLimitRowsThatAreConvexAndFixed) {
  for_each([](const auto& op, const char* kind) {
    ASSERT_EQ(op.limit.size(), op.points) << kind;
    double sum = 0;
    for (const double w : op.limit) {
      EXPECT_GE(w, -1e-15) << kind;
      sum += w;
    }
    EXPECT_NEAR(sum, 1, 1e-12) << kind;
    // limit = limit * A where the operator leads to itself.
    const ChildRows& next = op.children[0];
    std::vector<double> image(op.points, 0.0);
    if (next.count != op.points) return;
    for (std::uint32_t r = 0; r < next.count; ++r) {
      for (std::uint32_t e = op.stencils.offsets[next.first_row + r]; e < op.stencils.offsets[next.first_row + r + 1];
           ++e) {
        image[op.stencils.indices[e]] += op.limit[r] * op.stencils.weights[e];
      }
    }
    for (std::uint32_t i = 0; i < op.points; ++i) EXPECT_NEAR(image[i], op.limit[i], 1e-13) << kind;
  });
}

TEST_F(Operators, KeepConstants) {
  for_each([](const auto& op, const char* kind) {
    for (std::uint32_t r = 0; r < op.stencils.rows(); ++r) {
      const std::uint32_t begin = op.stencils.offsets[r], end = op.stencils.offsets[r + 1];
      if (begin == end) continue;  // A phantom point.
      EXPECT_NEAR(std::accumulate(&op.stencils.weights[begin], &op.stencils.weights[end], 0.0), 1, 1e-13) << kind;
    }
  });
}

TEST_F(Operators, AreSharedByEqualRings) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  OperatorTable fresh;
  const std::uint32_t first = fresh.vertex(walker.vertex(CellId{0}, frame_at(0, 0)));
  const std::size_t count = fresh.vertices().size();
  EXPECT_EQ(fresh.vertex(walker.vertex(CellId{3}, frame_at(1, 0))),
            fresh.vertex(walker.vertex(CellId{3}, frame_at(1, 0))));
  EXPECT_EQ(fresh.vertex(walker.vertex(CellId{0}, frame_at(0, 0))), first);
  EXPECT_LE(fresh.vertices().size(), count + 2);
}

}  // namespace
}  // namespace ccslice
