// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/vertex_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Calls visit(data, cell, walk at the cell) for each vertex cell of the catalogue's meshes.
template <typename Visit>
void for_each_vertex_cell(Visit visit) {
  for (const auto& tiny : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(tiny.mesh);
    const LimitSolid::Data& data = solid->data();
    VertexWalk walk(data.operators, 3);
    for (const LimitCell& cell : data.cells) {
      if (cell.cell_class != CellClass::kVertex) continue;
      const std::span<double> points = walk.start(cell.op);
      data.for_each_point(
          cell, [&](std::size_t n, std::uint32_t id) { Vec3::Map(points.data() + 3 * n) = data.position(id); });
      visit(data, cell, walk);
    }
  }
}

Vec3 limit_of(const VertexWalk& walk) {
  Vec3 limit = Vec3::Zero();
  for (std::size_t p = 0; p < walk.star().points; ++p) {
    limit += walk.star().limit[p] * Vec3::Map(&walk.points()[3 * p]);
  }
  return limit;
}

TEST(VertexWalk, KeepsTheLimitAndClosesInOnIt) {
  std::size_t cells = 0;
  for_each_vertex_cell([&](const LimitSolid::Data&, const LimitCell&, VertexWalk walk) {
    ++cells;
    const Vec3 limit = limit_of(walk);
    double extent = 0;
    for (int level = 0; level < 12; ++level) {
      double now = 0;
      for (std::size_t i = 0; i < walk.points().size(); i += 3) {
        now = std::max(now, (Vec3::Map(&walk.points()[i]) - limit).norm());
      }
      if (level > 1) {
        EXPECT_LT(now, 0.9 * extent) << "level " << level;
      }
      extent = now;
      EXPECT_LT((limit_of(walk) - limit).norm(), 1e-13 * (1 + limit.norm()));
      walk.descend();
    }
  });
  EXPECT_GT(cells, 30u);
}

/// A sub-cell of the first level made before and after another one, and after the walk went on and was copied.
TEST(VertexWalk, MakesChildrenInAnyOrder) {
  for_each_vertex_cell([](const LimitSolid::Data&, const LimitCell&, VertexWalk walk) {
    std::array<std::vector<double>, 8> first;
    for (std::size_t child = 1; child < 8; ++child) {
      first[child].resize(3 * walk.corner().children[child].count);
      walk.make_child(child, first[child].data());
    }
    VertexWalk copy = walk;
    walk.descend();
    for (std::size_t child = 7; child > 0; --child) {
      std::vector<double> again(first[child].size());
      copy.make_child(child, again.data());
      EXPECT_EQ(again, first[child]);
    }
  });
}

/// To the last bit, as boxes and folds follow from them.
TEST(VertexWalk, MakesChildrenTogetherAsOneByOne) {
  for_each_vertex_cell([](const LimitSolid::Data&, const LimitCell&, VertexWalk walk) {
    VertexWalk together = walk;
    for (int level = 0; level < 4; ++level) {
      together.make_children();
      for (std::size_t child = 1; child < 8; ++child) {
        std::vector<double> one(3 * walk.corner().children[child].count), other(one.size());
        walk.make_child(child, one.data());
        together.make_child(child, other.data());
        ASSERT_EQ(one, other) << "level " << level << ", child " << child;
      }
      walk.descend();
      together.descend();
      ASSERT_TRUE(std::ranges::equal(walk.points(), together.points())) << "level " << level;
    }
  });
}

/// Subdivision commutes with affine maps.
TEST(VertexWalk, RescalesAllThatFollows) {
  for_each_vertex_cell([](const LimitSolid::Data&, const LimitCell&, VertexWalk walk) {
    VertexWalk moved = walk;
    constexpr std::array kOrigin{1.0, -2.0, 3.0};
    moved.rescale(kOrigin, 4);
    walk.descend();
    moved.descend();
    ASSERT_EQ(moved.points().size(), walk.points().size());
    for (std::size_t i = 0; i < walk.points().size(); ++i) {
      EXPECT_NEAR(moved.points()[i], 4 * (walk.points()[i] - kOrigin[i % 3]), 1e-11);
    }
  });
}

}  // namespace
}  // namespace ccslice
