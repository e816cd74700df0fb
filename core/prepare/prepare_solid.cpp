// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/prepare_solid.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/mesh/surface_rings.h"
#include "core/prepare/prepare.h"

namespace ccslice {

namespace {

template <typename T>
std::size_t bytes_of(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

std::size_t bytes_of(const VertexLimits& vertices) {
  return bytes_of(vertices.ids) + bytes_of(vertices.limits) + bytes_of(vertices.meant);
}

std::size_t memory_bytes(const LimitSolid::Data& data) {
  return sizeof(data) + bytes_of(data.summary.inverted_control_cells) + bytes_of(data.points) + bytes_of(data.rings) +
         bytes_of(data.ring_orders) + bytes_of(data.cells) + data.bricks.memory_bytes() +
         data.cell_maps.memory_bytes() + bytes_of(data.faces) + bytes_of(data.face_rings) + bytes_of(data.face_hulls) +
         bytes_of(data.cell_regions) + bytes_of(data.control_corners) + bytes_of(data.first_corners) +
         data.operators.memory_bytes() + data.cell_boxes.memory_bytes() + data.fold_boxes.memory_bytes() +
         bytes_of(data.fold_cells) + data.hulls_near_folds.memory_bytes() + data.overlap_boxes.memory_bytes() +
         bytes_of(data.parts) + bytes_of(data.boundary_vertices) + bytes_of(data.interface_vertices);
}

}  // namespace

std::shared_ptr<const LimitSolid> prepare_solid(ControlMesh mesh, const PrepareOptions& options) {
  auto data = std::make_unique<LimitSolid::Data>();
  options.begin(PreparationStep::kChecking);
  ConnectedMesh checked = validate_and_connect(mesh, options.limits, options.cancel);
  SurfaceRings rings = surface_rings(mesh, checked.complex);
  const std::uint64_t told_bytes = build_cells(mesh, std::move(checked.complex), options, *data);
  options.begin(PreparationStep::kMeasuring);
  measure_surface(mesh, std::exchange(rings, {}), options, *data);
  data->points.shrink_to_fit();
  data->rings.shrink_to_fit();
  data->ring_orders.shrink_to_fit();
  data->cells.shrink_to_fit();
  find_bricks(options, *data);
  build_cell_boxes(options, *data);
  find_folds(options, *data);
  options.begin(PreparationStep::kFinishing);
  find_overlaps(std::exchange(mesh, {}), options.cancel, *data);
  data->summary.inverted_control_cells = std::move(checked.report.inverted_cells);
  LimitSolid::Data& own = *data;
  const auto solid = std::make_shared<const LimitSolid>(std::move(data));
  find_overlapping_cells(*solid, options, own);
  const std::uint64_t held_bytes = memory_bytes(own);
  find_hulls_near_folds(told_bytes - std::min(held_bytes, told_bytes), options.cancel, own);
  own.summary.memory_bytes = memory_bytes(own);
  return solid;
}

}  // namespace ccslice
