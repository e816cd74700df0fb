// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/operator_table.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"
#include "tests/core/subdivision/irregular_rings.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

std::uint32_t add_vertex(OperatorTable& table, RingWalker& walker, CellId cell, const Frame& frame) {
  const VertexStar star = walker.star(cell, frame);
  const VertexRing ring = walker.vertex(cell, frame, star.points);
  return table.vertex(table.star(star), table.corner(ring, walker, cell, frame), ring);
}

void ask(OperatorTable& table, const CellComplex& complex, const IrregularRings& rings) {
  RingWalker walker(complex);
  for (const LineRing& ring : rings.lines) table.line(ring);
  for (const auto& [star, ring, cell, frame] : rings.vertices) {
    const std::uint32_t star_operator = table.star(star);
    table.vertex(star_operator, table.corner(ring, walker, cell, frame), ring);
  }
  for (const SurfaceRing& ring : rings.surfaces) table.surface(ring);
}

void make_ahead(OperatorTable& table, const CellComplex& complex, const IrregularRings& rings) {
  for (const LineRing& ring : rings.lines) table.want(ring);
  for (const auto& [star, ring, cell, frame] : rings.vertices) {
    table.want(star);
    table.want(ring, cell, frame);
  }
  for (const SurfaceRing& ring : rings.surfaces) table.want(ring);
  const auto on_threads = [&](std::size_t count, auto make) {
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      RingWalker walker(complex);
      make(walker, i);
    });
  };
  while (table.make_wanted(on_threads)) {
  }
}

/// Operators of every limit-ready cell and boundary face of the catalogue after one and two refinements.
OperatorTable operators_of_catalogue(bool ahead = false) {
  OperatorTable table;
  for (const auto& tiny : oracle::tiny_meshes()) {
    const CellComplex complex = refined_twice(tiny.mesh);
    const IrregularRings rings(complex);
    if (ahead) make_ahead(table, complex, rings);
    ask(table, complex, rings);
  }
  return table;
}

/// All that an operator consists of.
template <typename Operator>
std::vector<double> numbers_of(const Operator& op) {
  std::vector<double> numbers;
  for (std::uint32_t r = 0; r < op.stencils.rows(); ++r) {
    op.stencils.for_each(r, [&](std::uint32_t column, double weight) {
      numbers.insert(numbers.end(), {column * 1.0, weight});
    });
  }
  if constexpr (requires { op.limit; }) numbers.insert(numbers.end(), op.limit.begin(), op.limit.end());
  if constexpr (requires { op.children; }) {
    for (const auto& child : op.children) numbers.push_back(child.op);
    numbers.insert(numbers.end(), op.rows.begin(), op.rows.end());
  }
  return numbers;
}

template <typename Operator>
void expect_equal(const std::vector<Operator>& a, const std::vector<Operator>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(numbers_of(a[i]), numbers_of(b[i])) << i;
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
    for (const auto& op : table().stars()) visit(op, "star");
  }
  static void keeps_constants(const PackedStencils& stencils, const char* kind) {
    for (std::uint32_t r = 0; r < stencils.rows(); ++r) {
      std::optional<double> sum;  // Nothing of a phantom point.
      stencils.for_each(r, [&](std::uint32_t, double weight) { sum = sum.value_or(0) + weight; });
      EXPECT_NEAR(sum.value_or(1), 1, 1e-13) << kind;
    }
  }
};

TEST_F(Operators, ExistForManyTopologies) {
  EXPECT_GE(table().lines().size(), 8u);
  EXPECT_GE(table().surfaces().size(), 5u);
  EXPECT_GE(table().stars().size(), 8u);
  EXPECT_GE(table().corners().size(), 20u);
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
    std::vector<std::uint32_t> rows(op.points);
    std::iota(rows.begin(), rows.end(), 0u);
    if constexpr (requires { op.children; }) {
      if (op.children[0].count != op.points) return;
      std::ranges::copy(op.rows_of(op.children[0]), rows.begin());
    }
    std::vector<double> image(op.points, 0.0);
    for (std::uint32_t r = 0; r < op.points; ++r) {
      op.stencils.for_each(rows[r],
                           [&](std::uint32_t column, double weight) { image[column] += op.limit[r] * weight; });
    }
    for (std::uint32_t i = 0; i < op.points; ++i) EXPECT_NEAR(image[i], op.limit[i], 1e-13) << kind;
  });
}

TEST_F(Operators, KeepConstants) {
  for_each([](const auto& op, const char* kind) { keeps_constants(op.stencils, kind); });
  for (const CornerOperator& op : table().corners()) keeps_constants(op.stencils, "corner");
}

