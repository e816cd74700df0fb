// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refined_mesh.h"

#include <cstddef>
#include <span>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/limit_masks.h"
#include "core/subdivision/refine.h"

namespace ccslice {
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

/// The regions of the cells' children.
void hand_down_regions(ControlMesh& mesh) {
  if (mesh.cell_regions.empty()) return;
  std::vector<std::uint8_t> children;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    children.insert(children.end(), static_cast<std::size_t>(corner_count(mesh.cell_kinds[c])), mesh.cell_regions[c]);
  }
  mesh.cell_regions = std::move(children);
}

/// Child points, or limit points, of all vertices.
std::vector<double> apply(const Stencils& stencils, const ControlMesh& mesh) {
  const std::size_t dimension = 3 + mesh.channel_count();
  const std::vector<double> points = points_of(mesh);
  std::vector<double> result(stencils.rows() * dimension);
  stencils.apply(0, stencils.rows(), points.data(), dimension, result.data());
  return result;
}

std::size_t descendants(CellKind kind, int times) {
  return times == 0 ? 1 : static_cast<std::size_t>(corner_count(kind)) << 3 * (times - 1);
}

}  // namespace

ControlMesh refine_mesh(const ControlMesh& mesh, int times, const CancellationToken& cancel) {
  ControlMesh result = mesh;
  result.missed_vertices.clear();
  for (int i = 0; i < times; ++i) {
    hand_down_regions(result);
    const CellComplex complex = make_cell_complex(result, cancel);
    const Refinement refined = refine(complex, complex.cells().to_vector(), cancel);
    set_points(apply(refined.stencils, result), result);
    set_cells(refined.complex, result);
  }
  return result;
}

ControlMesh mesh_of_limit_points(const ControlMesh& mesh, const CancellationToken& cancel) {
  ControlMesh result = mesh;
  result.interpolating = false;
  result.missed_vertices.clear();
  if (mesh.as_meshed) return result;
  set_points(apply(limit_masks(make_cell_complex(mesh, cancel), cancel), mesh), result);
  return result;
}

std::size_t refined_cell_count(const ControlMesh& mesh, int times) {
  std::size_t count = 0;
  for (const CellKind kind : mesh.cell_kinds) count += descendants(kind, times);
  return count;
}

std::vector<std::uint32_t> control_cells_of(const ControlMesh& mesh, int times) {
  std::vector<std::uint32_t> cells;
  cells.reserve(refined_cell_count(mesh, times));
  for (std::uint32_t c = 0; c < mesh.cell_count(); ++c) {
    cells.insert(cells.end(), descendants(mesh.cell_kinds[c], times), c);
  }
  return cells;
}

}  // namespace ccslice
