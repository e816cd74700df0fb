// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/limit_masks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/subdivision/refine_rules.h"

namespace ccslice {

namespace {

constexpr double kConverged = 1e-15;
constexpr int kMaxSteps = 400;  // The slowest eigenvalues met are 0.7: a hundred do.

/// What lies at a vertex, by local numbers. On the boundary: of the surface.
struct Star {
  struct Face {
    std::array<std::uint32_t, 2> edges{};
  };
  struct Cell {
    std::vector<std::uint32_t> edges, faces;
  };
  std::vector<EdgeId> edges;
  std::vector<FaceId> faces;
  std::vector<CellId> cells;
  std::vector<Face> at_face;
  std::vector<Cell> at_cell;
};

/// Weights of the points around a vertex, the mask or one on its way.
struct Weights {
  double vertex = 0;
  std::vector<double> edges, faces, cells;

  double sum() const {
    const auto total = [](const std::vector<double>& w) { return std::accumulate(w.begin(), w.end(), 0.0); };
    return vertex + total(edges) + total(faces) + total(cells);
  }
  void divide(double by) {
    vertex /= by;
    for (auto* weights : {&edges, &faces, &cells}) {
      for (double& w : *weights) w /= by;
    }
  }
};

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

double distance(const Weights& a, const Weights& b) {
  return std::max({std::abs(a.vertex - b.vertex), distance(a.edges, b.edges), distance(a.faces, b.faces),
                   distance(a.cells, b.cells)});
}

class MaskBuilder {
 public:
  explicit MaskBuilder(const CellComplex& complex)
      : complex_(complex), row_(complex), local_face_(complex.face_count()), local_cell_(complex.cell_count()) {}

  void append(VertexId vertex, Stencils& masks) {
    if (complex_.vertex_on_boundary(vertex)) {
      on_boundary(vertex);
    } else {
      inside(vertex);
    }
    row_.flush(masks);
  }

 private:
  void on_boundary(VertexId vertex) {
    find_surface(vertex);
    const auto is_sharp = [&](EdgeId e) { return complex_.edge_sharp(e); };
    const auto sharp = std::ranges::count_if(star_.edges, is_sharp);
    if (sharp > 2 || complex_.vertex_sharp(vertex)) {
      row_.add_vertex(vertex, 1);
    } else if (sharp == 2) {
      row_.add_vertex(vertex, 4.0 / 6);
      for (const EdgeId e : star_.edges) {
        if (is_sharp(e)) row_.add_vertex(complex_.edge_other(e, vertex), 1.0 / 6);
      }
    } else if (sharp == 1) {
      add_row(vertex, iterate([&](const Weights& from, Weights& to) { surface_step(from, to); }));
    } else {
      const auto k = static_cast<double>(star_.edges.size());
      add_row(vertex, uniform(k * k, 4, 1, 0));
    }
  }

  void inside(VertexId vertex) {
    find_star(vertex);
    const auto irregular = std::ranges::count_if(star_.edges, [&](EdgeId e) { return is_extraordinary(complex_, e); });
    if (irregular == 0) {
      add_row(vertex, uniform(64, 16, 4, 1));
    } else if (on_straight_extraordinary_edge(complex_, vertex)) {
      add_row(vertex, straight());
    } else {
      add_row(vertex, iterate([&](const Weights& from, Weights& to) { volume_step(from, to); }));
    }
  }

  void clear_star() {
    for (auto& cell : star_.at_cell) cell.edges.clear(), cell.faces.clear();
    star_.edges.clear();
    star_.faces.clear();
    star_.cells.clear();
  }

  /// Edges and faces of the boundary at a vertex.
  void find_surface(VertexId vertex) {
    clear_star();
    for (const FaceId f : complex_.vertex_faces(vertex)) {
      if (complex_.face_on_boundary(f)) add_face(f);
    }
    for (const EdgeId e : complex_.vertex_edges(vertex)) {
      if (complex_.edge_on_boundary(e)) star_.edges.push_back(e);
    }
    join_edges([&](FaceId f) { return complex_.face_on_boundary(f); });
  }

  void find_star(VertexId vertex) {
    clear_star();
    for (const CellId c : complex_.vertex_cells(vertex)) {
      local_cell_[c] = static_cast<std::uint32_t>(star_.cells.size());
      star_.cells.push_back(c);
    }
    star_.at_cell.resize(std::max(star_.at_cell.size(), star_.cells.size()));
    for (const FaceId f : complex_.vertex_faces(vertex)) {
      for (const HalfFaceId h : half_faces_of(f)) {
        star_.at_cell[local_cell_[complex_.half_face_cell(h)]].faces.push_back(
            static_cast<std::uint32_t>(star_.faces.size()));
      }
      add_face(f);
    }
    for (const EdgeId e : complex_.vertex_edges(vertex)) {
      for (const CellId c : complex_.edge_cells(e)) {
        star_.at_cell[local_cell_[c]].edges.push_back(static_cast<std::uint32_t>(star_.edges.size()));
      }
      star_.edges.push_back(e);
    }
    join_edges([](FaceId) { return true; });
  }

