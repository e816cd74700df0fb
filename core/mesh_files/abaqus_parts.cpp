// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh_import/mid_node_places.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/second_order_cells.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

/// Pairs of corners along which a cell is thin if it is: those between its lower and upper faces, and of hexahedra,
/// that may be stacked along any axis [Abaqus, *COHESIVE SECTION, STACK DIRECTION], those along u and v.
constexpr std::array<std::array<std::array<std::uint8_t, 2>, 4>, 3> kHexStacks = {
    {{{{0, 4}, {1, 5}, {2, 6}, {3, 7}}}, {{{0, 1}, {3, 2}, {7, 6}, {4, 5}}}, {{{0, 3}, {1, 2}, {5, 6}, {4, 7}}}}};

/// Two of the cell's faces lie on each other. `corners` are in VTK's order.
bool is_flat(std::span<const Vec3> corners) {
  constexpr double kTolerance = 1e-9;
  double size = 0;
  for (const Vec3& corner : corners) size = std::max(size, (corner - corners[0]).cwiseAbs().maxCoeff());
  const auto meet = [&](std::size_t a, std::size_t b) {
    return (corners[a] - corners[b]).cwiseAbs().maxCoeff() <= kTolerance * size;
  };
  if (corners.size() == 6) return meet(0, 3) && meet(1, 4) && meet(2, 5);
  return corners.size() == 8 && std::ranges::any_of(kHexStacks, [&](const auto& stack) {
           return std::ranges::all_of(stack, [&](const auto& pair) { return meet(pair[0], pair[1]); });
         });
}

/// Which of the middles of faces and of the inside each node is, as which of them a cell has is the user's choice: the
/// vertices in the order of SecondOrderCells, of which the edges' ones are there. 0: a node that the cell lacks.
std::vector<std::uint32_t> in_order(CellKind kind, std::span<const Vec3> corners, std::span<const Vec3> positions,
                                    std::span<const std::uint32_t> nodes) {
  const std::size_t edges = mid_edges(kind).size();
  std::vector<std::uint32_t> ordered(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(edges));
  std::vector<Vec3> found = middles(kind, corners), of_edges;
  for (std::size_t edge = 0; edge < edges; ++edge) {
    of_edges.push_back(nodes[edge] == kNone ? found[edge] : positions[nodes[edge]]);
  }
  bend_middles(kind, corners, of_edges, found);
  std::vector<std::uint32_t> others(nodes.begin() + static_cast<std::ptrdiff_t>(edges), nodes.end());
  std::erase(others, kNone);
  ordered.resize(found.size(), kNone);
  Eigen::MatrixXd costs(others.size(), found.size() - edges);
  for (Eigen::Index row = 0; row < costs.rows(); ++row) {
    for (Eigen::Index column = 0; column < costs.cols(); ++column) {
      const Vec3& place = found[edges + static_cast<std::size_t>(column)];
      costs(row, column) = (positions[others[static_cast<std::size_t>(row)]] - place).squaredNorm();
    }
  }
  const std::vector<std::size_t> columns = cheapest_columns(costs);
  for (std::size_t row = 0; row < columns.size(); ++row) ordered[edges + columns[row]] = others[row];
  return ordered;
}

}  // namespace

void AbaqusCells::add(const AbaqusSolidType& type, std::string_view name, std::uint64_t number,
                      std::span<const std::uint64_t> nodes, std::uint64_t mark) {
  const auto cell = static_cast<std::uint32_t>(kinds.size());
  const auto count = static_cast<std::size_t>(corner_count(*type.kind));
  corners.insert(corners.end(), nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(count));
  if (type.second_order) {
    second_order.push_back(cell);
    first_mid_nodes.push_back(mid_nodes.size());
    mid_nodes.insert(mid_nodes.end(), nodes.begin() + static_cast<std::ptrdiff_t>(count), nodes.end());
  }
  if (type.may_be_flat) {
    may_be_flat.push_back(cell);
    flat_types.push_back(name);
  }
  kinds.push_back(*type.kind);
  numbers.push_back(number);
  marks.push_back(mark);
}

std::span<const std::uint64_t> AbaqusCells::mid_nodes_of(std::size_t second_order_cell) const {
  const std::uint64_t first = first_mid_nodes[second_order_cell];
  const std::size_t next = second_order_cell + 1;
  const std::uint64_t end = next < first_mid_nodes.size() ? first_mid_nodes[next] : mid_nodes.size();
  return std::span(mid_nodes).subspan(first, end - first);
}

