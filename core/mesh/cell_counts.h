// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The noun for one cell of a kind, for count_text().

#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "core/mesh/cell_kind.h"

namespace ccslice {

constexpr std::string_view noun_of(CellKind kind) {
  constexpr std::array<std::string_view, kCellKinds.size()> kNouns = {"hexahedron", "tetrahedron", "wedge"};
  return kNouns[static_cast<std::size_t>(kind)];
}

}  // namespace ccslice
