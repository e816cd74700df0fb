// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Boxes around the parts of a cell, in the parameters that its map guesses (cell_hulls.h).

#pragma once

#include <cstddef>

#include "core/limit/cell_hulls.h"
#include "core/limit/cell_index.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"

namespace ccslice {

struct PartSizes {
  int levels = 2;    // Levels of an irregular cell's patches that get parts of their own.
  int halvings = 2;  // Of a regular cell along each axis; all parts are about as large.
};

/// How many append_parts() appends.
std::size_t part_count(const LimitCell& cell, const PartSizes& sizes, PatchBuilder& builder);

/// Appends boxes that hold all of the cell's limit. REQUIRES: builder.dimension == kPositionDimension.
void append_parts(const CellMap& map, const LimitCell& cell, const PartSizes& sizes, PatchBuilder& builder,
                  CellHulls& parts);

}  // namespace ccslice
