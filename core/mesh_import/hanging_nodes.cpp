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
      if (complex.edge_on_boundary(edge)) edges_.push_back(places_of(edge));
    }
    std::ranges::sort(edges_);
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    for (const FaceId face : complex.faces()) {
      if (complex.face_vertices(face).size() == 3) triangles_.insert(places_of(complex.face_vertices(face)));
    }
  }

  HangingNodes run() {
    for (const auto& [a, b] : both_ways()) {
      if (a < b) look_at_edge(a, b);
    }
    if (!triangles_.empty()) look_at_quadrilaterals();
    return found_;
  }

 private:
  using Edge = std::array<std::uint32_t, 2>;

  Edge places_of(EdgeId edge) const {
    const auto [a, b] = complex_.edge_vertices(edge);
    return {std::min(place_of_[a], place_of_[b]), std::max(place_of_[a], place_of_[b])};
  }
  std::array<std::uint32_t, 3> places_of(std::span<const VertexId> corners) const {
    std::array<std::uint32_t, 3> places = {place_of_[corners[0]], place_of_[corners[1]], place_of_[corners[2]]};
    std::ranges::sort(places);
    return places;
  }
  /// Edges by each of their ends, sorted.
  const std::vector<Edge>& both_ways() {
    if (ends_.empty()) {
      for (const auto& [a, b] : edges_) {
        ends_.push_back({a, b});
        ends_.push_back({b, a});
      }
      std::ranges::sort(ends_);
    }
    return ends_;
  }
  void add(std::size_t& count, const Vec3& place) {
    if (!found_.any()) found_.first = place;
    ++count;
  }
  void look_at_edge(std::uint32_t a, std::uint32_t b);
  void look_at_quadrilaterals();

  const ControlMesh& mesh_;
  const CellComplex& complex_;
  std::vector<std::uint32_t> place_of_;  // By vertex: the first one there.
  std::vector<Edge> edges_, ends_;       // Of the boundary.
  std::set<std::array<std::uint32_t, 3>> triangles_;
  HangingNodes found_;
};

void HangingNodeFinder::look_at_edge(std::uint32_t a, std::uint32_t b) {
  const Vec3 middle = (mesh_.positions[a] + mesh_.positions[b]) / 2;
  const double near = kNearMiddle * (mesh_.positions[a] - mesh_.positions[b]).norm();
  for (auto end = std::ranges::lower_bound(ends_, Edge{a, 0}); end != ends_.end() && (*end)[0] == a; ++end) {
    const std::uint32_t other = (*end)[1];
    if (other == b || !((mesh_.positions[other] - middle).norm() <= near)) continue;
    if (!std::ranges::binary_search(ends_, Edge{other, b})) continue;
    std::array<std::uint32_t, 3> triangle = {a, b, other};
    std::ranges::sort(triangle);
    if (triangles_.contains(triangle)) continue;
    return add(found_.edges, middle);
  }
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
