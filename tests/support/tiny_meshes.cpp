// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/tiny_meshes.h"

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace ccslice::oracle {
namespace {

constexpr double kTinyJitterMm = 0.6;

class Catalogue {
 public:
  /// Jittered, with random channels.
  void add(const std::string& name, ControlMesh mesh, double jitter_mm = kTinyJitterMm) {
    const auto seed = static_cast<std::uint32_t>(meshes_.size() + 1);
    jitter(mesh, jitter_mm, seed);
    add_random_channels(mesh, 2, seed);
    meshes_.push_back({name, std::move(mesh)});
  }
  std::vector<TinyMesh> take() { return std::move(meshes_); }

 private:
  std::vector<TinyMesh> meshes_;
};

ControlMesh cells_of(CellKind kind, std::vector<Vec3> positions, std::vector<std::uint32_t> vertices) {
  ControlMesh mesh;
  mesh.positions = std::move(positions);
  mesh.cell_kinds.assign(vertices.size() / corner_count(kind), kind);
  mesh.cell_vertices = std::move(vertices);
  return mesh;
}

/// Points on the unit sphere and the triangles of their convex hull.
struct Sphere {
  std::vector<Vec3> points;
  std::vector<std::array<int, 3>> triangles;
};

Sphere hull(std::vector<Vec3> points) {
  for (Vec3& p : points) p.normalize();
  return {points, hull_triangles(points)};
}

std::vector<Vec3> ring(int n, double height, double phase = 0) {
  std::vector<Vec3> points;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + phase) / n;
    points.push_back({std::cos(a), std::sin(a), height});
  }
  return points;
}

/// Two poles and rings in between.
std::vector<Vec3> with_poles(const std::vector<std::vector<Vec3>>& rings) {
  std::vector<Vec3> points = {{0, 0, 1}, {0, 0, -1}};
  for (const auto& r : rings) points.insert(points.end(), r.begin(), r.end());
  return points;
}

Sphere tetrahedron() { return hull({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}); }
Sphere octahedron() { return hull(with_poles({ring(4, 0)})); }
Sphere icosahedron() { return hull(with_poles({ring(5, 0.5), ring(5, -0.5, 0.5)})); }
Sphere capped_octahedron() {
  return hull({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {1, 1, 1}});
}

ControlMesh star(const Sphere& sphere) { return star_mesh(sphere.points, sphere.triangles); }

/// The star's tetrahedra themselves.
ControlMesh tet_star(const Sphere& sphere) {
  std::vector<Vec3> positions = {Vec3::Zero()};
  for (const Vec3& p : sphere.points) positions.push_back(14 * p);
  std::vector<std::uint32_t> vertices;
  for (const auto& t : sphere.triangles) {
    std::array<std::uint32_t, 3> v;
    for (int i = 0; i < 3; ++i) v[i] = t[i] + 1;
    if (positions[v[0]].cross(positions[v[1]]).dot(positions[v[2]]) < 0) std::swap(v[1], v[2]);
    vertices.insert(vertices.end(), {0, v[0], v[1], v[2]});
  }
  return cells_of(CellKind::kTet, positions, vertices);
}

/// A boundary vertex: the hexes of some of a closed star's triangles.
ControlMesh partial_star(Sphere sphere, const std::function<bool(const Vec3&)>& keep_towards) {
  std::erase_if(sphere.triangles, [&](const auto& t) {
    return !keep_towards(sphere.points[t[0]] + sphere.points[t[1]] + sphere.points[t[2]]);
  });
  return star(sphere);
}

/// A cube inside a cube, joined by six hexes: eight extraordinary vertices next to each other.
ControlMesh cube_in_cube() {
  std::vector<Vec3> positions;
  for (const double half : {5.0, 14.0}) {
    for (int b = 0; b < 8; ++b) positions.push_back(half * Vec3(b & 1 ? 1 : -1, b & 2 ? 1 : -1, b & 4 ? 1 : -1));
  }
  std::vector<std::uint32_t> vertices = {0, 1, 3, 2, 4, 5, 7, 6};
  const std::array<std::array<std::uint32_t, 4>, 6> outward = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& face : outward) {
    for (const std::uint32_t v : face) vertices.push_back(v);
    for (const std::uint32_t v : face) vertices.push_back(v + 8);
  }
  return cells_of(CellKind::kHex, positions, vertices);
}

