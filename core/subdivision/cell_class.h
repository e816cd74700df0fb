// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Each class has its own way to the limit: one patch, a two-dimensional scheme times a cubic, or a nest around a
// corner.

#pragma once

#include <cstdint>

namespace ccslice {

/// Classes of limit-ready cells, by what of them is irregular: nothing, one line along an edge, or one vertex.
enum class CellClass : std::uint8_t { kRegular = 0, kLine = 1, kVertex = 2 };

}  // namespace ccslice
