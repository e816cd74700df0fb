// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_numbers.h"

#include <algorithm>
#include <cstddef>
#include <map>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice {

namespace {

std::string known_names(const MeshFile& file) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < file.cell_numbers.size() && i < kMaxEchoItems; ++i) {
    names.push_back("'" + echoed(file.cell_numbers[i].name) + "'");
  }
  return names.empty() ? "it has none" : "it has " + echoed_list(names, file.cell_numbers.size());
}

}  // namespace

void make_cell_regions(const std::string& name, MeshFile& file, const MeshLimits& limits) {
  const auto found = std::ranges::find(file.cell_numbers, name, &CellNumbers::name);
  if (found == file.cell_numbers.end()) {
    throw Error(ErrorCode::kMeshBadCellRegion,
                "the file has no integers called '" + echoed(name) + "' for its cells; " + known_names(file),
                "cell_regions");
  }
  std::map<std::int64_t, std::uint8_t> regions;
  for (const std::int64_t number : found->of_cells) {
    regions.try_emplace(number);
    if (regions.size() <= limits.max_cell_regions) continue;
    throw Error(ErrorCode::kMeshBadCellRegion,
                "'" + echoed(name) + "' has more than " + std::to_string(limits.max_cell_regions) +
                    " different numbers, which is the limit of cell regions",
                "cell_regions");
  }
  ControlMesh& mesh = file.mesh;
  mesh.cell_region_names.clear();
  mesh.cell_regions.clear();
  for (auto& [number, region] : regions) {
    region = static_cast<std::uint8_t>(mesh.cell_region_names.size());
    mesh.cell_region_names.push_back(std::to_string(number));
  }
  for (const std::int64_t number : found->of_cells) mesh.cell_regions.push_back(regions.at(number));
}

}  // namespace ccslice
