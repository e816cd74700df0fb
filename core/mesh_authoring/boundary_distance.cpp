// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/boundary_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/mesh/cell_complex.h"

namespace ccslice {
namespace {

using Triangle = std::array<Vec3, 3>;

/// Squared distance of a point from a segment.
double from_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0;
  return (p - a - t * along).squaredNorm();
}

/// Squared distance of a point from a triangle: from its plane if the point lies above it, else from an edge.
double from_triangle(const Vec3& p, const Triangle& triangle) {
  const auto& [a, b, c] = triangle;
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  const auto left_of = [&](const Vec3& from, const Vec3& to) { return normal.dot((to - from).cross(p - from)) >= 0; };
  if (area2 > 0 && left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    const double height = normal.dot(p - a);
    return height * height / area2;
  }
  return std::min({from_segment(p, a, b), from_segment(p, b, c), from_segment(p, c, a)});
}

std::vector<Triangle> boundary_triangles(const ControlMesh& mesh, const CellComplex& complex) {
  std::vector<Triangle> triangles;
  for (const FaceId face : complex.faces()) {
    if (!complex.face_on_boundary(face)) continue;
    const auto ring = complex.face_vertices(face);
    const auto corner = [&](std::size_t i) { return mesh.positions[ring[i % ring.size()]]; };
    if (ring.size() == 3) {
      triangles.push_back({corner(0), corner(1), corner(2)});
      continue;
    }
    const Vec3 middle = 0.25 * (corner(0) + corner(1) + corner(2) + corner(3));
    for (std::size_t i = 0; i < ring.size(); ++i) triangles.push_back({corner(i), corner(i + 1), middle});
  }
  return triangles;
}

/// A balanced tree over triangles: each node's box, split at the median of the widest axis.
class TriangleTree {
 public:
  explicit TriangleTree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    build(0, triangles_.size());
  }

  double nearest(const Vec3& point) const {
    double best = std::numeric_limits<double>::infinity();
    search(0, point, best);
    return std::sqrt(best);
  }

 private:
  struct Node {
    Box3 box;
    std::size_t first = 0, count = 0;  // The triangles of a leaf.
    std::size_t right = 0;             // An inner node's right child; its left one follows it.
  };

  std::size_t build(std::size_t first, std::size_t count) {
    constexpr std::size_t kLeaf = 8;
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    for (std::size_t i = first; i < first + count; ++i) {
      for (const Vec3& corner : triangles_[i]) nodes_[at].box.extend(corner);
    }
    if (count <= kLeaf) {
      nodes_[at].first = first;
      nodes_[at].count = count;
      return at;
    }
    Eigen::Index axis = 0;
    nodes_[at].box.sizes().maxCoeff(&axis);
    const auto begin = triangles_.begin() + static_cast<std::ptrdiff_t>(first);
    const std::size_t half = count / 2;
    const auto key = [axis](const Triangle& t) { return t[0][axis] + t[1][axis] + t[2][axis]; };
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), begin + static_cast<std::ptrdiff_t>(count),
                     [&](const Triangle& a, const Triangle& b) { return key(a) < key(b); });
    build(first, half);
    const std::size_t right = build(first + half, count - half);
    nodes_[at].right = right;
    return at;
  }

  void search(std::size_t at, const Vec3& point, double& best) const {
    const Node& node = nodes_[at];
    if (node.right == 0) {
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        best = std::min(best, from_triangle(point, triangles_[i]));
      }
      return;
    }
    std::array<std::size_t, 2> children = {at + 1, node.right};
    const auto gap = [&](std::size_t child) { return nodes_[child].box.squaredExteriorDistance(point); };
    if (gap(children[1]) < gap(children[0])) std::swap(children[0], children[1]);
    for (const std::size_t child : children) {
      if (gap(child) < best) search(child, point, best);
    }
  }

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace

std::vector<double> distances_to_boundary(const ControlMesh& mesh) {
  const CellComplex complex = make_cell_complex(mesh);
  const TriangleTree tree(boundary_triangles(mesh, complex));
  std::vector<double> distances;
  distances.reserve(mesh.vertex_count());
  for (const VertexId vertex : complex.vertices()) {
    distances.push_back(complex.vertex_on_boundary(vertex) ? 0 : tree.nearest(mesh.positions[vertex]));
  }
  return distances;
}

}  // namespace ccslice