ControlMesh single_tet() {
  return cells_of(CellKind::kTet, {{0, 0, 0}, {12, 0, 0}, {0, 12, 0}, {0, 0, 12}}, {0, 1, 2, 3});
}

ControlMesh single_wedge() {
  return cells_of(CellKind::kWedge, {{0, 0, 0}, {12, 0, 0}, {0, 12, 0}, {0, 0, 12}, {12, 0, 12}, {0, 12, 12}},
                  {0, 1, 2, 3, 4, 5});
}

/// n wedges round an edge.
ControlMesh wedge_fan(int n, int layers) {
  std::vector<Vec3> positions;
  for (int layer = 0; layer <= layers; ++layer) {
    positions.push_back({0, 0, 10.0 * layer});
    for (const Vec3& p : ring(n, 0)) positions.push_back(12 * p + Vec3(0, 0, 10.0 * layer));
  }
  std::vector<std::uint32_t> vertices;
  const std::uint32_t up = n + 1;
  for (std::uint32_t layer = 0; layer < static_cast<std::uint32_t>(layers); ++layer) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(n); ++i) {
      const std::uint32_t c = layer * up, a = c + 1 + i, b = c + 1 + (i + 1) % n;
      vertices.insert(vertices.end(), {c, a, b, c + up, a + up, b + up});
    }
  }
  return cells_of(CellKind::kWedge, positions, vertices);
}

/// A cube in six tetrahedra round its diagonal.
ControlMesh cube_of_tets() {
  std::vector<Vec3> positions;
  for (int b = 0; b < 8; ++b) positions.push_back(12 * Vec3(b & 1, b >> 1 & 1, b >> 2 & 1));
  return cells_of(CellKind::kTet, positions, {0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7});
}

/// A hex, a wedge as a roof on it, and a tetrahedron on the roof's gable.
ControlMesh house_with_gable() {
  ControlMesh mesh = box_mesh(1, 1, 1, 12);  // 0..7 by corner bits' order of creation: VTK corners.
  const auto corner = [&](int x, int y, int z) {
    for (std::uint32_t v = 0; v < 8; ++v) {
      if ((mesh.positions[v] - 12 * Vec3(x, y, z)).norm() < 1e-9) return v;
    }
    throw std::logic_error("no such corner");
  };
  mesh.positions.push_back({0, 6, 20});
  mesh.positions.push_back({12, 6, 20});
  mesh.positions.push_back({22, 6, 14});
  mesh.cell_kinds.push_back(CellKind::kWedge);
  mesh.cell_kinds.push_back(CellKind::kTet);
  for (const std::uint32_t v : {corner(0, 0, 1), corner(0, 1, 1), 8u, corner(1, 0, 1), corner(1, 1, 1), 9u}) {
    mesh.cell_vertices.push_back(v);
  }
  for (const std::uint32_t v : {corner(1, 0, 1), corner(1, 1, 1), 9u, 10u}) mesh.cell_vertices.push_back(v);
  return mesh;
}

bool near(double a, double b) { return std::abs(a - b) < 1e-6; }
using SharpTest = std::function<bool(const Vec3&, const Vec3&)>;
/// Both ends have these coordinates (a negative one: any).
SharpTest on_line(double x, double y, double z) {
  return [=](const Vec3& a, const Vec3& b) {
    const auto fits = [&](const Vec3& p) {
      return (x < 0 || near(p.x(), x)) && (y < 0 || near(p.y(), y)) && (z < 0 || near(p.z(), z));
    };
    return fits(a) && fits(b);
  };
}

ControlMesh sharpened(ControlMesh mesh, const SharpTest& keep) {
  sharpen(mesh, keep);
  return mesh;
}

ControlMesh sharpened_by_cells(ControlMesh mesh, std::size_t cells) {
  sharpen_by_cells(mesh, cells);
  return mesh;
}

ControlMesh tagged(ControlMesh mesh, std::vector<Vec3> corners) {
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    for (const Vec3& p : corners) {
      if ((mesh.positions[v] - p).norm() < 1e-6) mesh.sharp_vertices.push_back(v);
    }
  }
  return mesh;
}

bool not_octant(int i, int j, int k, int half) { return !(i >= half && j >= half && k >= half); }
bool not_quadrant(int i, int j, int, int half) { return !(i >= half && j >= half); }
template <class F>
KeepCell halves(F f, int half) {
  return [=](int i, int j, int k) { return f(i, j, k, half); };
}

