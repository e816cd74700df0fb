// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/limit/id_ranges.h"
#include "core/limit/prepare.h"
#include "core/limit/solid_data.h"
#include "core/limit/support.h"
#include "core/mesh/face_cone.h"
#include "core/mesh/validate.h"

namespace ccslice {

namespace {

constexpr std::size_t kNodes = 5;

/// The Gauss points along s, side by side; those without a weight fill the registers.
using Nodes = Eigen::Array<double, 8, 1>;

/// The cubic Bernstein polynomials and their derivatives at the Gauss points of [0,1].
struct GaussTable {
  Nodes weight = Nodes::Zero();
  std::array<Nodes, 4> value, slope;  // By polynomial.
};

GaussTable make_gauss_table() {
  const double inner = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3, outer = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
  const double inner_weight = (322 + 13 * std::sqrt(70.0)) / 1800, outer_weight = (322 - 13 * std::sqrt(70.0)) / 1800;
  Nodes x = Nodes::Zero();
  x.head<kNodes>() << (1 - outer) / 2, (1 - inner) / 2, 0.5, (1 + inner) / 2, (1 + outer) / 2;
  const Nodes y = 1 - x;
  GaussTable table;
  table.weight.head<kNodes>() << outer_weight, inner_weight, 64.0 / 225, inner_weight, outer_weight;
  table.value = {y * y * y, 3 * y * y * x, 3 * y * x * x, x * x * x};
  table.slope = {-3 * y * y, 3 * y * (y - 2 * x), 3 * x * (2 * y - x), 3 * x * x};
  return table;
}

const GaussTable& gauss() {
  static const GaussTable kTable = make_gauss_table();
  return kTable;
}

/// The curve over four control points `stride` apart, or its derivative, at the Gauss points: one coordinate, from
/// `zero` on.
Nodes along_curve(const std::array<Nodes, 4>& basis, const PaddedPoint* points, std::size_t stride, int axis,
                  double zero = 0) {
  return basis[0] * (points[0][axis] - zero) + basis[1] * (points[stride][axis] - zero) +
         basis[2] * (points[2 * stride][axis] - zero) + basis[3] * (points[3 * stride][axis] - zero);
}

/// What four rows come to at Gauss point j along t.
Nodes across_rows(const std::array<Nodes, 4>& basis, Eigen::Index j, const std::array<Nodes, 4>& rows) {
  return basis[0][j] * rows[0] + basis[1][j] * rows[1] + basis[2][j] * rows[2] + basis[3][j] * rows[3];
}

/// The integral of (z - floor) dx dy over the patch.
double flux(const BezierPatch& patch, double floor) {
  const GaussTable& table = gauss();
  std::array<Nodes, 4> x, y, z, slope_x, slope_y;  // By row; slopes along s.
  for (std::size_t row = 0; row < 4; ++row) {
    const PaddedPoint* points = &patch.b[4 * row];
    x[row] = along_curve(table.value, points, 1, 0);
    y[row] = along_curve(table.value, points, 1, 1);
    z[row] = along_curve(table.value, points, 1, 2, floor);
    slope_x[row] = along_curve(table.slope, points, 1, 0);
    slope_y[row] = along_curve(table.slope, points, 1, 1);
  }
  Nodes sum = Nodes::Zero();
  for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(kNodes); ++j) {
    const Nodes area = across_rows(table.value, j, slope_x) * across_rows(table.slope, j, y) -
                       across_rows(table.value, j, slope_y) * across_rows(table.slope, j, x);
    sum += table.weight[j] * across_rows(table.value, j, z) * area;
  }
  return (table.weight * sum).sum();
}

/// The integral of (z - floor) dx dy over the cone from `apex` to a cubic Bezier curve, the curve running
/// counter-clockwise.
double cone_flux(const PaddedPoint* curve, std::size_t stride, const Vec3& apex, double floor) {
  const GaussTable& table = gauss();
  const Nodes x = along_curve(table.value, curve, stride, 0, apex.x());
  const Nodes y = along_curve(table.value, curve, stride, 1, apex.y());
  const Nodes z = along_curve(table.value, curve, stride, 2, apex.z());
  const Nodes twice_area =
      x * along_curve(table.slope, curve, stride, 1) - y * along_curve(table.slope, curve, stride, 0);
  return (table.weight * (z / 3 + (apex.z() - floor) / 2) * twice_area).sum();
}

/// The integral over an irregular face, with a cone instead of what remains after `levels` levels.
double irregular_flux(const BoundarySurface& surface, BoundaryFaceId face, int levels, double floor,
                      IrregularCorner& corner) {
  std::array<BezierPatch, 3> patches;
  surface.irregular_corner(face, corner);
  const Vec3 apex = surface.corner_position(corner);
  double sum = 0;
  for (int level = 0; level < levels; ++level) {
    surface.split(corner, patches);
    for (const BezierPatch& patch : patches) sum += flux(patch, floor);
  }
  // What remains has two outer sides: s = 0 of the patch beside it, upwards, and t = 0 of that above, backwards.
  return sum + cone_flux(&patches[0].b[0], 4, apex, floor) - cone_flux(&patches[1].b[0], 1, apex, floor);
}

/// The limit points of a face's four corners.
std::array<Vec3, 4> corner_limits(const BoundarySurface& surface, BoundaryFaceId face, IrregularCorner& corner) {
  if (surface.faces()[face].regular) {
    const BezierPatch patch = surface.regular_patch(face);
    return {patch.b[0].head<3>(), patch.b[3].head<3>(), patch.b[15].head<3>(), patch.b[12].head<3>()};
  }
  std::array<BezierPatch, 3> patches;
  surface.irregular_corner(face, corner);
  const Vec3 origin = surface.corner_position(corner);
  surface.split(corner, patches);
  return {origin, patches[0].b[3].head<3>(), patches[2].b[15].head<3>(), patches[1].b[12].head<3>()};
}

VertexLimit farthest_vertex(const LimitSolid::Data& data, const Mat3& map) {
  VertexLimit farthest;
  double most = -1;
  for (std::size_t i = 0; i < data.boundary_vertices.size(); ++i) {
    const std::uint32_t vertex = data.boundary_vertices[i];
    const Vec3 position = data.meant_position(i);
    const double distance = (map * (data.vertex_limits[i] - position)).squaredNorm();
    if (distance <= most) continue;
    most = distance;
    farthest = {vertex, position, data.vertex_limits[i]};
  }
  return farthest;
}

Box3 control_box(const LimitSolid::Data& data, const Placement& placement) {
  Box3 box;
  for (std::size_t i = 0; i < data.boundary_vertices.size(); ++i) box.extend(placement * data.meant_position(i));
  return box;
}

/// Where a boundary vertex is meant to be.
Vec3 meant_place(const LimitSolid::Data& data, std::uint32_t vertex) {
  return data.summary.deviation.interpolating ? data.meant_position(data.boundary_number(vertex))
                                              : data.position(vertex);
}

/// Volume within faces whose vertices are at these places. `centre`: not far away.
double faceted_volume_mm3(const BoundaryRings& rings, const PlaceOfVertex& place, const Vec3& centre) {
  double sum = 0;
  for (const auto& vertices : rings) {
    const std::size_t size = vertices[3] == kNone ? 3 : 4;
    std::array<Vec3, 4> ring;
    for (std::size_t i = 0; i < size; ++i) ring[i] = place(vertices[i]) - centre;
    sum += six_cones(std::span(ring).first(size));
  }
  return sum / 6;
}

/// Gives the flux through each face. Callers add them up in the order of faces, whatever thread found which.
std::vector<double> fluxes_of(const BoundarySurface& surface, std::span<const BoundaryFace> faces, int levels,
                              int threads, const CancellationToken& cancel) {
  std::vector<double> fluxes(faces.size());
  if (faces.empty()) return fluxes;
  const double floor = surface.hull_box(BoundaryFaceId{0}).center().z();
  const auto make_corner = [] { return IrregularCorner(); };
  const IdRange<BoundaryFaceId> all(faces.size());
  for_each_range(all, threads, make_corner, [&](IrregularCorner& corner, const auto& range) {
    cancel.throw_if_cancelled();
    for (const BoundaryFaceId face : range.ids) {
      fluxes[face] = faces[face].regular ? flux(surface.regular_patch(face), floor)
                                         : irregular_flux(surface, face, levels, floor, corner);
    }
  });
  return fluxes;
}

}  // namespace

