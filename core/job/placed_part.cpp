// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/placed_part.h"

#include <algorithm>
#include <array>
#include <span>
#include <unordered_set>

#include "core/output/encodings.h"
#include "core/output/plane.h"

namespace ccslice {
namespace {

bool takes_window(const PlaneSpec& plane) {
  const EncodingTraits* traits = find_encoding(plane.encoding);
  return traits != nullptr && traits->takes_window;
}

std::uint64_t most_bytes(const SliceJob& job, std::span<const LayerWindow> windows) {
  std::uint64_t bytes = 0;
  for (const PlaneSpec& plane : job.planes) {
    const std::uint64_t all = sample_bytes(plane, region_of(job).window());
    std::uint64_t held = 0;
    for (const LayerWindow& window : windows) held += sample_bytes(plane, window);
    // Deflate takes four thousandths of a colour for each index outside, at most.
    bytes += takes_window(plane) ? std::min(all, held + all / 256) : all;
  }
  return bytes;
}

}  // namespace

LayerWindow window_of_solid(const SolidSummary& solid, const SliceJob& job) {
  const Box3 box = solid.bounding_box.transformed(job.placement);
  const LayerLattice lattice = job.grid.lattice();
  const auto place = [](double mm, double from_mm, double step_mm, std::uint32_t end) {
    return static_cast<std::uint32_t>(std::clamp<double>((mm - from_mm) / step_mm, 0, end));
  };
  const std::uint32_t column = place(box.min().x(), lattice.x0_mm + lattice.dx_mm, lattice.dx_mm, lattice.width);
  const std::uint32_t row = place(box.min().y(), lattice.y0_mm + lattice.dy_mm, lattice.dy_mm, lattice.height);
  const std::uint32_t end_column =
      place(box.max().x(), lattice.x0_mm - 2 * lattice.dx_mm, lattice.dx_mm, lattice.width);
  const std::uint32_t end_row = place(box.max().y(), lattice.y0_mm - 2 * lattice.dy_mm, lattice.dy_mm, lattice.height);
  return {column, row, end_column - column, end_row - row};
}

LayerWindow window_of_parts(const PlacedParts& parts) {
  LayerWindow window;
  for (const PlacedPart& part : parts) window = joint_window(window, window_of_solid(part.solid->summary(), part.job));
  return window;
}

std::uint64_t most_layer_bytes(const SolidSummary& solid, const SliceJob& job) {
  return most_bytes(job, std::array{common_window(region_of(job).window(), window_of_solid(solid, job))});
}

std::uint64_t most_layer_bytes(const PlacedParts& parts) {
  const LayerWindow region = region_of(parts.front().job).window();
  std::vector<LayerWindow> windows;
  for (const PlacedPart& part : parts) {
    windows.push_back(common_window(region, window_of_solid(part.solid->summary(), part.job)));
  }
  return most_bytes(parts.front().job, windows);
}

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