void add_regular(Catalogue& c) {
  c.add("single_hex", box_mesh(1, 1, 1));
  c.add("box_2", box_mesh(2, 2, 2));
  c.add("box_3", box_mesh(3, 3, 3));
  c.add("box_4", box_mesh(4, 4, 4));
  c.add("plate_3x3x1", box_mesh(3, 3, 1));
  c.add("plate_4x4x1", box_mesh(4, 4, 1));
  c.add("strut_1x1x3", box_mesh(1, 1, 3));
  c.add("strut_1x1x5", box_mesh(1, 1, 5));
  c.add("hollow_cube", box_mesh(3, 3, 3, 10, [](int i, int j, int k) { return i != 1 || j != 1 || k != 1; }));
  c.add("cross_of_seven",
        box_mesh(3, 3, 3, 10, [](int i, int j, int k) { return (i == 1) + (j == 1) + (k == 1) >= 2; }));
  c.add("frame_of_eight", box_mesh(3, 3, 1, 10, [](int i, int j, int) { return i != 1 || j != 1; }));
}

void add_extraordinary_edges(Catalogue& c) {
  for (const int n : {3, 5, 6, 7}) {
    for (const int layers : {1, 2, 3}) {
      c.add("edge_valence_" + std::to_string(n) + "_layers_" + std::to_string(layers), fan_mesh(n, 1, layers));
    }
    c.add("edge_valence_" + std::to_string(n) + "_inside", fan_mesh(n, 2, 2));
  }
  c.add("edge_valence_8", fan_mesh(8, 1, 2));
}

void add_extraordinary_vertices(Catalogue& c) {
  c.add("vertex_link_tetrahedron", star(tetrahedron()));
  c.add("vertex_link_tetrahedron_inside", refined_mesh(tet_star(tetrahedron())), 0.15);
  c.add("vertex_link_octahedron", star(octahedron()));
  c.add("vertex_link_icosahedron", star(icosahedron()));
  c.add("vertex_link_capped_octahedron", star(capped_octahedron()));
  c.add("vertex_link_bipyramid_3", star(hull(with_poles({ring(3, 0)}))));
  c.add("vertex_link_bipyramid_5", star(hull(with_poles({ring(5, 0)}))));
  c.add("vertex_link_gyroelongated_4", star(hull(with_poles({ring(4, 0.5), ring(4, -0.5, 0.5)}))));
  c.add("vertex_link_gyroelongated_6", star(hull(with_poles({ring(6, 0.5), ring(6, -0.5, 0.5)}))));
  c.add("vertices_adjacent_cube_in_cube", cube_in_cube());
  c.add("vertex_refined_cube_in_cube", refined_mesh(cube_in_cube()), 0.3);
}

void add_boundary_edges(Catalogue& c) {
  const std::array<double, 4> degrees = {90, 180, 270, 330};
  for (int k = 1; k <= 4; ++k) {
    c.add("boundary_edge_" + std::to_string(k) + "_hexes", fan_mesh(k, 1, 1, degrees[k - 1]));
    c.add("boundary_edge_" + std::to_string(k) + "_hexes_long", fan_mesh(k, 2, 3, degrees[k - 1]));
  }
  c.add("concave_corner", box_mesh(2, 2, 2, 10, halves(not_octant, 1)));
  c.add("concave_corner_4", box_mesh(4, 4, 4, 10, halves(not_octant, 2)));
  c.add("concave_edge", box_mesh(4, 4, 2, 10, halves(not_quadrant, 2)));
  c.add("edge_valence_3_meets_corner", partial_star(tetrahedron(), [](const Vec3& d) { return d.sum() < 0.1; }));
  c.add("edge_valence_5_meets_face", partial_star(icosahedron(), [](const Vec3& d) { return d.z() > 1.2; }));
  c.add("edges_meet_boundary", partial_star(icosahedron(), [](const Vec3& d) { return d.z() < 1.2; }));
  c.add("edge_meets_convex_edge", partial_star(capped_octahedron(), [](const Vec3& d) { return d.x() + d.y() > 0; }));
}

