// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Code that the readers of cells of second order and higher share.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/count_text.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Adds the nodes of a cell. REQUIRES: those that are there have lower numbers.
inline void add_second_order_cell(std::uint32_t cell, std::span<const std::uint32_t> nodes, SecondOrderCells& cells) {
  cells.cells.push_back(cell);
  cells.first_nodes.push_back(cells.nodes.size());
  cells.nodes.insert(cells.nodes.end(), nodes.begin(), nodes.end());
}

/// Says that so many cells, whose other nodes are `left_out_nodes`, are taken by their corners. `how`: what writes them
/// in second order.
inline void note_higher_order(std::size_t cells, const std::string& how, MeshFile& file) {
  if (cells == 0) return;
  file.warnings.push_back(count_text(cells, "cell") +
                          " of third order or higher taken by their corners: curved edges become straight. Nodes of "
                          "second order can be kept: save the mesh " +
                          how);
}

}  // namespace ccslice
