// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_cells.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/mesh_import/second_order_cells.h"

namespace ccslice {

void GmshCells::add(const GmshElementType& type, std::uint64_t number, std::span<const std::uint64_t> tags,
                    std::uint64_t mark) {
  const auto cell = static_cast<std::uint32_t>(size());
  const auto corners = tags.first(static_cast<std::size_t>(corner_count(type.kind)));
  corners_.insert(corners_.end(), corners.begin(), corners.end());
  if (const auto places = gmsh_mid_nodes(type); !places.empty()) {
    second_order_.push_back({cell, static_cast<std::uint32_t>(places.size())});
    for (const std::uint8_t place : places) mid_nodes_.push_back(tags[place]);
  }
  if (type.order > 2) {
    const auto others = tags.subspan(corners.size());
    higher_order_.push_back({cell, static_cast<std::uint32_t>(others.size())});
    left_out_.insert(left_out_.end(), others.begin(), others.end());
  }
  kinds_.push_back(type.kind);
  numbers_.push_back(number);
  marks_.push_back(mark);
}

bool GmshCells::last_is_twin() const {
  if (size() < 2 || kinds_.back() != kinds_[size() - 2]) return false;
  const auto corners = static_cast<std::ptrdiff_t>(corner_count(kinds_.back()));
  return std::equal(corners_.end() - corners, corners_.end(), corners_.end() - 2 * corners);
}

void GmshCells::drop_last() {
  const auto cell = static_cast<std::uint32_t>(size() - 1);
  const auto drop = [&](std::vector<Curved>& cells, std::vector<std::uint64_t>& nodes) {
    if (cells.empty() || cells.back().cell != cell) return;
    nodes.resize(nodes.size() - cells.back().nodes);
    cells.pop_back();
  };
  drop(second_order_, mid_nodes_);
  drop(higher_order_, left_out_);
  corners_.resize(corners_.size() - static_cast<std::size_t>(corner_count(kinds_.back())));
  kinds_.pop_back();
  numbers_.pop_back();
  marks_.pop_back();
}

std::uint32_t GmshCells::vertex(const NodeNumbers& nodes, std::uint64_t tag, std::size_t cell,
                                const TextScanner& text) const {
  const std::optional<std::uint32_t> vertex = nodes.index_of(tag);
  if (!vertex) {
    text.fail_at(marks_[cell], ErrorCode::kMeshIndexOutOfRange,
                 "a cell uses node " + std::to_string(tag) + ", which the file doesn't have");
  }
  return *vertex;
}

void GmshCells::add_mid_nodes(const NodeNumbers& nodes, const TextScanner& text, SecondOrderCells& second_order) const {
  std::vector<std::uint32_t> vertices;
  auto tag = mid_nodes_.begin();
  for (const Curved& curved : second_order_) {
    vertices.clear();
    for (std::uint32_t i = 0; i < curved.nodes; ++i) vertices.push_back(vertex(nodes, *tag++, curved.cell, text));
    add_second_order_cell(curved.cell, vertices, second_order);
  }
}

void GmshCells::connect(const NodeNumbers& nodes, const TextScanner& text, MeshFile& file) {
  file.mesh.cell_vertices.reserve(corners_.size());
  auto tag = corners_.begin();
  for (std::size_t cell = 0; cell < size(); ++cell) {
    for (int i = 0; i < corner_count(kinds_[cell]); ++i) {
      file.mesh.cell_vertices.push_back(vertex(nodes, *tag++, cell, text));
    }
  }
  add_mid_nodes(nodes, text, file.second_order);
  auto left_out = left_out_.begin();
  for (const Curved& curved : higher_order_) {
    for (std::uint32_t i = 0; i < curved.nodes; ++i) {
      file.left_out_nodes.push_back(vertex(nodes, *left_out++, curved.cell, text));
    }
  }
  corners_ = {};
  mid_nodes_ = {};
  left_out_ = {};
  marks_ = {};
  file.mesh.cell_kinds = std::move(kinds_);
  file.numbers.cells = std::move(numbers_);
  note_higher_order(higher_order_.size(), "with `gmsh -order 2`", file);
}

}  // namespace ccslice