void add_sharp(Catalogue& c) {
  const double any = -1;
  c.add("sharp_1_hex", sharpened(box_mesh(3, 3, 3), on_line(any, 0, 0)));
  c.add("sharp_1_hex_chain_end", sharpened(box_mesh(3, 3, 3), [](const Vec3& a, const Vec3& b) {
          return on_line(-1, 0, 0)(a, b) && a.x() < 25 && b.x() < 25;
        }));
  c.add("sharp_2_hexes", sharpened(box_mesh(4, 4, 2), on_line(any, 20, 20)));
  c.add("sharp_2_hexes_dart", sharpened(box_mesh(4, 4, 2), [](const Vec3& a, const Vec3& b) {
          return on_line(-1, 20, 20)(a, b) && a.x() < 25 && b.x() < 25;
        }));
  c.add("sharp_2_hexes_turn", sharpened(box_mesh(4, 4, 2), [](const Vec3& a, const Vec3& b) {
          return (on_line(-1, 20, 20)(a, b) && a.x() < 25 && b.x() < 25) ||
                 (on_line(20, -1, 20)(a, b) && a.y() < 25 && b.y() < 25);
        }));
  c.add("sharp_3_hexes", sharpened(box_mesh(4, 4, 3, 10, halves(not_quadrant, 2)), on_line(20, 20, any)));
  c.add("sharp_4_hexes", sharpened(fan_mesh(4, 2, 2, 330), on_line(0, 0, any)));
  c.add("sharp_corner", sharpened(box_mesh(3, 3, 3), [](const Vec3& a, const Vec3& b) {
          return on_line(-1, 0, 0)(a, b) || on_line(0, -1, 0)(a, b) || on_line(0, 0, -1)(a, b);
        }));
  c.add("sharp_two_at_corner", sharpened(box_mesh(3, 3, 3), [](const Vec3& a, const Vec3& b) {
          return on_line(-1, 0, 0)(a, b) || on_line(0, -1, 0)(a, b);
        }));
  c.add("sharp_concave_corner", sharpened_by_cells(box_mesh(4, 4, 4, 10, halves(not_octant, 2)), 3));
  c.add("sharp_box", sharpened_by_cells(box_mesh(3, 3, 3), 1));
  c.add("sharp_box_straight", sharpened_by_cells(box_mesh(3, 2, 2), 1), 0);
  c.add("sharp_plate", sharpened_by_cells(box_mesh(4, 3, 1), 1));
  c.add("sharp_single_hex", sharpened_by_cells(box_mesh(1, 1, 1), 1));
  c.add("sharp_cross",
        sharpened_by_cells(
            box_mesh(3, 3, 3, 10, [](int i, int j, int k) { return (i == 1) + (j == 1) + (k == 1) >= 2; }), 1));
  c.add("sharp_rim_edge_valence_5", sharpened_by_cells(fan_mesh(5, 2, 2), 1));
  c.add("tagged_corners", tagged(box_mesh(3, 3, 3), {{0, 0, 0}, {10, 10, 30}, {30, 30, 10}}));
  c.add("tagged_on_sharp", tagged(sharpened_by_cells(box_mesh(3, 3, 3), 1), {{10, 0, 0}, {30, 30, 20}}));
}

void add_mixed(Catalogue& c) {
  c.add("single_tet", single_tet());
  c.add("single_wedge", single_wedge());
  c.add("wedges_round_edge_5", wedge_fan(5, 2));
  c.add("tets_round_vertex_octahedron", tet_star(octahedron()));
  c.add("tets_round_vertex_icosahedron", tet_star(icosahedron()));
  c.add("cube_of_tets", cube_of_tets());
  c.add("hex_wedge_tet", house_with_gable());
  c.add("sharp_tet", sharpened(single_tet(), [](const Vec3&, const Vec3&) { return true; }));
  c.add("sharp_hex_wedge_tet", sharpened_by_cells(house_with_gable(), 1));
}

}  // namespace

const std::vector<TinyMesh>& tiny_meshes() {
  static const std::vector<TinyMesh> meshes = [] {
    Catalogue catalogue;
    add_regular(catalogue);
    add_extraordinary_edges(catalogue);
    add_extraordinary_vertices(catalogue);
    add_boundary_edges(catalogue);
    add_sharp(catalogue);
    add_mixed(catalogue);
    return catalogue.take();
  }();
  return meshes;
}

const ControlMesh& tiny_mesh(const std::string& name) {
  for (const TinyMesh& tiny : tiny_meshes()) {
    if (tiny.name == name) return tiny.mesh;
  }
  throw std::logic_error("no tiny mesh called " + name);
}

}  // namespace ccslice::oracle