double limit_volume_mm3(const BoundarySurface& surface, int levels, int threads, const CancellationToken& cancel) {
  const std::vector<double> fluxes = fluxes_of(surface, surface.faces(), levels, threads, cancel);
  return std::accumulate(fluxes.begin(), fluxes.end(), 0.0);
}

namespace {

void measure_cell_regions(const ControlMesh& mesh, const BoundarySurface& surface, const PrepareOptions& options,
                          std::vector<CellRegionSummary>& regions) {
  regions.clear();
  for (const std::string& name : mesh.cell_region_names) regions.push_back({name, 0, 0});
  if (regions.empty()) return;
  for (const std::uint8_t region : mesh.cell_regions) ++regions[region].control_cells;
  const auto faces = surface.faces_and_interfaces();
  const std::vector<double> fluxes = fluxes_of(surface, faces, kVolumeLevels, options.threads, options.cancel);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    regions[faces[i].region].volume_mm3 += fluxes[i];
    if (faces[i].beyond != kNoCellRegion) regions[faces[i].beyond].volume_mm3 -= fluxes[i];
  }
}

/// Fills boundary_vertices and vertex_limits.
void find_vertex_limits(const CancellationToken& cancel, LimitSolid::Data& data) {
  const BoundarySurface surface(data);
  PeriodicPoll poll(cancel, 256);
  std::vector<bool> found(data.summary.control_vertices);
  std::vector<std::pair<std::uint32_t, Vec3>> limits;
  IrregularCorner corner;
  for (const BoundaryFaceId face : surface.face_ids()) {
    poll();
    const auto& keys = surface.faces()[face].corners;
    const auto is_wanted = [&](const SurfaceKey& key) {
      return key.kind == SurfaceKey::Kind::kVertex && key.id < found.size() && !found[key.id];
    };
    if (std::none_of(keys.begin(), keys.end(), is_wanted)) continue;
    const std::array<Vec3, 4> points = corner_limits(surface, face, corner);
    for (std::size_t i = 0; i < 4; ++i) {
      if (!is_wanted(keys[i])) continue;
      found[keys[i].id] = true;
      limits.emplace_back(keys[i].id, points[i]);
    }
  }
  std::ranges::sort(limits, {}, &std::pair<std::uint32_t, Vec3>::first);
  data.boundary_vertices.reserve(limits.size());
  data.vertex_limits.reserve(limits.size());
  for (const auto& [vertex, limit] : limits) {
    data.boundary_vertices.push_back(vertex);
    data.vertex_limits.push_back(limit);
  }
}

