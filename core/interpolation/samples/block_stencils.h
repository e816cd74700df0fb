// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit stencils (limit_stencils.h) of the blocks that many cells of a solid have in common: large boxes of parameters
// in neighbourhoods that come again and again. They depend on the solid alone, so all workers on a job share them.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>

#include "core/interpolation/samples/block_slots.h"
#include "core/limit/limit_stencils.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// A box of a cell's parameters.
struct ParamBox {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Ones();
};

/// Safe to call from many threads. Made when asked for, and kept as far as memory allows: beyond, those that were asked
/// for longest ago are forgotten.
class BlockStencils {
 public:
  static constexpr std::size_t kMostBytes = 16 << 20;

  /// REQUIRES: data outlives this.
  explicit BlockStencils(const LimitSolid::Data& data, std::size_t most_bytes = kMostBytes);

  /// Whether they pay. Depends on the solid and the box alone. REQUIRES: the cell isn't regular.
  bool are_worth_it(const LimitCell& cell, const ParamBox& box) const;
  /// The stencils of a box, by slot (block_slots.h) of the block in the cell's frame.
  [[nodiscard]] std::shared_ptr<const LimitStencils> at(const LimitCell& cell, const ParamBox& box, BlockPlaces places);
  /// Memory of what is kept.
  std::size_t memory_bytes() const;

 private:
  using Neighbourhood = std::tuple<CellClass, std::uint32_t, PhantomMask>;
  using Key = std::tuple<Neighbourhood, BlockPlaces, std::array<double, 6>>;
  using Stencils = std::shared_ptr<const LimitStencils>;
  struct Kept {
    Key key;
    Stencils stencils;
  };
  static Neighbourhood neighbourhood(const LimitCell& cell) { return {cell.cell_class, cell.op, cell.phantoms}; }
  Stencils find(const Key& key);
  Stencils keep(const Key& key, Stencils made);
  void forget_oldest();

  const LimitSolid::Data& data_;
  const std::size_t most_bytes_;
  std::map<Neighbourhood, std::size_t> cells_;
  mutable std::mutex mutex_;  // Guards what follows.
  std::list<Kept> kept_;      // Those asked for last come first.
  std::map<Key, std::list<Kept>::iterator> by_key_;
  std::size_t bytes_ = 0;
};

}  // namespace ccslice
