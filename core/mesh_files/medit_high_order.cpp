// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/medit_high_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh_import/mid_node_places.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/second_order_cells.h"

namespace ccslice {
namespace {

/// The corners of a cell of edges of length 1, in VTK's order.
std::vector<Vec3> unit_corners(CellKind kind) {
  if (kind == CellKind::kTet) return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (kind == CellKind::kWedge) return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

std::size_t corners_of(const MeditCells& cells) { return static_cast<std::size_t>(corner_count(cells.kind)); }

/// The nodes that are taken: corners, and in second order all others, but the one inside of a wedge's triangle or a
/// tetrahedron, of which there is none.
std::size_t taken_of(const MeditCells& cells) { return cells.order == 2 ? cells.nodes : corners_of(cells); }

/// Where a node lies in the unit cell. Nothing if the indices aren't those of a node.
std::optional<Vec3> unit_place(const MeditCells& cells, const std::array<std::uint64_t, 4>& indices) {
  const std::uint64_t order = cells.order;
  const auto part = [&](std::uint64_t index) { return static_cast<double>(index) / static_cast<double>(order); };
  if (std::ranges::any_of(indices, [&](std::uint64_t index) { return index > order; })) return std::nullopt;
  const auto& [i, j, k, l] = indices;
  if (cells.kind == CellKind::kHex) return Vec3(part(i), part(j), part(k));
  if (cells.kind == CellKind::kWedge) {
    if (i + j + k != order) return std::nullopt;
    return Vec3(part(j), part(k), part(l));
  }
  if (i + j + k + l != order) return std::nullopt;
  return Vec3(part(j), part(k), part(l));
}

/// Which of the nodes of a cell lie at the corners and middles, by what their sum of squared distances is over all
/// cells of a section. The corners come first.
std::vector<std::uint8_t> order_by_places(const MeditCells& cells, std::span<const std::uint32_t> nodes,
                                          const std::vector<Vec3>& positions) {
  const std::size_t corners = corners_of(cells), mids = cells.nodes - corners;
  Eigen::MatrixXd costs = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(mids), static_cast<Eigen::Index>(mids));
  for (; !nodes.empty(); nodes = nodes.subspan(cells.nodes)) {
    std::vector<Vec3> of_corners;
    for (const std::uint32_t node : nodes.first(corners)) of_corners.push_back(positions[node]);
    const std::vector<Vec3> places = middles(cells.kind, of_corners);
    for (std::size_t place = 0; place < mids; ++place) {
      for (std::size_t mid = 0; mid < mids; ++mid) {
        costs(static_cast<Eigen::Index>(place), static_cast<Eigen::Index>(mid)) +=
            (positions[nodes[corners + mid]] - places[place]).squaredNorm();
      }
    }
  }
  std::vector<std::uint8_t> order(corners);
  std::iota(order.begin(), order.end(), std::uint8_t{0});
  for (const std::size_t mid : cheapest_columns(costs)) order.push_back(static_cast<std::uint8_t>(corners + mid));
  return order;
}

}  // namespace

void MeditHighOrder::add(const MeditCells& section, std::uint32_t first_cell, std::vector<std::uint32_t> nodes) {
  sections_.push_back({&section, first_cell, std::move(nodes)});
}

bool MeditHighOrder::read_ordering(const std::string& keyword, TextScanner& scanner) {
  const auto* const cells = std::ranges::find_if(kMeditCells, [&](const MeditCells& section) {
    return section.order > 1 && equals_ignoring_case(keyword, std::string(section.keyword) + "Ordering");
  });
  if (cells == std::end(kMeditCells)) return false;
  const std::uint64_t count = scanner.count("the number of nodes of a cell");
  if (count != cells->nodes) scanner.fail(std::to_string(cells->nodes) + " nodes", std::to_string(count));
  std::vector<Vec3> places = unit_corners(cells->kind);
  const std::vector<Vec3> mids = middles(cells->kind, places);
  if (cells->order == 2) places.insert(places.end(), mids.begin(), mids.end());
  constexpr std::uint8_t kNone = 255;
  std::vector<std::uint8_t> order(places.size(), kNone);
  for (std::uint8_t node = 0; node < cells->nodes; ++node) {
    std::array<std::uint64_t, 4> indices{};
    for (int i = 0; i < (cells->kind == CellKind::kHex ? 3 : 4); ++i) indices[i] = scanner.count("an index of a node");
    const std::optional<Vec3> place = unit_place(*cells, indices);
    if (!place) scanner.fail("indices of a node up to " + std::to_string(cells->order), scanner.token());
    const auto found = std::ranges::find(places, *place);
    if (found != places.end()) order[static_cast<std::size_t>(found - places.begin())] = node;
  }
  if (std::ranges::count(order, kNone) > 0) scanner.fail("indices that differ from node to node", "the same twice");
  orderings_.insert_or_assign(cells->keyword, std::move(order));
  return true;
}

/// Which node of a cell is each corner, in VTK's order, and in second order each node of SecondOrderCells.
std::vector<std::uint8_t> MeditHighOrder::order_of(const Section& section, const MeshFile& file) const {
  const MeditCells& cells = *section.cells;
  if (const auto known = orderings_.find(cells.keyword); known != orderings_.end()) return known->second;
  if (cells.order == 2 && cells.kind != CellKind::kTet) {
    return order_by_places(cells, section.nodes, file.mesh.positions);
  }
  std::vector<std::uint8_t> order(taken_of(cells));
  std::iota(order.begin(), order.end(), std::uint8_t{0});
  return order;
}

void MeditHighOrder::finish(MeshFile& file) {
  if (sections_.empty()) return;
  ControlMesh& mesh = file.mesh;
  std::vector<std::size_t> first_corner(1, 0);
  for (const CellKind kind : mesh.cell_kinds) {
    first_corner.push_back(first_corner.back() + static_cast<std::size_t>(corner_count(kind)));
  }
  std::size_t higher_order = 0;
  for (Section& section : sections_) {
    const std::size_t corners = corners_of(*section.cells);
    const auto missing = std::ranges::find_if(section.nodes, [&](auto node) { return node >= mesh.vertex_count(); });
    if (missing != section.nodes.end()) {
      throw Error(ErrorCode::kMeshIndexOutOfRange,
                  "cell " + std::to_string((missing - section.nodes.begin()) / section.cells->nodes + 1) + " of " +
                      std::string(section.cells->keyword) + " uses vertex " + std::to_string(*missing + 1ull) +
                      "; the file has " + std::to_string(mesh.vertex_count()));
    }
    const std::vector<std::uint8_t> order = order_of(section, file);
    std::vector<std::uint32_t> mid_nodes(order.size() - corners);
    for (std::uint32_t i = 0; i < section.count(); ++i) {
      const auto nodes = std::span(section.nodes).subspan(std::size_t{i} * section.cells->nodes, section.cells->nodes);
      const std::uint32_t cell = section.first_cell + i;
      for (std::size_t corner = 0; corner < corners; ++corner) {
        mesh.cell_vertices[first_corner[cell] + corner] = nodes[order[corner]];
      }
      if (mid_nodes.empty()) continue;
      for (std::size_t mid = 0; mid < mid_nodes.size(); ++mid) mid_nodes[mid] = nodes[order[corners + mid]];
      add_second_order_cell(cell, mid_nodes, file.second_order);
    }
    if (section.cells->order > 2) {
      higher_order += section.count();
      file.left_out_nodes.insert(file.left_out_nodes.end(), section.nodes.begin(), section.nodes.end());
    }
    section.nodes = {};
  }
  note_higher_order(higher_order, "in second order", file);
}

}  // namespace ccslice
