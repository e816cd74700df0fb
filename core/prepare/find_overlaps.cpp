// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "core/prepare/prepare.h"

namespace ccslice {

namespace {

constexpr std::size_t kMostOfOwnPart = 256;  // Boxes of a cell's own part looked at before an overlap is presumed.

/// Vertices that cells connect, as a forest whose roots are the lowest of each part.
class Parts {
 public:
  explicit Parts(std::size_t vertex_count) : parent_(vertex_count) { std::iota(parent_.begin(), parent_.end(), 0u); }

  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t v, std::uint32_t w) {
    v = root(v), w = root(w);
    parent_[std::max(v, w)] = std::min(v, w);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Calls visit(corners) for each cell.
template <typename Visit>
void for_each_cell(const ControlMesh& mesh, PeriodicPoll& poll, Visit visit) {
  const std::uint32_t* corners = mesh.cell_vertices.data();
  for (const CellKind kind : mesh.cell_kinds) {
    poll();
    const auto count = static_cast<std::size_t>(corner_count(kind));
    visit(std::span(corners, count));
    corners += count;
  }
}

/// Writes the part of each control cell; parts are numbered by their first cells. Returns how many there are.
std::uint32_t number_parts(const ControlMesh& mesh, PeriodicPoll& poll, std::vector<std::uint32_t>& part_of) {
  Parts parts(mesh.vertex_count());
  for_each_cell(mesh, poll, [&](std::span<const std::uint32_t> corners) {
    for (const std::uint32_t v : corners) parts.join(corners.front(), v);
  });
  std::vector<std::uint32_t> number(mesh.vertex_count(), kNone);
  std::uint32_t count = 0;
  for_each_cell(mesh, poll, [&](std::span<const std::uint32_t> corners) {
    std::uint32_t& at = number[parts.root(corners.front())];
    if (at == kNone) at = count++;
    part_of.push_back(at);
  });
  return count;
}

}  // namespace

void find_overlaps(const ControlMesh& mesh, const CancellationToken& cancel, LimitSolid::Data& data) {
  PeriodicPoll poll(cancel, 64);
  std::vector<std::uint32_t> part_of;
  if (number_parts(mesh, poll, part_of) < 2) return;
  const auto part = [&](LimitCellId cell) { return part_of[data.cells[cell].control_cell]; };
  const IdRange<LimitCellId> cells(data.cells.size());
  std::vector<Box3> overlapping;
  for (const LimitCellId cell : cells) {
    poll();
    std::size_t own = 0;
    const auto is_foreign = [&](std::uint32_t other) {
      return part(LimitCellId{other}) != part(cell) || ++own > kMostOfOwnPart;
    };
    if (data.cell_boxes.any_meeting(data.cell_boxes.box(cell), is_foreign)) {
      overlapping.push_back(data.cell_boxes.box(cell));
    }
  }
  if (overlapping.empty()) return;
  data.overlap_boxes = BoxTree(overlapping, cancel);
  data.parts.reserve(data.cells.size());
  for (const LimitCellId cell : cells) data.parts.push_back(part(cell));
}

}  // namespace ccslice
