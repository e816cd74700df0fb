// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/core/contour/contour_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "core/contour/contour_tracer.h"
#include "core/limit/support.h"

namespace ccslice {

double signed_area(const ContourLoop& loop) {
  double twice = 0;
  for (std::size_t k = 0; k < loop.points.size(); ++k) {
    const Vec2 &p = loop.points[k].xy, &q = loop.points[(k + 1) % loop.points.size()].xy;
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * twice;
}

double signed_area(const Contours& contours) {
  double area = 0;
  for (const ContourLoop& loop : contours.loops) area += signed_area(loop);
  return area;
}

Vec3 world_point(const SlicePlane& plane, const Vec2& xy) {
  return plane.origin + xy.x() * plane.x_axis + xy.y() * plane.y_axis;
}

double largest_error_on_surface(const LimitSolid& solid, const Placement& placement, const SlicePlane& plane,
                                const Contours& contours) {
  const BoundarySurface surface(solid);
  LimitEvaluator evaluator(solid);
  double largest = 0;
  for (const ContourLoop& loop : contours.loops) {
    for (const ContourPoint& point : loop.points) {
      const Vec3 on_surface = placement * evaluator.geo(surface.cell_param(point.face, point.s, point.t));
      largest = std::max(largest, (on_surface - world_point(plane, point.xy)).norm());
    }
  }
  return largest;
}

SlicePlane plane_through(const Vec3& point, const Vec3& normal) {
  const Vec3 x_axis = normal.unitOrthogonal();
  return {point, x_axis, normal.cross(x_axis)};
}

SlicePlane horizontal_plane(double z_mm) { return {Vec3(0, 0, z_mm), Vec3::UnitX(), Vec3::UnitY()}; }

Vec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}

Placement random_placement(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Placement placement;
  do {
    for (int k = 0; k < 9; ++k) placement.linear()(k) = 1.5 * unit(random);
  } while (std::abs(placement.linear().determinant()) < 0.3);
  placement.translation() = 100 * Vec3(unit(random), unit(random), unit(random));
  return placement;
}

double volume_of_layers(const LimitSolid& solid, const Placement& placement, const Vec3& normal, int layers,
                        const ContourOptions& options) {
  const SlicePlane axes = plane_through(Vec3::Zero(), normal);
  Mat3 to_axes;
  to_axes << axes.x_axis.transpose(), axes.y_axis.transpose(), normal.transpose();
  const Box3 box = bounding_box(solid, Placement(to_axes) * placement);
  ContourTracer tracer(solid, std::make_shared<const ContourIndex>(solid, placement, normal));
  const double pitch = box.sizes().z() / layers;
  double volume = 0;
  for (int k = 0; k < layers; ++k) {
    SlicePlane plane = axes;
    plane.origin = (box.min().z() + (k + 0.5) * pitch) * normal;
    volume += pitch * signed_area(tracer.trace(plane, options));
  }
  return volume;
}

Triangulation triangulate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options) {
  Triangulation result;
  TessellationChunk& all = result.all;
  result.summary = tessellate(solid, placement, options, [&](const TessellationChunk& chunk) {
    if (chunk.first_vertex != all.positions.size()) throw std::logic_error("vertex numbers don't run on");
    all.positions.insert(all.positions.end(), chunk.positions.begin(), chunk.positions.end());
    all.at.insert(all.at.end(), chunk.at.begin(), chunk.at.end());
    all.channel_values.insert(all.channel_values.end(), chunk.channel_values.begin(), chunk.channel_values.end());
    all.triangles.insert(all.triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
    ++result.chunks;
  });
  return result;
}

double signed_volume(const TessellationChunk& triangles) {
  double six_times = 0;
  const Vec3 origin = triangles.positions.front();
  for (const auto& [a, b, c] : triangles.triangles) {
    const Vec3 pa = triangles.positions[a] - origin, pb = triangles.positions[b] - origin;
    six_times += pa.dot(pb.cross(triangles.positions[c] - origin));
  }
  return six_times / 6;
}

std::size_t unmatched_edges(const TessellationChunk& triangles) {
  std::map<std::array<std::uint32_t, 2>, int> edges;
  for (const auto& triangle : triangles.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{triangle[k], triangle[(k + 1) % 3]}];
  }
  std::size_t unmatched = 0;
  for (const auto& [edge, count] : edges) unmatched += count != 1 || !edges.contains({edge[1], edge[0]});
  return unmatched;
}

std::size_t open_edges(const TessellationChunk& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& triangle : triangles.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[std::minmax<std::uint32_t>({triangle[k], triangle[(k + 1) % 3]})];
  }
  return static_cast<std::size_t>(std::ranges::count_if(edges, [](const auto& edge) { return edge.second != 2; }));
}

bool same_bytes(const Contours& a, const Contours& b) {
  const auto same_point = [](const ContourPoint& p, const ContourPoint& q) {
    return p.face == q.face && p.s == q.s && p.t == q.t && p.xy == q.xy;
  };
  return a.leaves == b.leaves && a.unresolved_leaves == b.unresolved_leaves &&
         std::equal(a.loops.begin(), a.loops.end(), b.loops.begin(), b.loops.end(),
                    [&](const ContourLoop& l, const ContourLoop& m) {
                      return std::equal(l.points.begin(), l.points.end(), m.points.begin(), m.points.end(), same_point);
                    });
}

}  // namespace ccslice
