// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The oracle's own proof: closed forms that the subdivision rules must reproduce.

#include "tests/support/brute_force.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

struct Level {
  BruteMesh mesh;
  BruteTopology topology;
};

Level refined(const ControlMesh& control, int levels) {
  Level level{to_brute_mesh(control), {}};
  level.topology = build_topology(level.mesh.cells, level.mesh.vertex_count());
  for (int i = 0; i < levels; ++i) {
    level.mesh = refine(level.mesh, level.topology).mesh;
    level.topology = build_topology(level.mesh.cells, level.mesh.vertex_count());
  }
  return level;
}

/// Calls f(cell, corner bits, parameter in the root's frame, vertex).
template <class F>
void for_each_corner(const BruteMesh& mesh, F f) {
  for (const BruteCell& cell : mesh.cells) {
    for (int b = 0; b < 8; ++b) {
      Vec3 uvw;
      for (int d = 0; d < 3; ++d) uvw[d] = std::ldexp(cell.from.ijk[d] + (b >> d & 1), -cell.from.level);
      f(cell, b, uvw, cell.v[kVtkCorner[b]]);
    }
  }
}

/// Values of the uniform cubic B-spline with control points f(-1), f(0), f(1), f(2) at u.
double spline(const std::array<double, 4>& f, double u) {
  const double v = 1 - u;
  return (v * v * v * f[0] + (4 - 6 * u * u + 3 * u * u * u) * f[1] + (4 - 6 * v * v + 3 * v * v * v) * f[2] +
          u * u * u * f[3]) /
         6;
}

TEST(BruteForce, ReproducesABoxWithAllEdgesSharp) {
  ControlMesh box = box_mesh(3, 2, 2);
  sharpen_by_cells(box, 1);
  const Level level = refined(box, 3);
  for_each_corner(level.mesh, [&](const BruteCell& cell, int, const Vec3& uvw, std::uint32_t v) {
    const Vec3 expected = box.positions[box.cell_vertices[8 * cell.from.control_cell]] + 10 * uvw;
    EXPECT_LT((limit_point(level.mesh, level.topology, v).head<3>() - expected).norm(), 1e-12);
  });
}

TEST(BruteForce, ReproducesALinearFieldInside) {
  const ControlMesh box = box_mesh(4, 4, 4);
  const Level level = refined(box, 2);
  int checked = 0;
  for_each_corner(level.mesh, [&](const BruteCell& cell, int, const Vec3& uvw, std::uint32_t v) {
    const Vec3 p = box.positions[box.cell_vertices[8 * cell.from.control_cell]] + 10 * uvw;
    if (p.minCoeff() < 10 || p.maxCoeff() > 30) return;
    ++checked;
    EXPECT_LT((limit_point(level.mesh, level.topology, v).head<3>() - p).norm(), 1e-12);
  });
  EXPECT_GT(checked, 100);
}

TEST(BruteForce, AgreesWithTheTricubicSplineWithPhantoms) {
  // All edges sharp: every cell is regular, with a phantom layer P(-1) = 2 P(0) - P(1) on each side.
  ControlMesh box = box_mesh(3, 3, 3);
  sharpen_by_cells(box, 1);
  const auto field = [](double i, double j, double k) { return 10 * i + 3 * j * j + i * j * k - k * k * k; };
  for (Vec3& p : box.positions) p.x() = field(p.x() / 10, p.y() / 10, p.z() / 10);
  const auto line = [](const auto& f, int cell, double u) {
    const auto at = [&](int i) { return i < 0 ? 2 * f(0) - f(1) : i > 3 ? 2 * f(3) - f(2) : f(i); };
    return spline({at(cell - 1), at(cell), at(cell + 1), at(cell + 2)}, u);
  };
  const Level level = refined(box, 2);
  for_each_corner(level.mesh, [&](const BruteCell& cell, int, const Vec3& u, std::uint32_t v) {
    const int c = static_cast<int>(cell.from.control_cell), ci = c % 3, cj = c / 3 % 3, ck = c / 9;
    const double expected = line(
        [&](int k) {
          return line([&](int j) { return line([&](int i) { return field(i, j, k); }, ci, u[0]); }, cj, u[1]);
        },
        ck, u[2]);
    EXPECT_NEAR(limit_point(level.mesh, level.topology, v)[0], expected, 1e-11);
  });
}

