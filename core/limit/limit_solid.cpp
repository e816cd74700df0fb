// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/limit_solid.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "core/limit/solid_data.h"

namespace ccslice {

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

}  // namespace ccslice