void read_placement(AbaqusLines& lines, AbaqusInstance& instance) {
  const std::vector<std::string_view>& entries = lines.entries();
  std::array<double, 7> numbers{};
  for (std::size_t i = 0; i < numbers.size() && i < entries.size(); ++i) {
    numbers[i] = lines.any_real(entries[i], "a number of the instance's placement");
    if (!std::isfinite(numbers[i])) {
      lines.fail_at(lines.mark(), ErrorCode::kMeshNonFinite,
                    in_quotes(printable(entries[i])) + " is not a finite number; give the instance a place");
    }
  }
  const Vec3 a(numbers[0], numbers[1], numbers[2]), b(numbers[3], numbers[4], numbers[5]);
  if (++instance.lines == 1) {
    instance.placement = Eigen::Translation3d(a);
    return;
  }
  if (instance.lines > 2) lines.fail("a keyword behind the instance's translation and rotation", entries[0]);
  if (numbers[6] == 0) return;
  if (a == b) lines.fail("two different points of the axis of rotation", "the same");
  const Eigen::AngleAxisd turn(numbers[6] * std::numbers::pi / 180, (b - a).normalized());
  instance.placement = Eigen::Translation3d(a) * turn * Eigen::Translation3d(-a) * instance.placement;
}

void AbaqusPart::release() {
  nodes = {};
  positions = {};
  cells.corners = {};
  cells.mid_nodes = {};
  cells.first_mid_nodes = {};
}

void AbaqusPlacer::place(std::vector<AbaqusPart>& parts, const std::vector<AbaqusInstance>& instances) {
  for (AbaqusPart& part : parts) {
    if (const auto twin = part.nodes.sort()) {
      lines_.fail_at(twin->mark, ErrorCode::kFileSyntax,
                     "node " + std::to_string(twin->number) + " comes twice; number the nodes anew");
    }
    leave_out_flat_cells(part);
  }
  add_instance(parts[0], 0, {});
  std::vector<bool> placed(parts.size(), false);
  for (const AbaqusInstance& instance : instances) {
    add_instance(parts[instance.part], instance.part, instance);
    placed[instance.part] = true;
  }
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (placed[i] || parts[i].cells.kinds.empty()) continue;
    if (instances.empty()) {
      add_instance(parts[i], i, {});
    } else {
      file_.warnings.push_back("part " + in_quotes(printable(parts[i].name)) + " left out: it has no instance");
    }
  }
  for (AbaqusPart& part : parts) part.release();
  for (const auto& [type, count] : flat_) {
    file_.warnings.push_back(std::to_string(count) + (count == 1 ? " element of type " : " elements of type ") +
                             printable(type) +
                             " left out: their faces lie on each other, so they hold no volume; a thickness in their "
                             "section isn't read");
  }
}

void AbaqusPlacer::leave_out_flat_cells(AbaqusPart& part) {
  AbaqusCells& cells = part.cells;
  if (cells.may_be_flat.empty()) return;
  AbaqusCells kept;
  std::size_t first_corner = 0, second_order = 0, candidate = 0;
  for (std::uint32_t cell = 0; cell < cells.kinds.size(); ++cell) {
    const auto count = static_cast<std::size_t>(corner_count(cells.kinds[cell]));
    const auto corners = std::span(cells.corners).subspan(first_corner, count);
    first_corner += count;
    AbaqusSolidType type{count, count, cells.kinds[cell]};
    std::vector<std::uint64_t> nodes(corners.begin(), corners.end());
    if (second_order < cells.second_order.size() && cells.second_order[second_order] == cell) {
      const auto mid_nodes = cells.mid_nodes_of(second_order++);
      nodes.insert(nodes.end(), mid_nodes.begin(), mid_nodes.end());
      type.second_order = true;
    }
    if (candidate < cells.may_be_flat.size() && cells.may_be_flat[candidate] == cell) {
      const std::string_view name = cells.flat_types[candidate++];
      std::vector<Vec3> positions;
      for (const std::uint64_t corner : corners) {
        if (const auto index = part.nodes.index_of(corner)) positions.push_back(part.positions[*index]);
      }
      if (is_flat(positions)) {
        ++flat_[name];
        continue;
      }
    }
    kept.add(type, {}, cells.numbers[cell], nodes, cells.marks[cell]);
  }
  cells = std::move(kept);
}