  void add_face(FaceId face) {
    local_face_[face] = static_cast<std::uint32_t>(star_.faces.size());
    star_.faces.push_back(face);
  }

  /// Tells faces their two edges at the vertex.
  template <typename Keep>
  void join_edges(Keep keep) {
    star_.at_face.assign(star_.faces.size(), {});
    edge_shares_.assign(star_.edges.size(), 0);
    known_.assign(star_.faces.size(), 0);
    for (std::uint32_t e = 0; e < star_.edges.size(); ++e) {
      for (const FaceId f : complex_.edge_faces(star_.edges[e])) {
        if (!keep(f)) continue;
        const std::uint32_t face = local_face_[f];
        star_.at_face[face].edges[known_[face]++] = e;
      }
    }
  }

  Weights zero() const {
    const auto zeros = [](std::size_t count) { return std::vector<double>(count, 0.0); };
    return {0, zeros(star_.edges.size()), zeros(star_.faces.size()), zeros(star_.cells.size())};
  }

  Weights uniform(double vertex, double edge, double face, double cell) const {
    Weights weights = zero();
    weights.vertex = vertex;
    std::ranges::fill(weights.edges, edge);
    std::ranges::fill(weights.faces, face);
    std::ranges::fill(weights.cells, cell);
    weights.divide(weights.sum());
    return weights;
  }

  /// A surface's mask (v = n^2, e = 4, f = 1) times (1, 4, 1) along the line. In the vertex's own layer all weights
  /// count four times: 4 n^2, 16, 4. In those beside it they count once: n^2 at the edges of the line, 4 at faces on
  /// it, 1 in cells. So all faces have 4.
  Weights straight() const {
    const auto n = static_cast<double>(star_.cells.size()) / 2;
    Weights weights = uniform(4 * n * n, 16, 4, 1);
    const double unit = weights.cells.front();
    for (std::size_t e = 0; e < star_.edges.size(); ++e) {
      if (is_extraordinary(complex_, star_.edges[e])) weights.edges[e] = n * n * unit;
    }
    weights.divide(weights.sum());
    return weights;
  }

  /// l A A A ... tends to the row with l A = l, as one eigenvalue of A is 1 and all others are smaller. Rows of A add
  /// up to 1, so l A has the sum of l. Dividing by it in the end undoes what rounding has added.
  template <typename Step>
  Weights iterate(Step step) {
    Weights weights = uniform(64, 16, 4, 1), next = zero();
    for (int i = 0; i < kMaxSteps; ++i) {
      step(weights, next);
      std::swap(weights, next);
      if (distance(weights, next) <= kConverged) break;
    }
    weights.divide(weights.sum());
    return weights;
  }

  /// l -> l A on the boundary, with at most one sharp edge.
  void surface_step(const Weights& from, Weights& to) {
    // The vertex's rule (Q + 2 R + (k-3) P) / k: each of k faces has 1/k of Q, each edge 1/k of R. An edge's rule gives
    // half to its own midpoint and a quarter to each of its two faces; a sharp one all to the midpoint.
    const auto k = static_cast<double>(star_.edges.size());
    to.vertex = from.vertex * (k - 3) / k;
    std::ranges::fill(to.edges, 0.0);
    face_means_.assign(star_.faces.size(), from.vertex / (k * k));
    for (std::size_t f = 0; f < star_.faces.size(); ++f) face_means_[f] += from.faces[f];
    for (std::size_t e = 0; e < star_.edges.size(); ++e) {
      const bool sharp = complex_.edge_sharp(star_.edges[e]);
      add_edge_mean(2 * from.vertex / (k * k) + from.edges[e] * (sharp ? 1 : 0.5), e, to);
      edge_shares_[e] = sharp ? 0 : from.edges[e] / 4;
    }
    for (std::size_t f = 0; f < star_.faces.size(); ++f) {
      for (const std::uint32_t e : star_.at_face[f].edges) face_means_[f] += edge_shares_[e];
      add_face_mean(face_means_[f], f, to);
    }
  }

