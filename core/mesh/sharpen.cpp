// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/sharpen.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/text_scanner.h"

namespace ccslice {
namespace {

SharpEdge ascending(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The vector area, outward; zero for degenerate faces.
Vec3 vector_area(const ControlMesh& mesh, std::span<const VertexId> ring) {
  Vec3 area = Vec3::Zero();
  const Vec3& first = mesh.positions[ring[0]];
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    area += 0.5 * (mesh.positions[ring[i]] - first).cross(mesh.positions[ring[i + 1]] - first);
  }
  return area;
}

/// Whether the ring runs from a straight on to b.
bool runs_along(std::span<const VertexId> ring, VertexId a, VertexId b) {
  const auto at = static_cast<std::size_t>(std::find(ring.begin(), ring.end(), a) - ring.begin());
  return ring[(at + 1) % ring.size()] == b;
}

/// By how many degrees the surface turns at a boundary edge: positive where it is convex, negative where it is
/// reentrant; nothing if a face has no normal.
std::optional<double> turn_deg(const ControlMesh& mesh, const CellComplex& complex, EdgeId edge) {
  std::vector<FaceId> faces;
  for (const FaceId face : complex.edge_faces(edge)) {
    if (complex.face_on_boundary(face)) faces.push_back(face);
  }
  const Vec3 first = vector_area(mesh, complex.face_vertices(faces[0]));
  const Vec3 second = vector_area(mesh, complex.face_vertices(faces[1]));
  if (!(first.squaredNorm() > 0) || !(second.squaredNorm() > 0)) return std::nullopt;
  const auto [a, b] = complex.edge_vertices(edge);
  const bool along = runs_along(complex.face_vertices(faces[0]), a, b);
  const Vec3 direction = (mesh.positions[b] - mesh.positions[a]) * (along ? 1 : -1);
  const Vec3 bend = first.cross(second);
  const double angle = std::atan2(bend.norm(), first.dot(second)) * 180 / std::numbers::pi;
  return bend.dot(direction) < 0 ? -angle : angle;
}

std::uint32_t vertex_id(TextScanner& scanner) {
  const std::uint64_t id = scanner.count("a vertex id");
  if (id > std::numeric_limits<std::uint32_t>::max()) scanner.fail("a vertex id", std::to_string(id));
  return static_cast<std::uint32_t>(id);
}

}  // namespace

SharpEdges find_sharp_edges(const ControlMesh& mesh, double least_angle_deg) {
  constexpr double kRoundingDeg = 1e-6;  // So that 90 finds a box's edges.
  const CellComplex complex = make_cell_complex(mesh);
  SharpEdges found;
  for (const EdgeId edge : complex.edges()) {
    if (!complex.edge_on_boundary(edge)) continue;
    const std::optional<double> turn = turn_deg(mesh, complex, edge);
    if (!turn || std::abs(*turn) < least_angle_deg - kRoundingDeg) continue;
    const auto [a, b] = complex.edge_vertices(edge);
    (*turn < 0 ? found.reentrant : found.convex).push_back(ascending(a, b));
  }
  std::sort(found.convex.begin(), found.convex.end());
  std::sort(found.reentrant.begin(), found.reentrant.end());
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
