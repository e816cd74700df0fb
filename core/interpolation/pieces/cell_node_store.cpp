// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/cell_node_store.h"

#include <algorithm>
#include <utility>

#include "core/interpolation/tiles/tile_trials.h"

namespace ccslice {
std::size_t CellNodes::memory_bytes() const {
  std::size_t bytes = sizeof(CellNodes) + nodes.capacity() * sizeof(CellNode);
  for (const CellNode& node : nodes) {
    if (node.map) bytes += sizeof(ParameterMap);
    if (!node.piece) continue;
    bytes += sizeof(CellPiece) +
             (node.piece->polynomials.capacity() + node.piece->beyond.capacity()) * sizeof(CubicPolynomial);
  }
  return bytes;
}

std::shared_ptr<CellNodes> CellNodeStore::nodes_of(LimitCellId cell, const Box3& bounds) {
  const std::scoped_lock lock(mutex_);
  if (const auto known = by_cell_.find(cell); known != by_cell_.end()) {
    kept_.splice(kept_.begin(), kept_, known->second);
    return kept_.front().nodes;
  }
  auto nodes = std::make_shared<CellNodes>();
  nodes->nodes.emplace_back().bounds = bounds;
  kept_.push_front({cell, nodes->memory_bytes(), nodes});
  by_cell_.emplace(cell, kept_.begin());
  bytes_ += kept_.front().bytes;
  forget_beyond_most();
  return nodes;
}

void CellNodeStore::set_memory(LimitCellId cell, const CellNodes& nodes) {
  const std::size_t bytes = nodes.memory_bytes();
  const std::scoped_lock lock(mutex_);
  const auto known = by_cell_.find(cell);
  if (known == by_cell_.end() || known->second->nodes.get() != &nodes) return;
  bytes_ += bytes - known->second->bytes;
  known->second->bytes = bytes;
  forget_beyond_most();
}

std::shared_ptr<BlockStencils> CellNodeStore::stencils_of(const LimitSolid& solid) {
  std::call_once(stencils_made_,
                 [&] { stencils_ = std::make_shared<BlockStencils>(solid.data(), most_bytes_of_stencils_); });
  return stencils_;
}

bool CellNodeStore::tiles_fit(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec) {
  std::call_once(tiles_tried_, [&] {
    if (!tiles_fit_) tiles_fit_ = do_tiles_fit(solid, spec, {});
  });
  return *tiles_fit_;
}

std::optional<std::uint32_t> CellNodeStore::awaited_layer(std::uint32_t first_layer) {
  std::int64_t awaited = kNotBegun;
  if (awaited_layer_.compare_exchange_strong(awaited, first_layer) || awaited == kFound) return std::nullopt;
  return static_cast<std::uint32_t>(awaited);
}

void CellNodeStore::set_found(std::uint32_t layer) {
  std::int64_t awaited = layer;
  awaited_layer_.compare_exchange_strong(awaited, kFound);
}

std::size_t CellNodeStore::memory_bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

/// Except for the one asked for last.
void CellNodeStore::forget_beyond_most() {
  while (bytes_ > most_bytes_ && kept_.size() > 1) {
    bytes_ -= kept_.back().bytes;
    by_cell_.erase(kept_.back().cell);
    kept_.pop_back();
  }
}

NodeStoreBytes bytes_of_store(std::size_t stores) {
  constexpr std::size_t kPiecesOfJob = 48 << 20, kLeast = 4 << 20;
  return {std::max(kPiecesOfJob / stores, kLeast), std::max(CellNodeStore::kMostBytesOfStencils / stores, kLeast)};
}

std::shared_ptr<CellNodeStore> make_cell_node_store(std::optional<bool> tiles_fit, std::size_t stores) {
  const NodeStoreBytes most = bytes_of_store(stores);
  return std::make_shared<CellNodeStore>(most.pieces, tiles_fit, most.stencils);
}

}  // namespace ccslice
