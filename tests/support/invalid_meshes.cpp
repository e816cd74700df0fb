// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <cstddef>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

ControlMesh cube() { return box_mesh(1, 1, 1); }

/// `mesh` after `change`.
template <class Change>
ControlMesh with(ControlMesh mesh, Change change) {
  change(mesh);
  return mesh;
}

void add_numbers(std::vector<InvalidMesh>& list) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  list.push_back({"nan_position",
                  with(cube(), [&](ControlMesh& m) { m.positions[3].y() = nan; }),
                  ErrorCode::kMeshNonFinite,
                  {3}});
  list.push_back({"infinite_position",
                  with(cube(), [&](ControlMesh& m) { m.positions[5].z() = -infinity; }),
                  ErrorCode::kMeshNonFinite,
                  {5}});
  list.push_back({"nan_channel",
                  with(cube(),
                       [&](ControlMesh& m) {
                         add_random_channels(m, 2, 1);
                         m.channel_values[2 * 6 + 1] = static_cast<float>(nan);
                       }),
                  ErrorCode::kMeshNonFinite,
                  {6}});
  list.push_back({"vertex_out_of_range",
                  with(cube(), [](ControlMesh& m) { m.cell_vertices[2] = 8; }),
                  ErrorCode::kMeshIndexOutOfRange,
                  {0, 8}});
  list.push_back({"sharp_edge_out_of_range",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.sharp_edges.push_back({0, 77});
                       }),
                  ErrorCode::kMeshIndexOutOfRange,
                  {0, 77}});
  list.push_back({"sharp_vertex_out_of_range",
                  with(cube(), [](ControlMesh& m) { m.sharp_vertices.push_back(8); }),
                  ErrorCode::kMeshIndexOutOfRange,
                  {0, 8}});
}

void add_arrays(std::vector<InvalidMesh>& list) {
  list.push_back({"empty", ControlMesh{}, ErrorCode::kMeshEmpty, {}});
  list.push_back({"no_cells",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.cell_kinds.clear();
                         m.cell_vertices.clear();
                       }),
                  ErrorCode::kMeshEmpty,
                  {}});
  list.push_back({"corners_missing",
                  with(cube(), [](ControlMesh& m) { m.cell_vertices.pop_back(); }),
                  ErrorCode::kMeshArrayMismatch,
                  {}});
  list.push_back({"channel_values_missing",
                  with(cube(),
                       [](ControlMesh& m) {
                         add_random_channels(m, 2, 1);
                         m.channel_values.pop_back();
                       }),
                  ErrorCode::kMeshArrayMismatch,
                  {}});
  list.push_back({"channel_named_twice",
                  with(cube(),
                       [](ControlMesh& m) {
                         add_random_channels(m, 2, 1);
                         m.channel_names[1] = m.channel_names[0];
                       }),
                  ErrorCode::kMeshBadChannel,
                  {}});
  list.push_back({"channel_without_name",
                  with(cube(),
                       [](ControlMesh& m) {
                         add_random_channels(m, 1, 1);
                         m.channel_names[0].clear();
                       }),
                  ErrorCode::kMeshBadChannel,
                  {}});
  list.push_back({"cell_region_without_name",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.cell_region_names = {""};
                         m.cell_regions = {0};
                       }),
                  ErrorCode::kMeshBadCellRegion,
                  {}});
  list.push_back({"cell_region_named_twice",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.cell_region_names = {"a", "a"};
                         m.cell_regions = {0};
                       }),
                  ErrorCode::kMeshBadCellRegion,
                  {}});
  list.push_back({"cell_region_unknown",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.cell_region_names = {"a"};
                         m.cell_regions = {1};
                       }),
                  ErrorCode::kMeshBadCellRegion,
                  {0}});
  list.push_back({"cells_without_regions",
                  with(cube(), [](ControlMesh& m) { m.cell_region_names = {"a"}; }),
                  ErrorCode::kMeshArrayMismatch,
                  {}});
  list.push_back({"cell_regions_without_names",
                  with(cube(), [](ControlMesh& m) { m.cell_regions = {0}; }),
                  ErrorCode::kMeshArrayMismatch,
                  {}});
}

/// Appends a cell by its corners.
void add_cell(ControlMesh& mesh, CellKind kind, std::initializer_list<std::uint32_t> corners) {
  mesh.cell_kinds.push_back(kind);
  mesh.cell_vertices.insert(mesh.cell_vertices.end(), corners.begin(), corners.end());
}

/// A cube, and a second hex that shares its top and its y = max side: the edge in between has two cells.
ControlMesh two_shared_faces() {
  ControlMesh mesh = cube();  // Vertices are the cube's corners in VTK order.
  mesh.positions.push_back({0, 40, 40});
  mesh.positions.push_back({10, 40, 40});
  add_cell(mesh, CellKind::kHex, {4, 5, 6, 7, 8, 9, 2, 3});
  return mesh;
}

