// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit stencils (limit_stencils.h) of the blocks that many cells of a solid have in common: large boxes of parameters
// in neighbourhoods that come again and again.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <tuple>

#include "core/interpolation/block_slots.h"
#include "core/limit/limit_stencils.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// A box of a cell's parameters.
struct ParamBox {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Ones();
};

/// One thread. Made when asked for, and kept as far as memory allows.
class BlockStencils {
 public:
  /// REQUIRES: data outlives this.
  explicit BlockStencils(const LimitSolid::Data& data);

  /// Whether they pay. Depends on the solid and the box alone. REQUIRES: the cell isn't regular.
  bool are_worth_it(const LimitCell& cell, const ParamBox& box) const;
  /// The stencils of a box, by slot (block_slots.h) of the block in the cell's frame. Valid until the next call.
  const LimitStencils& at(const LimitCell& cell, const ParamBox& box, BlockPlaces places);
  /// Memory of what is kept.
  std::size_t memory_bytes() const noexcept { return bytes_; }

 private:
  using Neighbourhood = std::tuple<CellClass, std::uint32_t, PhantomMask>;
  using Key = std::tuple<Neighbourhood, BlockPlaces, std::array<double, 6>>;
  static Neighbourhood neighbourhood(const LimitCell& cell) { return {cell.cell_class, cell.op, cell.phantoms}; }

  const LimitSolid::Data& data_;
  std::map<Neighbourhood, std::size_t> cells_;
  std::map<Key, LimitStencils> stencils_;
  std::size_t bytes_ = 0;
};

}  // namespace ccslice
