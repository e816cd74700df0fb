// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cells of a Gmsh file, by the tags of their nodes as long as the nodes may still come.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh_files/gmsh_elements.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/node_numbers.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

class GmshCells {
 public:
  std::size_t size() const { return kinds_.size(); }
  /// `tags` are all of the element's nodes. `mark` is its place in the file. REQUIRES: the type is one of cells.
  void add(const GmshElementType& type, std::uint64_t number, std::span<const std::uint64_t> tags, std::uint64_t mark);
  /// Whether the last two cells have the same kind and corners.
  bool last_is_twin() const;
  void drop_last();

  /// Hands over the cells, their numbers, and the nodes of those of second order; what is said of orders goes to the
  /// warnings. Throws Error{kMeshIndexOutOfRange} at the place of a cell that uses a node which isn't there.
  void connect(const NodeNumbers& nodes, const TextScanner& text, MeshFile& file);

 private:
  std::uint32_t vertex(const NodeNumbers& nodes, std::uint64_t tag, std::size_t cell, const TextScanner& text) const;
  void add_mid_nodes(const NodeNumbers& nodes, const TextScanner& text, SecondOrderCells& second_order) const;

  std::vector<CellKind> kinds_;
  std::vector<std::uint64_t> numbers_, marks_;  // Of the cells.
  std::vector<std::uint64_t> corners_;          // Tags of nodes.
  struct Curved {
    std::uint32_t cell;
    std::uint32_t nodes;
  };
  std::vector<Curved> second_order_, higher_order_;
  std::vector<std::uint64_t> mid_nodes_, left_out_;  // Tags, those of one such cell after the other.
};

}  // namespace ccslice
