// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/rounded_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>

#include "core/base/number_text.h"
#include "core/base/place_text.h"

namespace ccslice {

RoundedEdges find_rounded_edges(const SurfaceRings& rings, const PlaceOfVertex& place,
                                std::span<const std::array<std::uint32_t, 2>> sharp_edges) {
  std::set<std::array<std::uint32_t, 2>> sharp;
  for (const auto& [a, b] : sharp_edges) sharp.insert({std::min(a, b), std::max(a, b)});
  RoundedEdges found;
  for (const SurfaceTurn& turn : surface_turns(rings, place, kLeastRoundedDeg)) {
    if (sharp.contains(turn.edge)) continue;
    ++found.count;
    if (std::abs(turn.deg) <= found.turn_deg) continue;
    found.turn_deg = std::abs(turn.deg);
    found.place = (place(turn.edge[0]) + place(turn.edge[1])) / 2;
  }
  return found;
}

std::string describe(const RoundedEdges& rounded) {
  constexpr int kDigits = 4;
  const auto text = [](double number) { return number_text(number, kDigits); };
  return std::to_string(rounded.count) + (rounded.count == 1 ? " edge" : " edges") + " where the mesh turns by " +
         text(kLeastRoundedDeg) + " degrees or more aren't sharp, and the limit bulges there; the most, by " +
         text(rounded.turn_deg) + " degrees, near " + place_text(rounded.place, kDigits);
}

}  // namespace ccslice