ControlMesh three_cells_on_a_face() {
  ControlMesh mesh = box_mesh(1, 1, 2);
  for (const double x : {2.0, 8.0}) {
    for (const double y : {2.0, 8.0}) mesh.positions.push_back({x, y, 17});
  }
  add_cell(mesh, CellKind::kHex, {4, 5, 6, 7, 12, 14, 15, 13});
  return mesh;
}

void add_topology(std::vector<InvalidMesh>& list) {
  list.push_back({"repeated_vertex",
                  with(cube(), [](ControlMesh& m) { m.cell_vertices[1] = m.cell_vertices[0]; }),
                  ErrorCode::kMeshRepeatedVertex,
                  {0}});
  list.push_back(
      {"face_in_three_cells", three_cells_on_a_face(), ErrorCode::kMeshNonManifoldFace, {0, 1, 2, 4, 5, 6, 7}});
  list.push_back({"cubes_touch_along_an_edge",
                  box_mesh(2, 2, 1, 10, [](int i, int j, int) { return i == j; }),
                  ErrorCode::kMeshNonManifoldEdge,
                  {0, 1, 2, 6}});
  list.push_back({"cubes_touch_at_a_vertex",
                  box_mesh(2, 2, 2, 10, [](int i, int j, int k) { return i == j && j == k; }),
                  ErrorCode::kMeshNonManifoldVertex,
                  {0, 1, 6}});
  list.push_back({"opposite_octants_missing",
                  box_mesh(2, 2, 2, 10, [](int i, int j, int k) { return i != j || j != k; }),
                  ErrorCode::kMeshNonManifoldVertex,
                  {}});
  list.push_back({"two_shared_faces", two_shared_faces(), ErrorCode::kMeshSharedFaces, {0, 1, 6, 7}});
  list.push_back({"isolated_vertex",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.positions.push_back({50, 0, 0});
                       }),
                  ErrorCode::kMeshIsolatedVertex,
                  {8}});
  list.push_back({"inverted_corner",
                  with(box_mesh(2, 1, 1), [](ControlMesh& m) { m.positions[8] = Vec3(5, -20, 0); }),
                  ErrorCode::kMeshInvertedCell,
                  {1}});
  list.push_back({"valence_too_high", fan_mesh(80, 1, 1), ErrorCode::kMeshValenceTooHigh, {}});
}

constexpr auto kTet = CellKind::kTet, kWedge = CellKind::kWedge;

ControlMesh mesh_of(std::vector<Vec3> positions, CellKind kind,
                    std::initializer_list<std::initializer_list<std::uint32_t>> cells) {
  ControlMesh mesh;
  mesh.positions = std::move(positions);
  for (const auto& corners : cells) add_cell(mesh, kind, corners);
  return mesh;
}

/// A triangle, and points above and below it.
std::vector<Vec3> tet_points() { return {{0, 0, 0}, {12, 0, 0}, {0, 12, 0}, {2, 2, 10}, {3, 3, 14}, {2, 2, -10}}; }

std::vector<Vec3> wedge_points() { return {{0, 0, 0}, {12, 0, 0}, {0, 12, 0}, {0, 0, 12}, {12, 0, 12}, {0, 12, 12}}; }

std::vector<Vec3> first_of(const std::vector<Vec3>& points, std::size_t count) {
  return {points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count)};
}

/// `points` and `more`.
std::vector<Vec3> joined(std::vector<Vec3> points, const std::vector<Vec3>& more) {
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

void add_tets_and_wedges(std::vector<InvalidMesh>& list) {
  const auto repeated = ErrorCode::kMeshRepeatedVertex, shared = ErrorCode::kMeshSharedFaces;
  list.push_back({"tet_repeated_vertex", mesh_of(first_of(tet_points(), 3), kTet, {{0, 1, 2, 2}}), repeated, {0}});
  list.push_back(
      {"wedge_repeated_vertex", mesh_of(first_of(wedge_points(), 5), kWedge, {{0, 1, 2, 3, 4, 2}}), repeated, {0}});
  list.push_back({"triangle_in_three_cells",
                  mesh_of(tet_points(), kTet, {{0, 1, 2, 3}, {0, 2, 1, 5}, {0, 1, 2, 4}}),
                  ErrorCode::kMeshNonManifoldFace,
                  {0, 1, 2}});
  list.push_back(
      {"tet_given_twice", mesh_of(first_of(tet_points(), 4), kTet, {{0, 1, 2, 3}, {1, 0, 3, 2}}), shared, {0, 1}});
  list.push_back({"wedges_share_two_faces",
                  mesh_of(joined(wedge_points(), {{0, 20, 12}}), kWedge, {{0, 1, 2, 3, 4, 5}, {0, 1, 2, 3, 4, 6}}),
                  shared,
                  {0, 1}});
  list.push_back(
      {"tets_touch_along_an_edge",
       mesh_of(joined(first_of(tet_points(), 4), {{0, -12, 0}, {2, -2, -10}}), kTet, {{0, 1, 2, 3}, {0, 1, 4, 5}}),
       ErrorCode::kMeshNonManifoldEdge,
       {0, 1}});
  list.push_back({"tets_touch_at_a_vertex",
                  mesh_of(joined(first_of(tet_points(), 4), {{-12, 0, 0}, {0, -12, 0}, {-2, -2, -10}}), kTet,
                          {{0, 1, 2, 3}, {0, 4, 5, 6}}),
                  ErrorCode::kMeshNonManifoldVertex,
                  {0}});
  list.push_back({"quadrilateral_meets_two_triangles",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.positions.push_back({5, 5, 20});
                         add_cell(m, kTet, {4, 5, 6, 8});
                         add_cell(m, kTet, {4, 6, 7, 8});
                       }),
                  ErrorCode::kMeshNonManifoldEdge,
                  {4, 5, 6, 7}});
  list.push_back({"edge_inside_tets_sharp",
                  with(tiny_mesh("cube_of_tets"),
                       [](ControlMesh& m) {
                         m.sharp_edges = {{0, 7}};
                       }),
                  ErrorCode::kMeshBadSharpFeature,
                  {0, 7}});
}

