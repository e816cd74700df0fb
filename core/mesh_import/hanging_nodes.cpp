// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/hanging_nodes.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/mesh/point_clusters.h"

namespace ccslice {
namespace {

constexpr double kNearMiddle = 0.2;  // Of the edge: adaptive refinement puts vertices on curved surfaces.

class HangingNodeFinder {
 public:
  HangingNodeFinder(const ControlMesh& mesh, const CellComplex& complex, double same_mm)
      : mesh_(mesh), complex_(complex), place_of_(mesh.vertex_count()) {
    std::iota(place_of_.begin(), place_of_.end(), 0u);
    for (const PointCluster& cluster : find_point_clusters(mesh.positions, same_mm)) {
      for (const std::uint32_t point : cluster.points) place_of_[point] = cluster.points.front();
    }
    for (const EdgeId edge : complex.edges()) {
      if (!complex.edge_on_boundary(edge)) continue;
      const auto [a, b] = complex.edge_vertices(edge);
      ends_.push_back({place_of_[a], place_of_[b], a, b});
      ends_.push_back({place_of_[b], place_of_[a], b, a});
    }
    std::ranges::sort(ends_);
    for (const FaceId face : complex.faces()) {
      if (complex.face_vertices(face).size() == 3) triangles_.insert(places_of(complex.face_vertices(face)));
    }
  }

  HangingNodes run() {
    bool counted = false;  // The edge between the places that were looked at last.
    for (std::size_t i = 0; i < ends_.size(); ++i) {
      const bool is_other_side = i > 0 && places_of(ends_[i]) == places_of(ends_[i - 1]);
      if (ends_[i][0] < ends_[i][1] && !(is_other_side && counted)) counted = look_at_edge(ends_[i]);
    }
    if (!triangles_.empty()) look_at_quadrilaterals();
    return found_;
  }

 private:
  /// The places of both ends, and their vertices.
  using Edge = std::array<std::uint32_t, 4>;

  static std::array<std::uint32_t, 2> places_of(const Edge& edge) { return {edge[0], edge[1]}; }
  std::array<std::uint32_t, 3> places_of(std::span<const VertexId> corners) const {
    std::array<std::uint32_t, 3> places = {place_of_[corners[0]], place_of_[corners[1]], place_of_[corners[2]]};
    std::ranges::sort(places);
    return places;
  }
  void add(std::size_t& count, const Vec3& place) {
    if (!found_.any()) found_.first = place;
    ++count;
  }
  bool look_at_edge(const Edge& edge);
  void look_at_quadrilaterals();

  const ControlMesh& mesh_;
  const CellComplex& complex_;
  std::vector<std::uint32_t> place_of_;  // By vertex: the first one there.
  std::vector<Edge> ends_;               // Edges of the boundary from each of their ends, ascending.
  std::set<std::array<std::uint32_t, 3>> triangles_;
  HangingNodes found_;
};

/// Edges of the same vertices are of cells that hang together, as round a hole.
bool HangingNodeFinder::look_at_edge(const Edge& edge) {
  const auto [a, b, vertex_a, vertex_b] = edge;
  const Vec3 middle = (mesh_.positions[a] + mesh_.positions[b]) / 2;
  const double near = kNearMiddle * (mesh_.positions[a] - mesh_.positions[b]).norm();
  for (auto half = std::ranges::lower_bound(ends_, Edge{a, 0, 0, 0}); half != ends_.end() && (*half)[0] == a; ++half) {
    const std::uint32_t other = (*half)[1];
    if (other == b || !((mesh_.positions[other] - middle).norm() <= near)) continue;
    const auto rest = std::ranges::lower_bound(ends_, Edge{other, b, 0, 0});
    if (rest == ends_.end() || places_of(*rest) != std::array{other, b}) continue;
    if ((*half)[2] == vertex_a && (*rest)[3] == vertex_b) continue;
    std::array<std::uint32_t, 3> triangle = {a, b, other};
    std::ranges::sort(triangle);
    if (triangles_.contains(triangle)) continue;
    add(found_.edges, middle);
    return true;
  }
  return false;
}

void HangingNodeFinder::look_at_quadrilaterals() {
  for (const FaceId face : complex_.faces()) {
    const std::span<const VertexId> corners = complex_.face_vertices(face);
    if (corners.size() != 4 || !complex_.face_on_boundary(face)) continue;
    const auto has = [&](std::size_t left_out) {
      std::array<VertexId, 3> three;
      std::size_t count = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        if (i != left_out) three[count++] = corners[i];
      }
      return triangles_.contains(places_of(three));
    };
    if (!(has(0) && has(2)) && !(has(1) && has(3))) continue;
    Vec3 middle = Vec3::Zero();
    for (const VertexId corner : corners) middle += mesh_.positions[corner] / 4;
    add(found_.quadrilaterals, middle);
  }
}

}  // namespace

HangingNodes find_hanging_nodes(const ControlMesh& mesh, const CellComplex& complex, double same_mm) {
  return HangingNodeFinder(mesh, complex, same_mm).run();
}

}  // namespace ccslice
