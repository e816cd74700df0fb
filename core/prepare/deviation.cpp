// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/limit/support.h"
#include "core/mesh/face_cone.h"
#include "core/mesh/validate.h"
#include "core/prepare/limit_volume.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

namespace {

/// The limit points of a face's four corners.
std::array<Vec3, 4> corner_limits(const BoundarySurface& surface, BoundaryFaceId face, IrregularCorner& corner) {
  if (surface.faces_and_interfaces()[face].regular) {
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
  for (const VertexLimits* vertices : {&data.boundary_vertices, &data.interface_vertices}) {
    for (std::size_t n = 0; n < vertices->ids.size(); ++n) {
      const Vec3 position = data.meant_position(*vertices, n);
      const double distance = (map * (vertices->limits[n] - position)).squaredNorm();
      if (distance <= most) continue;
      most = distance;
      farthest = {vertices->ids[n], position, vertices->limits[n], vertices == &data.interface_vertices};
    }
  }
  return farthest;
}

Box3 control_box(const LimitSolid::Data& data, const Placement& placement) {
  const VertexLimits& vertices = data.boundary_vertices;
  Box3 box;
  for (std::size_t n = 0; n < vertices.ids.size(); ++n) box.extend(placement * data.meant_position(vertices, n));
  return box;
}

/// Where a vertex is meant to be. Nobody knows it of those inside of interpolating meshes.
Vec3 meant_place(const LimitSolid::Data& data, std::uint32_t vertex) {
  if (!data.summary.deviation.interpolating) return data.position(vertex);
  for (const VertexLimits* vertices : {&data.boundary_vertices, &data.interface_vertices}) {
    if (const auto n = vertices->find(vertex)) return data.meant_position(*vertices, *n);
  }
  return data.position(vertex);
}

/// Volume within faces whose vertices are at these places. `centre`: not far away.
double faceted_volume_mm3(std::span<const FaceVertices> rings, const PlaceOfVertex& place, const Vec3& centre) {
  double sum = 0;
  for (const auto& vertices : rings) {
    const std::size_t size = vertices[3] == kNone ? 3 : 4;
    std::array<Vec3, 4> ring;
    for (std::size_t i = 0; i < size; ++i) ring[i] = place(vertices[i]) - centre;
    sum += six_cones(std::span(ring).first(size));
  }
  return sum / 6;
}

void measure_cell_regions(const ControlMesh& mesh, const BoundarySurface& surface, const PlaceOfVertex& place,
                          const PrepareOptions& options, const LimitSolid::Data& data,
                          std::vector<CellRegionSummary>& regions) {
  regions.clear();
  for (const std::string& name : mesh.cell_region_names) regions.push_back({name, 0, 0, 0});
  if (regions.empty()) return;
  PeriodicPoll poll(options.cancel, 1024);
  for (const ControlCellId cell : IdRange<ControlCellId>(mesh.cell_count())) {
    poll();
    CellRegionSummary& region = regions[mesh.cell_regions[cell]];
    ++region.control_cells;
    // With the other cells' of the region that is the volume within its surface, wherever vertices inside are.
    region.control_volume_mm3 += cell_volume(mesh.cell_kinds[cell], data.corners(cell), place);
  }
  const auto faces = surface.faces_and_interfaces();
  const std::vector<double> fluxes = face_fluxes_mm3(surface, faces, kVolumeLevels, options.threads, options.cancel);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    regions[faces[i].region].volume_mm3 += fluxes[i];
    if (faces[i].beyond != kNoCellRegion) regions[faces[i].beyond].volume_mm3 -= fluxes[i];
  }
  if (!mesh.as_meshed) return;
  for (CellRegionSummary& region : regions) region.control_volume_mm3 = region.volume_mm3;
}

/// The vertices of these faces that `found` doesn't have yet, which it has afterwards.
VertexLimits find_limits_at(const BoundarySurface& surface, const IdRange<BoundaryFaceId>& faces,
                            const CancellationToken& cancel, std::vector<bool>& found) {
  PeriodicPoll poll(cancel, 256);
  std::vector<std::pair<std::uint32_t, Vec3>> limits;
  IrregularCorner corner;
  for (const BoundaryFaceId face : faces) {
    poll();
    const auto& keys = surface.faces_and_interfaces()[face].corners;
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
  VertexLimits vertices;
  vertices.ids.reserve(limits.size());
  vertices.limits.reserve(limits.size());
  for (const auto& [vertex, limit] : limits) {
    vertices.ids.push_back(vertex);
    vertices.limits.push_back(limit);
  }
  return vertices;
}

/// Fills boundary_vertices and interface_vertices.
void find_vertex_limits(const ControlMesh& mesh, const CancellationToken& cancel, LimitSolid::Data& data) {
  const BoundarySurface surface(data);
  std::vector<bool> found(data.summary.control_vertices);
  data.boundary_vertices = find_limits_at(surface, surface.face_ids(), cancel, found);
  data.interface_vertices = find_limits_at(surface, surface.interface_ids(), cancel, found);
  for (VertexLimits* vertices : {&data.boundary_vertices, &data.interface_vertices}) {
    for (const auto& [vertex, position] : mesh.missed_vertices) {
      const auto n = vertices->find(vertex);
      if (!n) continue;
      if (vertices->meant.empty()) vertices->meant = vertices->limits;
      vertices->meant[*n] = position;
    }
  }
}

}  // namespace

void measure_surface(const ControlMesh& mesh, const SurfaceRings& rings, const PrepareOptions& options,
                     LimitSolid::Data& data) {
  find_vertex_limits(mesh, options.cancel, data);
  const BoundarySurface surface(data);
  data.summary.bounding_box = bounding_box(surface, Placement::Identity(), options.cancel);
  Deviation& deviation = data.summary.deviation;
  deviation.interpolating = mesh.interpolating;
  deviation.as_meshed = mesh.as_meshed;
  const PlaceOfVertex place = [&](std::uint32_t vertex) { return meant_place(data, vertex); };
  deviation.limit_volume_mm3 = limit_volume_mm3(surface, kVolumeLevels, options.threads, options.cancel);
  deviation.control_volume_mm3 =
      mesh.as_meshed ? deviation.limit_volume_mm3 : faceted_volume_mm3(rings.boundary, place, data.position(0));
  deviation.control_box = control_box(data, Placement::Identity());
  deviation.farthest = farthest_vertex(data, Mat3::Identity());
  if (mesh.interpolating) {
    const auto limit = [&](std::uint32_t vertex) {
      return data.boundary_vertices.limits[*data.boundary_vertices.find(vertex)];
    };
    deviation.vertex_limits_volume_mm3 = faceted_volume_mm3(rings.boundary, limit, data.position(0));
    deviation.rounded = find_rounded_edges(rings, place, mesh.sharp_edges);
  }
  measure_cell_regions(mesh, surface, place, options, data, data.summary.cell_regions);
}

VertexLimit farthest_vertex(const LimitSolid& solid, const Mat3& map) { return farthest_vertex(solid.data(), map); }

Deviation placed_deviation(const LimitSolid& solid, const Placement& placement) {
  const Deviation& own = solid.summary().deviation;
  const double scale = std::abs(placement.linear().determinant());
  const VertexLimit farthest = farthest_vertex(solid, placement.linear());
  return {scale * own.control_volume_mm3,
          scale * own.limit_volume_mm3,
          control_box(solid.data(), placement),
          {farthest.vertex, placement * farthest.position, placement * farthest.limit, farthest.on_interface},
          own.interpolating,
          own.as_meshed,
          scale * own.vertex_limits_volume_mm3,
          {own.rounded.count, placement * own.rounded.place, own.rounded.turn_deg}};
}

LimitShape measure_limit(ControlMesh mesh, const PrepareOptions& options) {
  LimitSolid::Data data;
  ConnectedMesh checked = validate_and_connect(mesh, options.limits, options.cancel);
  const SurfaceRings rings = surface_rings(mesh, checked.complex);
  build_cells(mesh, std::move(checked.complex), options, data);
  measure_surface(mesh, rings, options, data);
  return {data.summary.bounding_box, data.summary.deviation, data.summary.cell_regions};
}

}  // namespace ccslice
