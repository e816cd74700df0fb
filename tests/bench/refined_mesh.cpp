// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/refined_mesh.h"

#include <array>
#include <cstddef>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/refine.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::bench {
namespace {

/// Positions and channels of all vertices, one after the other.
std::vector<double> points_of(const ControlMesh& mesh) {
  const std::size_t channels = mesh.channel_count();
  std::vector<double> points;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    for (const double x : mesh.positions[v]) points.push_back(x);
    for (std::size_t c = 0; c < channels; ++c) points.push_back(mesh.channel_values[v * channels + c]);
  }
  return points;
}

void set_points(const std::vector<double>& points, ControlMesh& mesh) {
  const std::size_t dimension = 3 + mesh.channel_count();
  mesh.positions.clear();
  mesh.channel_values.clear();
  for (std::size_t at = 0; at < points.size(); at += dimension) {
    mesh.positions.push_back(Vec3::Map(points.data() + at));
    for (std::size_t c = 3; c < dimension; ++c) mesh.channel_values.push_back(static_cast<float>(points[at + c]));
  }
}

void set_cells(const CellComplex& complex, ControlMesh& mesh) {
  mesh.cell_kinds.assign(complex.cell_count(), CellKind::kHex);
  mesh.cell_vertices.clear();
  for (const CellId cell : complex.cells()) {
    const std::span<const VertexId> corners = complex.cell_vertices(cell);
    for (std::uint8_t vtk = 0; vtk < 8; ++vtk) mesh.cell_vertices.push_back(corners[vtk_to_bits(vtk)]);
  }
  mesh.sharp_edges.clear();
  for (const EdgeId edge : complex.edges()) {
    if (!complex.edge_sharp(edge)) continue;
    const auto [a, b] = complex.edge_vertices(edge);
    mesh.sharp_edges.push_back({a, b});
  }
  mesh.sharp_vertices.clear();
  for (const VertexId vertex : complex.vertices()) {
    if (complex.vertex_sharp(vertex)) mesh.sharp_vertices.push_back(vertex);
  }
}

void refine_once(ControlMesh& mesh) {
  const CellComplex complex = make_cell_complex(mesh);
  const std::vector<CellId> cells = complex.cells().to_vector();
  const Refinement refined = refine(complex, cells);
  const std::size_t dimension = 3 + mesh.channel_count();
  const std::vector<double> points = points_of(mesh);
  std::vector<double> children(refined.stencils.rows() * dimension);
  refined.stencils.apply(0, refined.stencils.rows(), points.data(), dimension, children.data());
  set_points(children, mesh);
  set_cells(refined.complex, mesh);
}

}  // namespace

ControlMesh refine_mesh(const ControlMesh& mesh, int times) {
  ControlMesh result = mesh;
  for (int i = 0; i < times; ++i) refine_once(result);
  return result;
}

ControlMesh stack_meshes(const ControlMesh& mesh, int count, double distance_mm) {
  ControlMesh stack = mesh;
  for (int copy = 1; copy < count; ++copy) oracle::append_mesh(stack, mesh, Vec3(0, 0, copy * distance_mm));
  return stack;
}

}  // namespace ccslice::bench