void find_meant_positions(const ControlMesh& mesh, LimitSolid::Data& data) {
  if (mesh.missed_vertices.empty()) return;
  data.meant_positions = data.vertex_limits;
  for (const auto& [vertex, position] : mesh.missed_vertices) {
    const auto found = std::ranges::lower_bound(data.boundary_vertices, vertex);
    if (found == data.boundary_vertices.end() || *found != vertex) continue;
    data.meant_positions[static_cast<std::size_t>(found - data.boundary_vertices.begin())] = position;
  }
}

}  // namespace

void measure_boundary(const ControlMesh& mesh, const BoundaryRings& rings, const PrepareOptions& options,
                      LimitSolid::Data& data) {
  find_vertex_limits(options.cancel, data);
  find_meant_positions(mesh, data);
  const BoundarySurface surface(data);
  data.summary.bounding_box = bounding_box(surface, Placement::Identity(), options.cancel);
  Deviation& deviation = data.summary.deviation;
  deviation.interpolating = mesh.interpolating;
  const PlaceOfVertex place = [&](std::uint32_t vertex) { return meant_place(data, vertex); };
  deviation.control_volume_mm3 = faceted_volume_mm3(rings, place, data.position(0));
  deviation.limit_volume_mm3 = limit_volume_mm3(surface, kVolumeLevels, options.threads, options.cancel);
  deviation.control_box = control_box(data, Placement::Identity());
  deviation.farthest = farthest_vertex(data, Mat3::Identity());
  if (mesh.interpolating) {
    const auto limit = [&](std::uint32_t vertex) { return data.vertex_limits[data.boundary_number(vertex)]; };
    deviation.vertex_limits_volume_mm3 = faceted_volume_mm3(rings, limit, data.position(0));
    deviation.rounded = find_rounded_edges(rings, place, mesh.sharp_edges);
  }
  measure_cell_regions(mesh, surface, options, data.summary.cell_regions);
}

VertexLimit farthest_vertex(const LimitSolid& solid, const Mat3& map) { return farthest_vertex(solid.data(), map); }

Deviation placed_deviation(const LimitSolid& solid, const Placement& placement) {
  const Deviation& own = solid.summary().deviation;
  const double scale = std::abs(placement.linear().determinant());
  const VertexLimit farthest = farthest_vertex(solid, placement.linear());
  return {scale * own.control_volume_mm3,
          scale * own.limit_volume_mm3,
          control_box(solid.data(), placement),
          {farthest.vertex, placement * farthest.position, placement * farthest.limit},
          own.interpolating,
          scale * own.vertex_limits_volume_mm3,
          {own.rounded.count, placement * own.rounded.place, own.rounded.turn_deg}};
}

LimitShape measure_limit(ControlMesh mesh, const PrepareOptions& options) {
  LimitSolid::Data data;
  ConnectedMesh checked = validate_and_connect(mesh, options.limits, options.cancel);
  const BoundaryRings rings = boundary_rings(checked.complex);
  build_cells(mesh, std::move(checked.complex), options, data);
  measure_boundary(mesh, rings, options, data);
  return {data.summary.bounding_box, data.summary.deviation, data.summary.cell_regions};
}

}  // namespace ccslice
