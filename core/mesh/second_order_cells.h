// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the readers of second-order cells share.

#pragma once

#include <cstdint>
#include <span>

#include "core/mesh/mesh_file.h"

namespace ccslice {

/// Adds the nodes of a cell. REQUIRES: those that are there have lower numbers.
inline void add_second_order_cell(std::uint32_t cell, std::span<const std::uint32_t> nodes, SecondOrderCells& cells) {
  cells.cells.push_back(cell);
  cells.first_nodes.push_back(cells.nodes.size());
  cells.nodes.insert(cells.nodes.end(), nodes.begin(), nodes.end());
}

}  // namespace ccslice
