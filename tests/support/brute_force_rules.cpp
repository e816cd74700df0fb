// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/brute_force_rules.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace ccslice::oracle {
namespace {

/// Running mean of points.
class Mean {
 public:
  explicit Mean(int stride) : sum_(PointValue::Zero(stride)) {}
  void add(const PointValue& p) {
    sum_ += p;
    ++count_;
  }
  PointValue value() const { return sum_ / count_; }
  int count() const { return count_; }

 private:
  PointValue sum_;
  int count_ = 0;
};

/// Centroids of the old mesh, and the rules over them.
class Rules {
 public:
  Rules(const BruteMesh& mesh, const BruteTopology& topology) : mesh_(mesh), topology_(topology) {
    for (const BruteCell& cell : mesh.cells) {
      Mean mean(mesh.stride);
      for (int i = 0; i < corner_count(cell.kind); ++i) mean.add(mesh.point(cell.v[i]));
      cell_centroids_.push_back(mean.value());
    }
    for (const BruteFace& face : topology.faces) {
      Mean mean(mesh.stride);
      for (int i = 0; i < face.corners(); ++i) mean.add(mesh.point(face.v[i]));
      face_centroids_.push_back(mean.value());
    }
    for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
      if (topology.edge_on_boundary(e) || !topology.edge_complete(e)) continue;
      if (topology.edge_cells[e].size() != 4) extraordinary_.push_back(e);
    }
  }

  PointValue cell_point(std::uint32_t c) const { return cell_centroids_[c]; }

  PointValue face_point(std::uint32_t f) const {
    const BruteFace& face = topology_.faces[f];
    if (!face.complete()) return unknown();
    if (face.boundary) return face_centroids_[f];
    return (cell_centroids_[face.cells[0]] + 2 * face_centroids_[f] + cell_centroids_[face.cells[1]]) / 4;
  }

  PointValue edge_point(std::uint32_t e) const {
    if (!topology_.edge_complete(e)) return unknown();
    if (mesh_.sharp_edges.contains(topology_.edges[e])) return midpoint(e);
    Mean faces(mesh_.stride), cells(mesh_.stride);
    if (topology_.edge_on_boundary(e)) {
      for (const std::uint32_t f : topology_.edge_faces[e]) {
        if (topology_.faces[f].boundary) faces.add(face_centroids_[f]);
      }
      return (midpoint(e) + faces.value()) / 2;
    }
    for (const std::uint32_t f : topology_.edge_faces[e]) faces.add(face_centroids_[f]);
    for (const std::uint32_t c : topology_.edge_cells[e]) cells.add(cell_centroids_[c]);
    const int n = cells.count();
    return (cells.value() + 2 * faces.value() + (n - 3) * midpoint(e)) / n;
  }

  PointValue vertex_point(std::uint32_t v) const {
    if (!topology_.vertex_complete(v)) return unknown();
    if (topology_.vertex_on_boundary(v)) return boundary_vertex_point(v);
    const std::optional<int> n = straight_extraordinary(v);
    if (n) return straight_vertex_point(v, *n);
    Mean cells(mesh_.stride), faces(mesh_.stride), edges(mesh_.stride);
    for (const std::uint32_t c : topology_.vertex_cells[v]) cells.add(cell_centroids_[c]);
    for (const std::uint32_t f : topology_.vertex_faces[v]) faces.add(face_centroids_[f]);
    for (const std::uint32_t e : topology_.vertex_edges[v]) edges.add(midpoint(e));
    return (cells.value() + 3 * faces.value() + 3 * edges.value() + mesh_.point(v)) / 8;
  }

 private:
  PointValue unknown() const { return PointValue::Constant(mesh_.stride, std::numeric_limits<double>::quiet_NaN()); }

  PointValue midpoint(std::uint32_t e) const {
    return (mesh_.point(topology_.edges[e][0]) + mesh_.point(topology_.edges[e][1])) / 2;
  }

  bool is_extraordinary(std::uint32_t e) const { return std::ranges::binary_search(extraordinary_, e); }

  /// The valence, if exactly two extraordinary edges of one valence n meet here among 2n cells and n + 2 edges.
  std::optional<int> straight_extraordinary(std::uint32_t v) const {
    std::vector<std::size_t> valences;
    for (const std::uint32_t e : topology_.vertex_edges[v]) {
      if (is_extraordinary(e)) valences.push_back(topology_.edge_cells[e].size());
    }
    if (valences.size() != 2 || valences[0] != valences[1]) return std::nullopt;
    const std::size_t n = valences[0];
    if (topology_.vertex_cells[v].size() != 2 * n || topology_.vertex_edges[v].size() != n + 2) return std::nullopt;
    return static_cast<int>(n);
  }

  PointValue straight_vertex_point(std::uint32_t v, int n) const {
    Mean cells(mesh_.stride), faces_along(mesh_.stride), faces_across(mesh_.stride);
    Mean edges_along(mesh_.stride), edges_across(mesh_.stride);
    for (const std::uint32_t c : topology_.vertex_cells[v]) cells.add(cell_centroids_[c]);
    for (const std::uint32_t e : topology_.vertex_edges[v])
      (is_extraordinary(e) ? edges_along : edges_across).add(midpoint(e));
    for (const std::uint32_t f : topology_.vertex_faces[v]) {
      const bool along = std::ranges::any_of(topology_.vertex_edges[v], [&](std::uint32_t e) {
        return is_extraordinary(e) && std::ranges::binary_search(topology_.edge_faces[e], f);
      });
      (along ? faces_along : faces_across).add(face_centroids_[f]);
    }
    return (cells.value() + faces_across.value() + 2 * faces_along.value() + 2 * edges_across.value() +
            (n - 3) * edges_along.value() + (n - 3) * mesh_.point(v)) /
           (2 * n);
  }

  PointValue boundary_vertex_point(std::uint32_t v) const {
    Mean faces(mesh_.stride), edges(mesh_.stride), sharp_ends(mesh_.stride);
    for (const std::uint32_t f : topology_.vertex_faces[v]) {
      if (topology_.faces[f].boundary) faces.add(face_centroids_[f]);
    }
    for (const std::uint32_t e : topology_.vertex_edges[v]) {
      if (!topology_.edge_on_boundary(e)) continue;
      edges.add(midpoint(e));
      const auto [a, b] = topology_.edges[e];
      if (mesh_.sharp_edges.contains({a, b})) sharp_ends.add(mesh_.point(a == v ? b : a));
    }
    const PointValue p = mesh_.point(v);
    if (mesh_.sharp_vertices.contains(v) || sharp_ends.count() >= 3) return p;
    if (sharp_ends.count() == 2) return (2 * sharp_ends.value() + 6 * p) / 8;
    const int k = faces.count();
    return (faces.value() + 2 * edges.value() + (k - 3) * p) / k;
  }

  const BruteMesh& mesh_;
  const BruteTopology& topology_;
  std::vector<PointValue> cell_centroids_, face_centroids_;
  std::vector<std::uint32_t> extraordinary_;  // Ascending.
};

}  // namespace

std::vector<double> refined_points(const BruteMesh& mesh, const BruteTopology& topology) {
  const Rules rules(mesh, topology);
  std::vector<double> points;
  const auto append = [&](const PointValue& p) { points.insert(points.end(), p.data(), p.data() + p.size()); };
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) append(rules.vertex_point(v));
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) append(rules.edge_point(e));
  for (std::uint32_t f = 0; f < topology.faces.size(); ++f) append(rules.face_point(f));
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) append(rules.cell_point(c));
  return points;
}

}  // namespace ccslice::oracle