/// Children at one vertex of a parent share most of their points.
TEST_F(Operators, HaveOneRowForEachPointOfTheirChildren) {
  const auto check = [](const auto& op, const char* kind) {
    const std::set<std::uint32_t> used(op.rows.begin(), op.rows.end());
    EXPECT_EQ(used.size(), op.stencils.rows()) << kind;
    EXPECT_LT(3 * used.size(), 2 * op.rows.size()) << kind;
    std::set<std::vector<std::pair<std::uint32_t, double>>> different;
    std::uint32_t shorter = 0;
    for (std::uint32_t r = 0; r < op.stencils.rows(); ++r) {
      std::vector<std::pair<std::uint32_t, double>> row;
      op.stencils.for_each(r, [&](std::uint32_t column, double weight) { row.emplace_back(column, weight); });
      EXPECT_LE(shorter, row.size()) << kind << ": rows come by their numbers of entries";
      shorter = static_cast<std::uint32_t>(row.size());
      EXPECT_TRUE(different.insert(row).second) << kind << ": row " << r << " is another one's double";
    }
  };
  for (const auto& op : table().lines()) check(op, "line");
  for (const auto& op : table().surfaces()) check(op, "surface");
  for (const auto& op : table().corners()) check(op, "corner");
}

TEST_F(Operators, OfCornersCarryEachSharedPointOnce) {
  for (const CornerOperator& op : table().corners()) {
    const std::set<std::uint32_t> carried(op.carried.begin(), op.carried.end());
    EXPECT_EQ(carried.size(), op.carried.size());
    EXPECT_EQ(op.carried.at(0), 0u) << "the vertex stays the vertex";
    EXPECT_LT(*carried.rbegin(), op.shared);
    EXPECT_EQ(table().corners()[op.children[0].op].shared, op.carried.size());
    EXPECT_EQ(table().corners()[op.children[0].op].own, op.children[0].count);
  }
}

TEST_F(Operators, OfCornersServeDifferentStars) { EXPECT_LT(table().corners().size(), table().vertices().size()); }

TEST_F(Operators, AreTheSameIfMadeAhead) {
  const OperatorTable ahead = operators_of_catalogue(true);
  expect_equal(ahead.lines(), table().lines());
  expect_equal(ahead.surfaces(), table().surfaces());
  expect_equal(ahead.stars(), table().stars());
  expect_equal(ahead.corners(), table().corners());
  ASSERT_EQ(ahead.vertices().size(), table().vertices().size());
  for (std::size_t i = 0; i < ahead.vertices().size(); ++i) {
    EXPECT_EQ(ahead.vertices()[i].star, table().vertices()[i].star);
    EXPECT_EQ(ahead.vertices()[i].corner, table().vertices()[i].corner);
    EXPECT_EQ(ahead.vertices()[i].shared, table().vertices()[i].shared);
  }
  EXPECT_EQ(ahead.memory_bytes(), table().memory_bytes());
  EXPECT_EQ(ahead.kept_bytes(), table().kept_bytes());
}

TEST_F(Operators, ThatAreMadeAheadAreAllThatIsAskedFor) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  const IrregularRings rings(complex);
  OperatorTable fresh;
  make_ahead(fresh, complex, rings);
  EXPECT_GT(fresh.memory_bytes(), 0u);
  EXPECT_EQ(fresh.kept_bytes(), 0u);
  EXPECT_EQ(fresh.find(rings.lines.front()), kNone) << "none has a number before it is asked for";
  ask(fresh, complex, rings);
  OperatorTable direct;
  ask(direct, complex, rings);
  EXPECT_EQ(fresh.find(rings.lines.front()), fresh.line(rings.lines.front()));
  EXPECT_EQ(fresh.find(rings.surfaces.front()), fresh.surface(rings.surfaces.front()));
  EXPECT_EQ(fresh.memory_bytes(), direct.memory_bytes()) << "nothing is left that nobody asked for";
  make_ahead(fresh, complex, rings);
  const std::size_t asked = fresh.memory_bytes();
  ask(fresh, complex, rings);
  EXPECT_EQ(fresh.memory_bytes(), asked) << "what is known isn't made again";
}

TEST_F(Operators, AreSharedByEqualRings) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 4, 4));
  RingWalker walker(complex);
  OperatorTable fresh;
  const std::uint32_t first = add_vertex(fresh, walker, CellId{0}, frame_at(0, 0));
  const std::size_t count = fresh.vertices().size();
  EXPECT_EQ(add_vertex(fresh, walker, CellId{3}, frame_at(1, 0)), add_vertex(fresh, walker, CellId{3}, frame_at(1, 0)));
  EXPECT_EQ(add_vertex(fresh, walker, CellId{0}, frame_at(0, 0)), first);
  EXPECT_LE(fresh.vertices().size(), count + 2);
  const std::size_t with_keys = fresh.memory_bytes();
  fresh.forget_keys();
  EXPECT_LT(fresh.memory_bytes(), with_keys);
}

}  // namespace
}  // namespace ccslice