void add_inverted_tets_and_wedges(std::vector<InvalidMesh>& list) {
  const auto inverted = ErrorCode::kMeshInvertedCell;
  const auto below = [](ControlMesh& m) { m.positions[5].z() = -12; };
  list.push_back(
      {"flat_tet", mesh_of({{0, 0, 0}, {12, 0, 0}, {0, 12, 0}, {9, 9, 0}}, kTet, {{0, 1, 2, 3}}), inverted, {0}});
  list.push_back({"tets_on_the_same_side",
                  mesh_of(first_of(tet_points(), 5), kTet, {{0, 1, 2, 3}, {0, 1, 2, 4}}),
                  inverted,
                  {0, 1}});
  list.push_back({"tets_on_the_same_side_one_mirrored",
                  mesh_of(first_of(tet_points(), 5), kTet, {{0, 1, 2, 3}, {0, 2, 1, 4}}),
                  inverted,
                  {0, 1}});
  list.push_back({"wedge_corner_below_its_base",
                  with(mesh_of(wedge_points(), kWedge, {{0, 1, 2, 3, 4, 5}}), below),
                  inverted,
                  {0}});
  list.push_back({"wedge_corner_below_its_base_mirrored",
                  with(mesh_of(wedge_points(), kWedge, {{3, 4, 5, 0, 1, 2}}), below),
                  inverted,
                  {0}});
  list.push_back({"wedge_twisted", mesh_of(wedge_points(), kWedge, {{0, 1, 2, 3, 5, 4}}), inverted, {0}});
  list.push_back({"roof_inside_its_hex",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.positions.push_back({0, 5, 5});
                         m.positions.push_back({10, 5, 5});
                         add_cell(m, kWedge, {4, 7, 8, 5, 6, 9});
                       }),
                  inverted,
                  {0, 1}});
}

void add_sharp_features(std::vector<InvalidMesh>& list) {
  const auto bad = ErrorCode::kMeshBadSharpFeature;
  list.push_back({"sharp_edge_is_a_diagonal",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.sharp_edges.push_back({0, 2});
                       }),
                  bad,
                  {0, 2}});
  list.push_back({"sharp_edge_twice",
                  with(cube(),
                       [](ControlMesh& m) {
                         m.sharp_edges = {{0, 1}, {1, 0}};
                       }),
                  bad,
                  {0, 1}});
  list.push_back({"sharp_vertex_twice", with(cube(), [](ControlMesh& m) { m.sharp_vertices = {4, 4}; }), bad, {4}});
  list.push_back({"sharp_vertex_inside",
                  with(box_mesh(2, 2, 2),
                       [](ControlMesh& m) {
                         for (std::uint32_t v = 0; v < m.vertex_count(); ++v) {
                           if ((m.positions[v] - Vec3(10, 10, 10)).norm() < 1e-9) m.sharp_vertices.push_back(v);
                         }
                       }),
                  bad,
                  {}});
  list.push_back({"sharp_edge_inside",
                  with(fan_mesh(5, 1, 1),
                       [](ControlMesh& m) {
                         std::array<std::uint32_t, 2> edge{};
                         for (std::uint32_t v = 0; v < m.vertex_count(); ++v) {
                           if (m.positions[v].head<2>().norm() < 1e-9) edge[m.positions[v].z() > 5] = v;
                         }
                         m.sharp_edges.push_back(edge);
                       }),
                  bad,
                  {}});
}

}  // namespace

const std::vector<InvalidMesh>& invalid_meshes() {
  static const std::vector<InvalidMesh> meshes = [] {
    std::vector<InvalidMesh> list;
    add_numbers(list);
    add_arrays(list);
    add_topology(list);
    add_tets_and_wedges(list);
    add_inverted_tets_and_wedges(list);
    add_sharp_features(list);
    return list;
  }();
  return meshes;
}

}  // namespace ccslice::oracle
