// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/sharpen.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/surface_rings.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

SharpEdge ascending(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

std::uint32_t vertex_id(TextScanner& scanner) {
  const std::uint64_t id = scanner.count("a vertex id");
  if (id > std::numeric_limits<std::uint32_t>::max()) scanner.fail("a vertex id", std::to_string(id));
  return static_cast<std::uint32_t>(id);
}

}  // namespace

SharpEdges find_sharp_edges(const ControlMesh& mesh, double least_angle_deg) {
  const SurfaceRings rings = surface_rings(mesh, make_cell_complex(mesh));
  SharpEdges found;
  const auto place = [&](std::uint32_t vertex) { return mesh.positions[vertex]; };
  for (const SurfaceTurn& turn : surface_turns(rings, place, least_angle_deg)) {
    (turn.on_interface ? found.interface : turn.deg < 0 ? found.reentrant : found.convex).push_back(turn.edge);
  }
  return found;
}

SharpFeatures read_sharp_features(std::string_view text) {
  SharpFeatures features;
  TextScanner scanner(text);
  while (!scanner.at_end()) {
    const std::uint32_t first = vertex_id(scanner);
    const std::size_t line = scanner.line();
    if (scanner.peek().empty() || scanner.line() != line) {
      features.vertices.push_back(first);
      continue;
    }
    features.edges.push_back(ascending(first, vertex_id(scanner)));
    if (!scanner.peek().empty() && scanner.line() == line) scanner.fail("one or two ids on a line", scanner.peek());
  }
  return features;
}

void add_sharp_features(const SharpFeatures& features, ControlMesh& mesh) {
  std::set<SharpEdge> edges;
  for (const auto& [a, b] : mesh.sharp_edges) edges.insert(ascending(a, b));
  for (const SharpEdge& edge : features.edges) {
    if (edges.insert(edge).second) mesh.sharp_edges.push_back(edge);
  }
  std::set<std::uint32_t> vertices(mesh.sharp_vertices.begin(), mesh.sharp_vertices.end());
  for (const std::uint32_t vertex : features.vertices) {
    if (vertices.insert(vertex).second) mesh.sharp_vertices.push_back(vertex);
  }
}

}  // namespace ccslice
