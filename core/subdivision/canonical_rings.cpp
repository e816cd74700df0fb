// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/canonical_rings.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

struct Start {
  CellId cell;
  Frame frame;
};

/// Starts at a vertex whose axes run along lines with the fewest cells: one, or several where lines are alike. Equal
/// neighbourhoods give equal ones.
std::vector<Start> leading_starts(const CellComplex& complex, std::span<const CellId> cells, VertexId vertex) {
  std::array<std::size_t, 3> fewest;
  fewest.fill(std::numeric_limits<std::size_t>::max());
  std::vector<Start> leading;
  for (const CellId cell : cells) {
    const auto vertices = complex.cell_vertices(cell);
    const auto corner = static_cast<std::uint8_t>(std::ranges::find(vertices, vertex) - vertices.begin());
    std::array<std::size_t, 3> by_axis;
    for (std::size_t a = 0; a < 3; ++a) {
      by_axis[a] = complex.edge_cells(complex.find_edge(vertex, vertices[corner ^ 1u << a])).size();
    }
    for (std::uint8_t along = 0; along < 3; ++along) {
      // Proper frames only, in which a Jacobian keeps its sign.
      const Frame frame = frame_at(corner, along);
      const std::array framed{by_axis[frame.axis[0]], by_axis[frame.axis[1]], by_axis[frame.axis[2]]};
      if (framed > fewest) continue;
      if (framed < fewest) leading.clear();
      fewest = framed;
      leading.push_back({cell, frame});
    }
  }
  return leading;
}

/// The first of the smallest keys. REQUIRES: a start.
template <typename FramedRing, typename Walk>
FramedRing smallest(std::span<const Start> starts, Walk walk) {
  FramedRing best{walk(starts[0]), starts[0].frame};
  for (const Start& start : starts.subspan(1)) {
    auto ring = walk(start);
    if (ring.key < best.ring.key) best = {std::move(ring), start.frame};
  }
  return best;
}

/// As smallest(), of starts in one cell.
template <typename FramedRing, typename Walk>
FramedRing smallest_known(std::span<const Start> starts, TableByKey<std::size_t>& known, Walk walk) {
  FramedRing first{walk(starts[0]), starts[0].frame};
  if (starts.size() == 1) return first;
  // Frames at one corner differ by a rotation, so by which axis comes last. At two corners they follow from these.
  std::uint32_t places = 0;
  for (const Start& start : starts) {
    const auto& axes = starts[0].frame.axis;
    places = 4 * places + static_cast<std::uint32_t>(std::ranges::find(axes, start.frame.axis[2]) - axes.begin());
  }
  first.ring.key.push_back(places);
  const auto [best, fresh] = known.try_emplace(first.ring.key, 0);
  first.ring.key.pop_back();
  if (!fresh) {
    if (best->second == 0) return first;
    const Start& start = starts[best->second];
    return {walk(start), start.frame};
  }
  for (std::size_t i = 1; i < starts.size(); ++i) {
    auto ring = walk(starts[i]);
    if (!(ring.key < first.ring.key)) continue;
    best->second = i;
    first = {std::move(ring), starts[i].frame};
  }
  return first;
}

}  // namespace

FramedLineRing canonical_line_ring(RingWalker& walker, KnownStarts& known, CellId cell, std::uint8_t edge) {
  const auto& ends = cell_tables::kHexEdges[edge];
  const auto along = static_cast<std::uint8_t>(edge / 4);
  const std::array starts{Start{cell, frame_at(ends[0], along)}, Start{cell, frame_at(ends[1], along)}};
  return smallest_known<FramedLineRing>(starts, known.of_lines,
                                        [&](const Start& at) { return walker.line(at.cell, at.frame); });
}

VertexStar canonical_star(RingWalker& walker, VertexId vertex) {
  constexpr std::size_t kMostCellsWalked = 4096;
  const auto cells = walker.complex().vertex_cells(vertex);
  struct FramedStar {
    VertexStar ring;
    Frame frame;
  };
  std::vector<Start> starts = leading_starts(walker.complex(), cells, vertex);
  starts.resize(std::min(starts.size(), std::max<std::size_t>(1, kMostCellsWalked / cells.size())));
  return smallest<FramedStar>(starts, [&](const Start& at) { return walker.star(at.cell, at.frame); }).ring;
}

FramedVertexRing canonical_vertex_ring(RingWalker& walker, KnownStarts& known, CellId cell, VertexId vertex,
                                       std::span<const VertexId> star) {
  return smallest_known<FramedVertexRing>(leading_starts(walker.complex(), std::array{cell}, vertex), known.of_vertices,
                                          [&](const Start& at) { return walker.vertex(at.cell, at.frame, star); });
}

}  // namespace ccslice
