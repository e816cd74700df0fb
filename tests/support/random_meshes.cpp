// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/random_meshes.h"

#include <algorithm>
#include <array>
#include <random>

#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kCellMm = 10, kJitterMm = 0.5;

using Random = std::mt19937;

int pick(Random& random, int least, int most) { return least + static_cast<int>(random() % (most - least + 1)); }
double unit(Random& random) { return std::uniform_real_distribution<double>(0, 1)(random); }

void add_random_cell(ControlMesh& mesh, CellKind kind, const std::vector<std::uint32_t>& corners) {
  mesh.cell_kinds.push_back(kind);
  mesh.cell_vertices.insert(mesh.cell_vertices.end(), corners.begin(), corners.end());
}

void drop_unused_vertices(ControlMesh& mesh) {
  std::vector<std::uint32_t> used = mesh.cell_vertices;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<Vec3> positions;
  for (const std::uint32_t v : used) positions.push_back(mesh.positions[v]);
  for (std::uint32_t& v : mesh.cell_vertices) {
    v = static_cast<std::uint32_t>(std::ranges::lower_bound(used, v) - used.begin());
  }
  mesh.positions = std::move(positions);
}

ControlMesh polycube(Random& random) {
  const double fill = 0.3 + 0.6 * unit(random);
  const int nx = pick(random, 1, 4), ny = pick(random, 1, 4), nz = pick(random, 1, 3);
  return box_mesh(nx, ny, nz, kCellMm, [&](int, int, int) { return unit(random) < fill; });
}

struct Link {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> triangles;
};

/// The convex hull of random points on the unit sphere, or what of it faces a random direction.
Link random_link(Random& random) {
  std::normal_distribution<double> normal;
  const auto direction = [&]() -> Vec3 { return Vec3(normal(random), normal(random), normal(random)).normalized(); };
  Link link;
  for (const int n = pick(random, 4, 12); static_cast<int>(link.points.size()) < n;) {
    const Vec3 p = direction();
    const bool apart = std::ranges::all_of(link.points, [&](const Vec3& q) { return (p - q).norm() > 0.55; });
    if (apart || random() % 50 == 0) link.points.push_back(p);
  }
  link.triangles = hull_triangles(link.points);
  if (random() % 2) {
    const Vec3 towards = direction();
    const double least = 0.8 * normal(random);
    std::erase_if(link.triangles, [&](const std::array<int, 3>& t) {
      return (link.points[t[0]] + link.points[t[1]] + link.points[t[2]]).dot(towards) < least;
    });
  }
  return link;
}

ControlMesh tet_star(const Link& link) {
  ControlMesh mesh;
  mesh.positions.push_back(Vec3::Zero());
  for (const Vec3& p : link.points) mesh.positions.push_back(1.4 * kCellMm * p);
  for (const auto& t : link.triangles) {
    std::array<std::uint32_t, 3> v;
    for (int i = 0; i < 3; ++i) v[i] = static_cast<std::uint32_t>(t[i] + 1);
    if (mesh.positions[v[0]].cross(mesh.positions[v[1]]).dot(mesh.positions[v[2]]) < 0) std::swap(v[1], v[2]);
    add_random_cell(mesh, CellKind::kTet, {0, v[0], v[1], v[2]});
  }
  return mesh;
}

ControlMesh terrain(Random& random) {
  const int nx = pick(random, 1, 3), ny = pick(random, 1, 3), nz = pick(random, 1, 2);
  ControlMesh mesh;
  const auto id = [&](int i, int j, int k) { return static_cast<std::uint32_t>(i + (nx + 1) * (j + (ny + 1) * k)); };
  for (int n = 0; n < (nx + 1) * (ny + 1) * (nz + 1); ++n) {
    mesh.positions.push_back(kCellMm * Vec3(n % (nx + 1), n / (nx + 1) % (ny + 1), n / (nx + 1) / (ny + 1)));
  }
  for (int n = 0; n < nx * ny; ++n) {
    const int i = n % nx, j = n / nx, kind = pick(random, 0, 3), height = pick(random, 1, nz);
    for (int k = 0; k < height; ++k) {
      const std::uint32_t a = id(i, j, k), b = id(i + 1, j, k), c = id(i + 1, j + 1, k), d = id(i, j + 1, k);
      const std::uint32_t e = id(i, j, k + 1), f = id(i + 1, j, k + 1), g = id(i + 1, j + 1, k + 1),
                          h = id(i, j + 1, k + 1);
      if (kind == 0) add_random_cell(mesh, CellKind::kHex, {a, b, c, d, e, f, g, h});
      if (kind == 1) add_random_cell(mesh, CellKind::kWedge, {a, b, c, e, f, g});
      if (kind == 1) add_random_cell(mesh, CellKind::kWedge, {a, c, d, e, g, h});
      if (kind == 2) add_random_cell(mesh, CellKind::kWedge, {f, g, h, b, c, d});  // Mirrored on purpose.
      if (kind == 2) add_random_cell(mesh, CellKind::kWedge, {a, b, d, e, f, h});
    }
  }
  return mesh;
}

/// Turns the corner order of about a third of the cells, of whatever kind, into the mirrored one.
void mirror_some(ControlMesh& mesh, Random random) {
  auto corners = mesh.cell_vertices.begin();
  for (const CellKind kind : mesh.cell_kinds) {
    const int count = corner_count(kind);
    if (random() % 3 == 0) {
      const int half = count / 2;
      if (kind == CellKind::kTet) {
        std::iter_swap(corners, corners + 1);
      } else {
        std::swap_ranges(corners, corners + half, corners + half);
      }
    }
    corners += count;
  }
}

ControlMesh shape(RandomKind kind, Random& random) {
  switch (kind) {
    case RandomKind::kPolycube: return polycube(random);
    case RandomKind::kTetStar: return tet_star(random_link(random));
    case RandomKind::kTerrain: return terrain(random);
    default: {
      const Link link = random_link(random);
      return star_mesh(link.points, link.triangles);
    }
  }
}

}  // namespace

ControlMesh random_mesh(RandomKind kind, std::uint32_t seed) {
  Random random(seed);
  ControlMesh mesh = shape(kind, random);
  drop_unused_vertices(mesh);
  const double sharp = random() % 3 == 0 ? 0 : unit(random);
  sharpen(mesh, [&](const Vec3&, const Vec3&) { return unit(random) < sharp; });
  for (const auto& [a, b] : std::vector(mesh.sharp_edges)) {  // Their ends are on the boundary for certain.
    const auto tagged = [&](std::uint32_t v) { return std::ranges::count(mesh.sharp_vertices, v) > 0; };
    if (random() % 16 == 0 && !tagged(a)) mesh.sharp_vertices.push_back(a);
  }
  jitter(mesh, kJitterMm, seed);
  add_random_channels(mesh, 2, seed);
  mirror_some(mesh, Random(seed));
  return mesh;
}

}  // namespace ccslice::oracle
