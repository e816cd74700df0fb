// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/make_operators.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/base/error.h"
#include "tests/core/subdivision/irregular_rings.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Calls visit(complex, rings) for each tiny mesh refined twice.
template <typename Visit>
void visit_catalogue(Visit visit) {
  for (const auto& tiny : oracle::tiny_meshes()) {
    SCOPED_TRACE(tiny.name);
    const CellComplex complex = refined_twice(tiny.mesh);
    visit(complex, IrregularRings(complex));
  }
}

/// Its operator, or that of the ring that it leads to, has the limit: after few steps a ring leads to itself.
template <typename Ring, typename Make>
std::vector<double> limit_of(const Ring& ring, Make make, int steps_left = 4) {
  const auto made = make(ring);
  EXPECT_EQ(made.op.children[0].op, kNone) << "numbers are a table's to give";
  EXPECT_EQ(made.op.limit.empty(), made.next.key != ring.key);
  if (!made.op.limit.empty() || steps_left == 0) return made.op.limit;
  return limit_through(limit_of(made.next, make, steps_left - 1), made.op);
}

void expect_weights(const std::vector<double>& limit, std::size_t points) {
  ASSERT_EQ(limit.size(), points);
  EXPECT_NEAR(std::accumulate(limit.begin(), limit.end(), 0.0), 1, 1e-12);
  EXPECT_GE(*std::ranges::min_element(limit), -1e-15);
}

TEST(MakeOperators, OfLinesAndSurfacesLeadToTheirLimits) {
  visit_catalogue([](const CellComplex&, const IrregularRings& rings) {
    for (const LineRing& ring : rings.lines) expect_weights(limit_of(ring, make_line_operator), ring.count);
    for (const SurfaceRing& ring : rings.surfaces) {
      expect_weights(limit_of(ring, make_surface_operator), ring.points.size());
    }
  });
}

TEST(MakeOperators, OfCornersTellTheRingsThatTheyLeadTo) {
  std::size_t seen = 0, with_lines = 0;
  visit_catalogue([&](const CellComplex& complex, const IrregularRings& rings) {
    RingWalker walker(complex);
    for (const auto& [star, ring, cell, frame] : rings.vertices) {
      if (++seen % 7 != 0) continue;  // A part of many alike.
      const NumberedCells cells = walker.neighbourhood(cell, frame);
      const MadeCorner made = make_corner_operator(ring, cells, [](const NumberKey&) { return true; });
      EXPECT_FALSE(made.next_cells.cells.empty());
      EXPECT_EQ(made.op.carried.size(), made.next.shared.size());
      EXPECT_EQ(made.op.children[0].count, made.next.own().size());
      for (std::size_t c = 0; c < 8; ++c) {
        const CornerOperator::Child& child = made.op.children[c];
        EXPECT_EQ(child.op, kNone);
        EXPECT_EQ(child.cell_class == CellClass::kLine, made.lines[c].count > 0);
        EXPECT_EQ(child.layer_points, made.lines[c].count);
        with_lines += made.lines[c].count > 0;
      }
      // The next ring's operator follows from its cells as this one's did.
      const MadeCorner next = make_corner_operator(made.next, made.next_cells, [](const NumberKey&) { return false; });
      EXPECT_TRUE(next.next_cells.cells.empty()) << "nobody asked for them";
      EXPECT_EQ(next.op.shared, made.next.shared.size());
    }
  });
  EXPECT_GT(seen, 100u);
  EXPECT_GT(with_lines, 10u);
}

TEST(MakeOperators, OfStarsKeepTheVertex) {
  visit_catalogue([](const CellComplex&, const IrregularRings& rings) {
    for (const auto& vertex : rings.vertices) {
      const StarOperator op = make_star_operator(vertex.star);
      expect_weights(op.limit, op.points);
    }
  });
}

TEST(MakeOperators, LimitsComeFromWhereARingLeads) {
  try {
    (void)limit_through({}, PlanarOperator{});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInternal);
  }
}

}  // namespace
}  // namespace ccslice
