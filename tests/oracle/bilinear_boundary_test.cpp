// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Occupancy of meshes as meshed against winding numbers over their bilinear and flat faces: a ray from each voxel's
// centre along x crosses each face where a quadratic equation says.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/validate.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/slicing.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

using Ring = std::vector<Vec3>;  // Three corners or four, seen from outside counterclockwise.

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Faces that one cell has.
std::vector<Ring> boundary_faces(const ControlMesh& mesh) {
  std::map<std::vector<std::uint32_t>, std::pair<int, Ring>> faces;
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    for (const LocalFace& face : cell_topology(kind).faces) {
      std::vector<std::uint32_t> key;
      Ring ring;
      for (std::size_t i = 0; i < face.size; ++i) {
        key.push_back(mesh.cell_vertices[begin + vtk_corner(kind, face.corners[i])]);
        ring.push_back(mesh.positions[key.back()]);
      }
      std::ranges::sort(key);
      auto& [cells, corners] = faces[key];
      ++cells;
      corners = ring;
    }
    begin += static_cast<std::size_t>(corner_count(kind));
  }
  std::vector<Ring> boundary;
  for (const auto& [_, face] : faces) {
    if (face.first == 1) boundary.push_back(face.second);
  }
  return boundary;
}

/// How often the ray from a point along x leaves by the face p0 + u e + v f + u v g, less how often it enters there.
/// With q = p0 - point and in y and z alone, q + v f and e + v g are parallel where it crosses:
///
///   cross(q, e) + v (cross(f, e) + cross(q, g)) + v^2 cross(f, g) = 0.
int crossings(const Ring& ring, const Vec3& point) {
  const bool flat = ring.size() == 3;
  const Vec3 p0 = ring[0], e = ring[1] - p0, f = ring.back() - p0;
  const Vec3 g = flat ? Vec3(Vec3::Zero()) : Vec3(p0 - ring[1] + ring[2] - ring[3]);
  const Vec2 q = (p0 - point).tail<2>(), e2 = e.tail<2>(), f2 = f.tail<2>(), g2 = g.tail<2>();
  const double c = cross(q, e2), b = cross(f2, e2) + cross(q, g2), a = cross(f2, g2);
  const double root = std::sqrt(b * b - 4 * a * c);
  if (std::isnan(root)) return 0;
  const double far = -0.5 * (b + std::copysign(root, b));  // Neither root by a difference of like numbers.
  int count = 0;
  for (const double v : {c / far, a == 0 ? -1.0 : far / a}) {
    if (!(v >= 0 && v < 1)) continue;
    const Vec2 along = e2 + v * g2;
    const double u = -(q + v * f2).dot(along) / along.squaredNorm();
    if (!(u >= 0 && u < (flat ? 1 - v : 1))) continue;
    if (!((p0 + u * e + v * f + u * v * g).x() > point.x())) continue;
    count += (e + v * g).cross(f + u * g).x() > 0 ? 1 : -1;
  }
  return count;
}

bool is_inside(const std::vector<Ring>& faces, const Vec3& point) {
  int winding = 0;
  for (const Ring& ring : faces) winding += crossings(ring, point);
  return winding != 0;
}

/// Somewhere so far from the point it is as said.
bool is_so_nearby(const std::vector<Ring>& faces, const Vec3& point, double distance_mm, bool inside) {
  for (int i = 0; i < 27; ++i) {
    const Vec3 towards(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (is_inside(faces, point + distance_mm * towards) == inside) return true;
  }
  return false;
}

TEST(BilinearBoundary, OccupancyAsMeshedIsItsWindingNumber) {
  std::size_t compared = 0, within = 0;
  for (const auto& [name, tiny] : tiny_meshes()) {
    SCOPED_TRACE(name);
    ControlMesh mesh = tiny;
    mesh.sharp_edges.clear();
    mesh.sharp_vertices.clear();
    mesh.as_meshed = true;
    validate(mesh);
    const Subject subject(mesh);
    const SliceJob job = float_job(subject, 61);
    const std::vector<Ring> faces = boundary_faces(subject.control());
    LayerSlicer slicer(subject.shared_solid(), job);
    for (const double place : {0.1, 0.45, 0.77}) {
      const Layer layer = slicer.slice(static_cast<std::uint32_t>(place * job.grid.extent.layers), {});
      const LayerView view(job, layer);
      for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
        for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
          // Off the planes in which edges lie, along which a ray has no number of crossings.
          const Vec3 centre = view.centre(x, y) + 1e-6 * Vec3(0, 1, 0.618);
          const bool inside = view.inside(x, y);
          ++compared;
          within += inside;
          if (is_inside(faces, centre) == inside) continue;
          EXPECT_TRUE(is_so_nearby(faces, centre, job.contour_tolerance_mm + 2e-6, inside)) << centre.transpose();
        }
      }
    }
  }
  EXPECT_GT(compared, 100'000u);
  EXPECT_GT(within, compared / 10);
}

}  // namespace
}  // namespace ccslice::oracle