  /// l -> l A inside, by the general rule.
  void volume_step(const Weights& from, Weights& to) {
    // (Cbar + 3 Abar + 3 Mbar + P) / 8 at the vertex, (Cbar + 2 Abar + (n-3) M) / n on an edge of n cells, so that each
    // of them has 1/n^2 and each of n faces 2/n^2; (C0 + 2 A + C1) / 4 on a face; C in a cell.
    const auto share = [&](double weight, std::size_t count) {
      return weight * from.vertex / static_cast<double>(count);
    };
    to.vertex = from.vertex / 8;
    std::ranges::fill(to.edges, 0.0);
    for (std::size_t e = 0; e < star_.edges.size(); ++e) {
      const auto n = static_cast<double>(complex_.edge_cells(star_.edges[e]).size());
      add_edge_mean(share(0.375, star_.edges.size()) + from.edges[e] * (n - 3) / n, e, to);
      edge_shares_[e] = from.edges[e] / (n * n);
    }
    for (std::size_t f = 0; f < star_.faces.size(); ++f) {
      double mean = share(0.375, star_.faces.size()) + from.faces[f] / 2;
      for (const std::uint32_t e : star_.at_face[f].edges) mean += 2 * edge_shares_[e];
      to.faces[f] = 0;
      add_face_mean(mean, f, to);
    }
    for (std::size_t c = 0; c < star_.cells.size(); ++c) add_cell_mean(from, share(0.125, star_.cells.size()), c, to);
  }

  static void add_edge_mean(double weight, std::size_t edge, Weights& to) {
    to.vertex += weight / 2;
    to.edges[edge] += weight / 2;
  }

  void add_face_mean(double weight, std::size_t face, Weights& to) const {
    to.vertex += weight / 4;
    for (const std::uint32_t e : star_.at_face[face].edges) to.edges[e] += weight / 4;
    to.faces[face] = weight / 4;
  }

  void add_cell_mean(const Weights& from, double weight, std::size_t cell, Weights& to) const {
    const Star::Cell& at = star_.at_cell[cell];
    weight += from.cells[cell];
    for (const std::uint32_t e : at.edges) weight += edge_shares_[e];
    for (const std::uint32_t f : at.faces) weight += from.faces[f] / 4;
    to.vertex += weight / 8;
    for (const std::uint32_t e : at.edges) to.edges[e] += weight / 8;
    for (const std::uint32_t f : at.faces) to.faces[f] += weight / 8;
    to.cells[cell] = weight / 8;
  }

  /// From the points one refinement on to the control points.
  void add_row(VertexId vertex, const Weights& weights) {
    row_.add_vertex_point(vertex, weights.vertex);
    for (std::size_t e = 0; e < star_.edges.size(); ++e) row_.add_edge_point(star_.edges[e], weights.edges[e]);
    for (std::size_t f = 0; f < star_.faces.size(); ++f) row_.add_face_point(star_.faces[f], weights.faces[f]);
    for (std::size_t c = 0; c < star_.cells.size(); ++c) row_.add_cell_point(star_.cells[c], weights.cells[c]);
  }

  const CellComplex& complex_;
  RuleRow row_;
  Star star_;
  std::vector<std::uint32_t> local_face_, local_cell_;  // By face and cell of the complex.
  std::vector<std::uint8_t> known_;                     // By local face: how many of its edges are known.
  std::vector<double> face_means_, edge_shares_;        // What an edge hands to each of its faces or cells.
};

}  // namespace

Stencils boundary_face_masks(const CellComplex& complex, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel, 64);
  RuleRow row(complex);
  Stencils masks;
  for (const FaceId f : complex.faces()) {
    poll();
    if (!complex.face_on_boundary(f)) continue;
    // A smooth vertex, one refinement on, of as many edges as the face has sides. Around it lie the points of the
    // face's edges, and across its new faces those of the face's vertices: weights k^2, 4 and 1, which add up to
    // k^2 + 5 k.
    const auto ring = complex.face_vertices(f);
    const auto k = static_cast<double>(ring.size()), sum = k * (k + 5);
    row.add_face_point(f, k * k / sum);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      row.add_edge_point(complex.find_edge(ring[i], ring[(i + 1) % ring.size()]), 4 / sum);
      row.add_vertex_point(ring[i], 1 / sum);
    }
    row.flush(masks);
  }
  return masks;
}

Stencils limit_masks(const CellComplex& complex, const CancellationToken& cancel) {
  return limit_masks(complex, complex.vertices().to_vector(), cancel);
}

Stencils limit_masks(const CellComplex& complex, std::span<const VertexId> vertices, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel, 64);
  MaskBuilder builder(complex);
  Stencils masks;
  for (const VertexId v : vertices) {
    poll();
    builder.append(v, masks);
  }
  return masks;
}

}  // namespace ccslice
