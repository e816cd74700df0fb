// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/gmsh_cells.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/mesh/second_order_cells.h"

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
  if (type.order > 2) higher_order_.push_back(cell);
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
  if (!second_order_.empty() && second_order_.back().cell == cell) {
    mid_nodes_.resize(mid_nodes_.size() - second_order_.back().nodes);
    second_order_.pop_back();
  }
  if (!higher_order_.empty() && higher_order_.back() == cell) higher_order_.pop_back();
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
  corners_ = {};
  mid_nodes_ = {};
  marks_ = {};
  file.mesh.cell_kinds = std::move(kinds_);
  file.numbers.cells = std::move(numbers_);
  if (higher_order_.empty()) return;
  file.warnings.push_back(std::to_string(higher_order_.size()) +
                          " cells of third order or higher taken by their corners: curved edges become straight");
}

}  // namespace ccslice
