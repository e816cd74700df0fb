// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <limits>
#include <optional>

#include "tests/support/brute_force.h"

namespace ccslice::oracle {
namespace {

/// Refining stops when nothing changes any more by this much of the values' size; the slowest eigenvalues met are 0.7.
constexpr double kConverged = 1e-15;
constexpr int kMaxRefinements = 400;

/// The corner of a quadrilateral that is opposite to v.
std::uint32_t opposite_in_face(const BruteFace& face, std::uint32_t v) {
  const auto at = std::ranges::find(face.v, v) - face.v.begin();
  return face.v[(at + 2) % 4];
}

std::uint32_t opposite_in_hex(const BruteCell& cell, std::uint32_t v) {
  const auto at = std::ranges::find(cell.v, v) - cell.v.begin();
  return cell.v[kVtkCorner[7 ^ kCornerBits[at]]];
}

std::uint32_t other_end(const std::array<std::uint32_t, 2>& edge, std::uint32_t v) {
  return edge[0] == v ? edge[1] : edge[0];
}

class VertexLimit {
 public:
  VertexLimit(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t v)
      : mesh_(mesh), topology_(topology), v_(v) {}

  std::optional<PointValue> closed_form() const { return topology_.vertex_on_boundary(v_) ? on_boundary() : inside(); }

 private:
  std::optional<PointValue> inside() const {
    for (const std::uint32_t c : topology_.vertex_cells[v_]) {
      if (mesh_.cells[c].kind != CellKind::kHex) return std::nullopt;
    }
    if (topology_.vertex_cells[v_].size() != 8) return std::nullopt;
    for (const std::uint32_t e : topology_.vertex_edges[v_]) {
      if (topology_.edge_cells[e].size() != 4) return std::nullopt;
    }
    PointValue sum = 64 * mesh_.point(v_);
    for (const std::uint32_t e : topology_.vertex_edges[v_]) sum += 16 * mesh_.point(other_end(topology_.edges[e], v_));
    for (const std::uint32_t f : topology_.vertex_faces[v_])
      sum += 4 * mesh_.point(opposite_in_face(topology_.faces[f], v_));
    for (const std::uint32_t c : topology_.vertex_cells[v_]) sum += mesh_.point(opposite_in_hex(mesh_.cells[c], v_));
    return sum / 216;
  }

  std::optional<PointValue> on_boundary() const {
    const PointValue p = mesh_.point(v_);
    PointValue edge_sum = PointValue::Zero(mesh_.stride), face_sum = edge_sum, sharp_sum = edge_sum;
    int k = 0, sharp = 0;
    bool quads = true;
    for (const std::uint32_t e : topology_.vertex_edges[v_]) {
      if (!topology_.edge_on_boundary(e)) continue;
      const PointValue end = mesh_.point(other_end(topology_.edges[e], v_));
      edge_sum += end;
      if (mesh_.sharp_edges.contains(topology_.edges[e])) {
        ++sharp;
        sharp_sum += end;
      }
    }
    for (const std::uint32_t f : topology_.vertex_faces[v_]) {
      const BruteFace& face = topology_.faces[f];
      if (!face.boundary) continue;
      ++k;
      quads = quads && face.corners() == 4;
      if (face.corners() == 4) face_sum += mesh_.point(opposite_in_face(face, v_));
    }
    if (mesh_.sharp_vertices.contains(v_) || sharp >= 3) return p;
    if (sharp == 2) return (sharp_sum + 4 * p) / 6;
    if (sharp == 1 || !quads) return std::nullopt;
    return (k * k * p + 4 * edge_sum + face_sum) / (k * (k + 5));
  }

  const BruteMesh& mesh_;
  const BruteTopology& topology_;
  std::uint32_t v_;
};

PointValue limit_by_refining(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t vertex) {
  CutOut star = cut_out(mesh, topology.vertex_cells[vertex]);
  std::uint32_t v = star.vertex(vertex);
  const double scale = mesh.point(vertex).cwiseAbs().maxCoeff() + 1;
  int quiet = 0;
  for (int i = 0; i < kMaxRefinements && quiet < 4; ++i) {
    const PointValue before = star.mesh.point(v);
    const Refined fine = refine(star.mesh, build_topology(star.mesh.cells, star.mesh.vertex_count()));
    star = cut_out(fine.mesh, cells_round(fine.mesh, {&v, 1}));
    v = star.vertex(v);
    quiet = (star.mesh.point(v) - before).cwiseAbs().maxCoeff() <= kConverged * scale ? quiet + 1 : 0;
  }
  return star.mesh.point(v);
}

}  // namespace

bool has_limit_mask(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t vertex) {
  return topology.vertex_complete(vertex) && VertexLimit(mesh, topology, vertex).closed_form().has_value();
}

PointValue limit_point(const BruteMesh& mesh, const BruteTopology& topology, std::uint32_t vertex) {
  if (!topology.vertex_complete(vertex)) {
    return PointValue::Constant(mesh.stride, std::numeric_limits<double>::quiet_NaN());
  }
  if (const std::optional<PointValue> exact = VertexLimit(mesh, topology, vertex).closed_form()) return *exact;
  return limit_by_refining(mesh, topology, vertex);
}

}  // namespace ccslice::oracle
