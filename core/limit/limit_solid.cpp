// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_solid.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "core/limit/prepare.h"
#include "core/limit/solid_data.h"
#include "core/limit/support.h"

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

std::shared_ptr<const LimitSolid> LimitSolid::prepare(ControlMesh mesh, const PrepareOptions& options) {
  auto data = std::make_unique<Data>();
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
  Data& own = *data;
  const std::shared_ptr<const LimitSolid> solid(new LimitSolid(std::move(data)));
  find_overlapping_cells(*solid, options, own);
  const std::uint64_t held_bytes = memory_bytes(own);
  find_hulls_near_folds(told_bytes - std::min(held_bytes, told_bytes), options.cancel, own);
  own.summary.memory_bytes = memory_bytes(own);
  return solid;
}

LimitSolid::LimitSolid(std::unique_ptr<Data> data) : data_(std::move(data)) {}
LimitSolid::~LimitSolid() = default;

const SolidSummary& LimitSolid::summary() const noexcept { return data_->summary; }
std::size_t LimitSolid::channel_count() const noexcept { return data_->dimension - 3; }
std::uint32_t LimitSolid::cell_count() const noexcept { return static_cast<std::uint32_t>(data_->cells.size()); }
CellClass LimitSolid::cell_class(LimitCellId cell) const noexcept { return data_->cells[cell].cell_class; }
ControlCellId LimitSolid::control_cell(LimitCellId cell) const noexcept { return data_->cells[cell].control_cell; }

std::uint8_t LimitSolid::boundary_sides(LimitCellId cell) const noexcept { return data_->cells[cell].boundary_sides; }
std::uint8_t LimitSolid::interface_sides(LimitCellId cell) const noexcept { return data_->cells[cell].interface_sides; }
std::uint16_t LimitSolid::boundary_edges(LimitCellId cell) const noexcept { return data_->cells[cell].boundary_edges; }
bool LimitSolid::touch(LimitCellId a, LimitCellId b) const noexcept {
  const std::span<const std::uint32_t> of_a = data_->corners(control_cell(a)), of_b = data_->corners(control_cell(b));
  return std::ranges::find_first_of(of_a, of_b) != of_a.end();
}
bool LimitSolid::as_meshed() const noexcept { return data_->summary.deviation.as_meshed; }
bool LimitSolid::has_several_regions() const noexcept { return data_->has_several_regions; }
std::uint8_t LimitSolid::region_of(ControlCellId cell) const noexcept {
  return data_->cell_regions.empty() ? std::uint8_t{0} : data_->cell_regions[cell];
}
const CellIndex& LimitSolid::index() const noexcept { return *data_; }
const CellBricks& LimitSolid::bricks() const noexcept { return data_->bricks; }

Box3 LimitSolid::placed_bounding_box(const Placement& placement, const CancellationToken& cancel) const {
  return ccslice::bounding_box(BoundarySurface(*this), placement, cancel);
}

}  // namespace ccslice
