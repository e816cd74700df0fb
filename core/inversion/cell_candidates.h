// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// CANDIDATES: cells that may hold a point, as far as their boxes, maps and hulls tell.

#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/limit/cell_index.h"

namespace ccslice {

struct Candidate {
  double distance;  // From the cell's middle, in its parameters and by its map: a point inside is at about 1/2.
  LimitCellId cell;
  Vec3 start;  // Where Newton's method may begin.
  bool ruled_out = false;
};

/// Which candidates come first.
enum class CandidateOrder : std::uint8_t { kNearest, kLowestCell, kLowestPart };

/// What Candidate::distance is, of the parameter that the cell's map guesses.
inline double distance_from_cell(const Vec3& guess) { return (guess.array() - 0.5).abs().maxCoeff(); }

/// Fills `candidates`: the first of those wanted cells that come within `margin_mm` of the point, in order, as many as
/// the vector has room for. It allocates nothing.
template <typename Wanted>
void collect_candidates(const CellIndex& index, const Vec3& point, double margin_mm, CandidateOrder order,
                        const Wanted& wanted, std::vector<Candidate>& candidates) noexcept {
  constexpr double kStartMargin = 0.125;  // Starts are well inside the cell.
  const auto before = [&](const Candidate& a, const Candidate& b) {
    if (order == CandidateOrder::kLowestPart && index.parts[a.cell] != index.parts[b.cell]) {
      return index.parts[a.cell] < index.parts[b.cell];
    }
    if (order == CandidateOrder::kLowestCell || a.distance == b.distance) return a.cell < b.cell;
    return a.distance < b.distance;
  };
  candidates.clear();
  index.cell_boxes.visit_at(point, margin_mm, [&](std::uint32_t item) {
    const LimitCellId cell{item};
    if (!wanted(cell)) return;
    const CellMap map = index.cell_maps[cell];
    const Vec3 guess = map(point);
    if (!map.may_hold(guess, margin_mm)) return;
    const Candidate candidate{distance_from_cell(guess), cell, guess.cwiseMax(kStartMargin).cwiseMin(1 - kStartMargin)};
    if (candidates.size() == candidates.capacity()) {
      if (candidates.empty() || !before(candidate, candidates.front())) return;
      std::pop_heap(candidates.begin(), candidates.end(), before);
      candidates.pop_back();
    }
    candidates.push_back(candidate);
    std::push_heap(candidates.begin(), candidates.end(), before);
  });
  std::sort_heap(candidates.begin(), candidates.end(), before);
}

}  // namespace ccslice