TEST(BruteForce, KeepsDataConstantAlongAnExtraordinaryEdge) {
  for (const int n : {3, 5, 6, 7}) {
    ControlMesh fan = fan_mesh(n, 2, 5);
    sharpen_by_cells(fan, 1);
    fan.channel_names = {"c"};
    for (const Vec3& p : fan.positions)
      fan.channel_values.push_back(static_cast<float>(std::sin(p.x()) + p.y() * p.y()));
    const Level level = refined(fan, 2);
    std::map<std::pair<std::uint32_t, std::array<int, 2>>, double> first;
    const auto cells_a_layer = static_cast<std::uint32_t>(fan.cell_count() / 5);
    for_each_corner(level.mesh, [&](const BruteCell& cell, int, const Vec3& uvw, std::uint32_t v) {
      if (!has_limit_mask(level.mesh, level.topology, v)) return;
      const std::array<int, 2> uv = {int(uvw[0] * 4), int(uvw[1] * 4)};
      const double value = limit_point(level.mesh, level.topology, v)[3];
      const auto [it, added] = first.try_emplace({cell.from.control_cell % cells_a_layer, uv}, value);
      EXPECT_NEAR(value, it->second, 1e-12) << n;
    });
  }
}

TEST(BruteForce, RefiningTheStarAgreesWithTheMasks) {
  // A mask of level k and the same vertex's mask of level k + 1 are two ways to the same limit.
  for (const std::string name : {"box_2", "edge_valence_5_layers_2", "concave_corner", "sharp_1_hex", "tagged_corners",
                                 "sharp_2_hexes_turn", "vertex_link_capped_octahedron", "hex_wedge_tet"}) {
    const Level coarse = refined(tiny_mesh(name), 1);
    const Level fine = refined(tiny_mesh(name), 2);
    for (std::uint32_t v = 0; v < coarse.mesh.vertex_count(); ++v) {
      const PointValue a = limit_point(coarse.mesh, coarse.topology, v), b = limit_point(fine.mesh, fine.topology, v);
      EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 2e-13) << name << " vertex " << v;
    }
  }
}

TEST(BruteForce, OneRingsAgreeWithTheWholeMesh) {
  for (const TinyMesh& tiny : tiny_meshes()) {
    if (tiny.mesh.cell_count() > 30) continue;
    const Level coarse = refined(tiny.mesh, 0);
    const bool hexes = std::ranges::all_of(tiny.mesh.cell_kinds, [](CellKind k) { return k == CellKind::kHex; });
    const Level fine = refined(tiny.mesh, 2);
    std::size_t next = 0;
    for (std::uint32_t c = 0; c < tiny.mesh.cell_count(); ++c) {
      const int children = hexes ? 8 : corner_count(tiny.mesh.cell_kinds[c]);
      const OneRing ring = OneRing(coarse.mesh, coarse.topology, c).child(children - 1).child(3);
      next += 8 * children;
      const BruteCell& cell = fine.mesh.cells[next - 8 + 3];
      EXPECT_EQ(cell.from.control_cell, c);
      EXPECT_EQ(ring.focus().from.ijk, cell.from.ijk);
      EXPECT_EQ(ring.focus().from.child, cell.from.child);
      for (int i = 0; i < 8; ++i) {
        const PointValue difference = ring.limit_at_corner(i) - limit_point(fine.mesh, fine.topology, cell.v[i]);
        EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-13) << tiny.name << " cell " << c;
      }
    }
  }
}

TEST(BruteForce, OneRingsGoDownToTinyParameters) {
  const ControlMesh& mesh = tiny_mesh("vertex_link_icosahedron");
  const Level level = refined(mesh, 0);
  OneRing ring(level.mesh, level.topology, 7);
  const PointValue limit = ring.limit_at_corner(0);
  for (int k = 0; k < 16; ++k) ring = ring.child(0);
  EXPECT_EQ(ring.focus().from.level, 16);
  EXPECT_LT((ring.limit_at_corner(0) - limit).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((ring.limit_at_corner(6) - limit).cwiseAbs().maxCoeff(), 1e-2);
  EXPECT_GT((ring.limit_at_corner(6) - limit).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BruteForce, ACutLeavesNoWrongValueBehind) {
  const ControlMesh box = box_mesh(3, 3, 3);
  const Level level = refined(box, 0);
  const OneRing corner(level.mesh, level.topology, 0);
  EXPECT_EQ(corner.mesh().cells.size(), 8u);
  int known = 0, unknown = 0;
  for (std::uint32_t v = 0; v < corner.mesh().vertex_count(); ++v) {
    const bool complete = corner.mesh().position(v).maxCoeff() < 15;
    EXPECT_EQ(corner.topology().vertex_complete(v), complete);
    EXPECT_EQ(limit_point(corner.mesh(), corner.topology(), v).allFinite(), complete);
    ++(complete ? known : unknown);
  }
  EXPECT_EQ(known, 8);
  EXPECT_EQ(unknown, 19);
}

}  // namespace
}  // namespace ccslice::oracle
