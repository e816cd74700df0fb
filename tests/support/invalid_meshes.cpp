// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <limits>

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
}

/// Appends a hex by its VTK corners.
void add_hex(ControlMesh& mesh, const std::array<std::uint32_t, 8>& corners) {
  mesh.cell_kinds.push_back(CellKind::kHex);
  mesh.cell_vertices.insert(mesh.cell_vertices.end(), corners.begin(), corners.end());
}

/// A cube, and a second hex that shares its top and its y = max side: the edge in between has two cells.
ControlMesh two_shared_faces() {
  ControlMesh mesh = cube();  // Vertices are the cube's corners in VTK order.
  mesh.positions.push_back({0, 40, 40});
  mesh.positions.push_back({10, 40, 40});
  add_hex(mesh, {4, 5, 6, 7, 8, 9, 2, 3});
  return mesh;
}

ControlMesh three_cells_on_a_face() {
  ControlMesh mesh = box_mesh(1, 1, 2);
  for (const double x : {2.0, 8.0}) {
    for (const double y : {2.0, 8.0}) mesh.positions.push_back({x, y, 17});
  }
  add_hex(mesh, {4, 5, 6, 7, 12, 14, 15, 13});
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
    add_sharp_features(list);
    return list;
  }();
  return meshes;
}

}  // namespace ccslice::oracle
