// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/block_stencils.h"

#include <utility>
#include <vector>

namespace ccslice {
namespace {

constexpr std::size_t kFewestCells = 32;  // Making stencils takes as long as sampling some blocks without them.
constexpr double kSmallestBox = 0.25;     // Along each axis: smaller ones are many.
constexpr std::size_t kMostBytesOfStencils = 16 << 20;

}  // namespace

BlockStencils::BlockStencils(const LimitSolid::Data& data) : data_(data) {
  for (const LimitCell& cell : data.cells) {
    if (cell.cell_class != CellClass::kRegular) ++cells_[neighbourhood(cell)];
  }
}

bool BlockStencils::are_worth_it(const LimitCell& cell, const ParamBox& box) const {
  return (box.high - box.low).minCoeff() >= kSmallestBox && cells_.at(neighbourhood(cell)) >= kFewestCells;
}

const LimitStencils& BlockStencils::at(const LimitCell& cell, const ParamBox& box, BlockPlaces places) {
  const Vec3 from = cell.frame.to_framed(box.low), to = cell.frame.to_framed(box.high);
  const Vec3 low = from.cwiseMin(to), size = (from - to).cwiseAbs();
  const Key key(neighbourhood(cell), places, {low.x(), low.y(), low.z(), size.x(), size.y(), size.z()});
  const auto known = stencils_.find(key);
  if (known != stencils_.end()) return known->second;
  std::vector<Vec3> framed;
  for (std::size_t slot = 0; slot < slots_at(places); ++slot) {
    framed.push_back(low + at_slot(block_shares(places), slot).cwiseProduct(size));
  }
  LimitStencils stencils(data_, cell, framed);
  bytes_ += stencils.memory_bytes();
  if (bytes_ > kMostBytesOfStencils) {
    stencils_.clear();
    bytes_ = stencils.memory_bytes();
  }
  return stencils_.emplace(key, std::move(stencils)).first->second;
}

}  // namespace ccslice
