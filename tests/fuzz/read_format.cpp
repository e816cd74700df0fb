// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of one format from arbitrary bytes, and all that can be made of the numbers and the sets of cells in them: a
// mesh or an Error, nothing else. The build names the reader, CCSLICE_READER of CCSLICE_READER_HEADER, so that each has
// a target and a corpus of its own, and mutations don't wander off to the formats that are easiest to get into.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include CCSLICE_READER_HEADER
#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/cell_averages.h"
#include "core/mesh_import/cell_numbers.h"

namespace {

void use(const ccslice::MeshFile& file, const std::string& name, bool average, const ccslice::MeshLimits& limits) {
  ccslice::MeshFile changed = file;
  try {
    if (average) {
      ccslice::average_cell_numbers(name, ccslice::MeanOver::kAllCells, changed);
    } else {
      ccslice::make_cell_regions(name, changed);
    }
    ccslice::validate(changed.mesh, limits);
  } catch (const ccslice::Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMostUsed = 8;
  ccslice::MeshLimits limits;
  limits.max_vertices = 10'000;
  limits.max_cells = 10'000;
  try {
    const ccslice::MeshFile file = ccslice::CCSLICE_READER({reinterpret_cast<const char*>(data), size}, limits);
    std::vector<std::string> names = {"sets", "materials"};
    for (const ccslice::CellNumbers& numbers : file.cell_numbers) names.push_back(numbers.name);
    for (const ccslice::CellSet& set : file.cell_sets) names.push_back(set.name);
    if (names.size() > kMostUsed) names.resize(kMostUsed);
    for (const std::string& name : names) {
      for (const bool average : {false, true}) use(file, name, average, limits);
    }
    ccslice::ControlMesh mesh = file.mesh;
    ccslice::validate(mesh, limits);
  } catch (const ccslice::Error&) {
  }
  return 0;
}
