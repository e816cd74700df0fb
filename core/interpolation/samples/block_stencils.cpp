// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/block_stencils.h"

#include <utility>
#include <vector>

namespace ccslice {
namespace {

constexpr std::size_t kFewestCells = 32;  // Making stencils takes as long as sampling some blocks without them.
constexpr double kSmallestBox = 0.25;     // Along each axis: smaller ones are many.

}  // namespace

BlockStencils::BlockStencils(const LimitSolid::Data& data, std::size_t most_bytes)
    : data_(data), most_bytes_(most_bytes) {
  for (const LimitCell& cell : data.cells) {
    if (cell.cell_class != CellClass::kRegular) ++cells_[neighbourhood(cell)];
  }
}

bool BlockStencils::are_worth_it(const LimitCell& cell, const ParamBox& box) const {
  return (box.high - box.low).minCoeff() >= kSmallestBox && cells_.at(neighbourhood(cell)) >= kFewestCells;
}

std::shared_ptr<const LimitStencils> BlockStencils::at(const LimitCell& cell, const ParamBox& box, BlockPlaces places) {
  const Vec3 from = cell.frame.to_framed(box.low), to = cell.frame.to_framed(box.high);
  const Vec3 low = from.cwiseMin(to), size = (from - to).cwiseAbs();
  const Key key(neighbourhood(cell), places, {low.x(), low.y(), low.z(), size.x(), size.y(), size.z()});
  if (Stencils known = find(key)) return known;
  std::vector<Vec3> framed;
  for (std::size_t slot = 0; slot < slots_at(places); ++slot) {
    framed.push_back(low + at_slot(block_shares(places), slot).cwiseProduct(size));
  }
  // Others may go on meanwhile. If two make the same, either is right.
  return keep(key, std::make_shared<const LimitStencils>(data_, cell, framed));
}

std::size_t BlockStencils::memory_bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

BlockStencils::Stencils BlockStencils::find(const Key& key) {
  const std::scoped_lock lock(mutex_);
  const auto known = by_key_.find(key);
  if (known == by_key_.end()) return nullptr;
  kept_.splice(kept_.begin(), kept_, known->second);
  return known->second->stencils;
}

BlockStencils::Stencils BlockStencils::keep(const Key& key, Stencils made) {
  const std::scoped_lock lock(mutex_);
  if (const auto known = by_key_.find(key); known != by_key_.end()) return known->second->stencils;
  std::list<Kept> kept = {{key, made}};  // Where memory runs out, neither list nor map knows of it.
  by_key_.emplace(key, kept.begin());
  kept_.splice(kept_.begin(), kept);
  bytes_ += made->memory_bytes();
  if (bytes_ > most_bytes_) forget_oldest();
  return made;
}

/// Some at a time, except for the one asked for last.
void BlockStencils::forget_oldest() {
  while (bytes_ > most_bytes_ - most_bytes_ / 16 && kept_.size() > 1) {
    bytes_ -= kept_.back().stencils->memory_bytes();
    by_key_.erase(kept_.back().key);
    kept_.pop_back();
  }
}

}  // namespace ccslice