std::uint32_t AbaqusPlacer::node(const AbaqusPart& part, std::uint64_t number, std::size_t cell) const {
  const std::optional<std::uint32_t> node = part.nodes.index_of(number);
  if (!node) {
    lines_.fail_at(part.cells.marks[cell], ErrorCode::kMeshIndexOutOfRange,
                   "an element uses node " + std::to_string(number) + ", which its part doesn't have");
  }
  return *node;
}

void AbaqusPlacer::add_instance(const AbaqusPart& part, std::size_t number, const AbaqusInstance& instance) {
  ControlMesh& mesh = file_.mesh;
  const AbaqusCells& cells = part.cells;
  const std::size_t first_vertex = mesh.vertex_count(), first_cell = mesh.cell_count();
  placed_.push_back({{number, instance.name}, cells.numbers, static_cast<std::uint32_t>(first_cell)});
  if (first_vertex + part.positions.size() > limits_.max_vertices ||
      first_cell + cells.kinds.size() > limits_.max_cells) {
    throw Error(ErrorCode::kMeshTooLarge, "the instances have more than " + std::to_string(limits_.max_vertices) +
                                              " nodes or " + std::to_string(limits_.max_cells) + " cells together");
  }
  for (const Vec3& position : part.positions) mesh.positions.push_back(instance.placement * position);
  const std::vector<std::uint64_t> numbers = part.nodes.all();
  file_.numbers.vertices.insert(file_.numbers.vertices.end(), numbers.begin(), numbers.end());
  file_.numbers.cells.insert(file_.numbers.cells.end(), cells.numbers.begin(), cells.numbers.end());
  std::vector<bool> used(part.positions.size(), false);
  std::size_t corner = 0;
  for (std::size_t cell = 0; cell < cells.kinds.size(); ++cell) {
    for (int i = 0; i < corner_count(cells.kinds[cell]); ++i) {
      const std::uint32_t of_part = node(part, cells.corners[corner++], cell);
      used[of_part] = true;
      mesh.cell_vertices.push_back(static_cast<std::uint32_t>(first_vertex + of_part));
    }
  }
  add_mid_nodes(part, first_vertex, first_cell, used);
  if (const auto complaint =
          part.unfit.first_used(used, {file_.numbers.vertex_noun, file_.numbers.cell_noun, numbers, {}})) {
    lines_.fail_at(complaint->mark, ErrorCode::kMeshNonFinite, complaint->message);
  }
  mesh.cell_kinds.insert(mesh.cell_kinds.end(), cells.kinds.begin(), cells.kinds.end());
}

void AbaqusPlacer::add_mid_nodes(const AbaqusPart& part, std::size_t first_vertex, std::size_t first_cell,
                                 std::vector<bool>& used) {
  const AbaqusCells& cells = part.cells;
  std::size_t first_corner = 0, next = 0;
  for (std::uint32_t cell = 0; cell < cells.kinds.size() && next < cells.second_order.size(); ++cell) {
    const CellKind kind = cells.kinds[cell];
    const auto count = static_cast<std::size_t>(corner_count(kind));
    const auto corners = std::span(cells.corners).subspan(first_corner, count);
    first_corner += count;
    if (cells.second_order[next] != cell) continue;
    std::vector<std::uint32_t> nodes;
    for (const std::uint64_t number : cells.mid_nodes_of(next++)) {
      nodes.push_back(number == 0 ? kNone : node(part, number, cell));
      if (nodes.back() != kNone) used[nodes.back()] = true;
    }
    if (nodes.size() > mid_edges(kind).size()) {
      std::vector<Vec3> places;
      for (const std::uint64_t corner : corners) places.push_back(part.positions[node(part, corner, cell)]);
      nodes = in_order(kind, places, part.positions, nodes);
    }
    for (std::uint32_t& vertex : nodes) {
      if (vertex != kNone) vertex += static_cast<std::uint32_t>(first_vertex);
    }
    add_second_order_cell(static_cast<std::uint32_t>(first_cell + cell), nodes, file_.second_order);
  }
}

}  // namespace ccslice
