// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/make_operators.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>

#include "core/base/error.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Visits the line cells, vertex cells and irregular faces of each tiny mesh refined twice.
template <typename OfLine, typename OfVertex, typename OfSurface>
void visit_catalogue(OfLine of_line, OfVertex of_vertex, OfSurface of_surface) {
  for (const auto& tiny : oracle::tiny_meshes()) {
    CellComplex complex = make_cell_complex(tiny.mesh);
    for (int level = 0; level < 2; ++level) complex = refine(complex, complex.cells().to_vector()).complex;
    SCOPED_TRACE(tiny.name);
    Classifier classifier(complex);
    RingWalker walker(complex);
    SurfaceWalker surface(complex);
    for (const CellId c : complex.cells()) {
      const auto found = classifier.classify(c);
      if (found->cell_class == CellClass::kLine) {
        const auto along = static_cast<std::uint8_t>(found->anchor / 4);
        of_line(walker.line(c, frame_at(cell_tables::kHexEdges[found->anchor][0], along)));
      } else if (found->cell_class == CellClass::kVertex) {
        of_vertex(walker, c, frame_at(found->anchor, 0));
      }
    }
    for (const FaceId f : complex.faces()) {
      if (!complex.face_on_boundary(f)) continue;
      if (const SurfaceRing ring = surface.walk(f); !ring.regular) of_surface(ring);
    }
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
  visit_catalogue(
      [](const LineRing& ring) { expect_weights(limit_of(ring, make_line_operator), ring.count); },
      [](RingWalker&, CellId, const Frame&) {},
      [](const SurfaceRing& ring) { expect_weights(limit_of(ring, make_surface_operator), ring.points.size()); });
}

TEST(MakeOperators, OfCornersTellTheRingsThatTheyLeadTo) {
  std::size_t seen = 0, with_lines = 0;
  const auto check = [&](RingWalker& walker, CellId cell, const Frame& frame) {
    if (++seen % 7 != 0) return;  // A part of many alike.
    const VertexRing ring = walker.vertex(cell, frame, walker.star(cell, frame).points);
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
  };
  visit_catalogue([](const LineRing&) {}, check, [](const SurfaceRing&) {});
  EXPECT_GT(seen, 100u);
  EXPECT_GT(with_lines, 10u);
}

TEST(MakeOperators, OfStarsKeepTheVertex) {
  visit_catalogue([](const LineRing&) {},
                  [](RingWalker& walker, CellId cell, const Frame& frame) {
                    const StarOperator op = make_star_operator(walker.star(cell, frame));
                    expect_weights(op.limit, op.points);
                  },
                  [](const SurfaceRing&) {});
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
