// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/piece_store.h"

#include <utility>

namespace ccslice {
namespace {

constexpr std::size_t kMostBytesOfJob = 48 << 20;

}  // namespace

std::size_t CellParts::memory_bytes() const {
  std::size_t bytes = sizeof(CellParts) + parts.capacity() * sizeof(CellPart);
  for (const CellPart& part : parts) {
    if (part.map) bytes += sizeof(ParameterMap);
    if (!part.piece) continue;
    bytes += sizeof(CellPiece) +
             (part.piece->polynomials.capacity() + part.piece->beyond.capacity()) * sizeof(CubicPolynomial);
  }
  return bytes;
}

std::shared_ptr<CellParts> PieceStore::parts_of(std::uint32_t cell, const Box3& place) {
  const std::scoped_lock lock(mutex_);
  if (const auto known = by_cell_.find(cell); known != by_cell_.end()) {
    kept_.splice(kept_.begin(), kept_, known->second);
    return kept_.front().parts;
  }
  auto parts = std::make_shared<CellParts>();
  parts->parts.emplace_back().place = place;
  kept_.push_front({cell, parts->memory_bytes(), parts});
  by_cell_.emplace(cell, kept_.begin());
  bytes_ += kept_.front().bytes;
  forget_beyond_most();
  return parts;
}

void PieceStore::set_memory(std::uint32_t cell, const CellParts& parts) {
  const std::size_t bytes = parts.memory_bytes();
  const std::scoped_lock lock(mutex_);
  const auto known = by_cell_.find(cell);
  if (known == by_cell_.end() || known->second->parts.get() != &parts) return;
  bytes_ += bytes - known->second->bytes;
  known->second->bytes = bytes;
  forget_beyond_most();
}

std::size_t PieceStore::memory_bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

/// Except for the one asked for last.
void PieceStore::forget_beyond_most() {
  while (bytes_ > most_bytes_ && kept_.size() > 1) {
    bytes_ -= kept_.back().bytes;
    by_cell_.erase(kept_.back().cell);
    kept_.pop_back();
  }
}

std::shared_ptr<PieceStore> make_piece_store() { return std::make_shared<PieceStore>(kMostBytesOfJob); }

}  // namespace ccslice
