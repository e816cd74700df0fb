// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cell regions made of what a file says of its cells: numbers, or sets that have names.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// So many numbers for each cell are kept of a file.
inline constexpr std::size_t kMostCellNumbers = 16;

/// The integer that a value is.
std::optional<std::int64_t> exact_integer(double value);

/// "it has numbers called 'a', 'b', and sets 'c'", or "it has none".
std::string known_cell_numbers(const MeshFile& file);

/// "; did you mean 'Core'?" if numbers, a set or a material are called so, or like one of the names between commas, but
/// for the case of letters. Empty otherwise.
std::string known_by_another_case(std::string_view names, const MeshFile& file);

/// Makes cell regions of
///
///   the numbers of that name   a region for each, in ascending order and called by it, or as the file calls it;
///   sets                       `names` are theirs, separated by commas (which names may have, too), or "sets" for
///                              all: a region for each, in this order; cells that are in none of them become the
///                              region "rest";
///   materials                  likewise, or "materials" for all.
///
/// Throws Error{kMeshBadCellRegion} if the file has no such numbers or sets, naming those that it has, if a number
/// isn't whole, if sets have a cell in common (both with the cell as id), or if there are more than
/// limits.max_cell_regions.
void make_cell_regions(const std::string& names, MeshFile& file, const MeshLimits& limits = {});

}  // namespace ccslice
