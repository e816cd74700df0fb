// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fills the rings of a solid in the making. Eight children of one cell have a third of their points to themselves, so
// they are a FAMILY: its points are listed once, as they are met, and where those of a cell's ring stand in the list is
// its order, of which there are few: like the operators it follows from the topology next to the family alone.
//
// Private to core/limit.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/prepare/level.h"
#include "core/subdivision/key_hash.h"

namespace ccslice {

class RingStore {
 public:
  /// `points`: how many the lists will have, about.
  RingStore(std::size_t points, LimitSolid::Data& data);

  /// What follows has points of this level. REQUIRES: no family is open; the level outlives those that follow.
  void enter(const Level& level);
  /// Gives a cell of the family its ring, once the family ends.
  void put(LimitCellId cell, std::span<const VertexId> ring);
  /// What is put next belongs to another one.
  void end_family();
  /// Gives a cell 64 points of its own, which no level has: a family by itself. `first`: of LimitSolid::Data::points.
  void put_own(LimitCellId cell, std::uint32_t first);
  /// Where a list of its own begins. Throws Error{kMeshTooComplex}, as end_family() does.
  std::uint32_t append(std::span<const VertexId> points);
  /// A list of `count` points that no level has, from `first` on.
  std::uint32_t append_own(std::uint32_t first, std::uint32_t count);

  /// Of orders: how many there are shows as they are made.
  std::size_t memory_bytes() const { return bytes_ + data_.ring_orders.capacity() * sizeof(std::uint32_t); }

 private:
  std::uint32_t place_of(VertexId point);
  /// Where the order at hand begins.
  std::uint32_t keep_order();
  std::uint32_t begin_list(std::size_t count) const;

  LimitSolid::Data& data_;
  const Level* level_ = nullptr;
  TableByKey<std::uint32_t> known_orders_;  // Where they begin.
  std::size_t bytes_ = 0;
  // Of the family:
  std::vector<VertexId> points_;
  std::vector<LimitCellId> cells_;
  std::vector<std::uint32_t> places_;    // By vertex of the level: in points_, or kNone.
  std::uint32_t phantom_place_ = kNone;  // Of kNone.
  NumberKey order_;
};

}  // namespace ccslice
