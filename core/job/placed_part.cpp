// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/placed_part.h"

#include <unordered_set>

namespace ccslice {

std::vector<std::string> cell_region_names(const PlacedParts& parts) {
  std::vector<std::string> names;
  std::unordered_set<std::string> known;
  const LimitSolid* last = nullptr;  // Instances of one solid come one after the other.
  for (const PlacedPart& part : parts) {
    if (part.solid.get() == last) continue;
    last = part.solid.get();
    for (const CellRegionSummary& region : part.solid->summary().cell_regions) {
      if (known.insert(region.name).second) names.push_back(region.name);
    }
  }
  return names;
}

}  // namespace ccslice
