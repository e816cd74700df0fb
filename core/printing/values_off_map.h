// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of channels beyond what material maps cover. They take what the end of the map gives, which is seldom meant
// where they are many: a channel of 30 to 90 on a map of 0 to 1 prints in one material.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/printing/printing.h"

namespace ccslice {

struct ValuesOffMap {
  const MaterialMap* map = nullptr;  // One of maps_of(printing).
  std::uint32_t channel = 0;
  std::array<double, 2> covered{};  // By the map, smallest and largest value.
  double share = 0;                 // Of the volume that the map is for, estimated at a few thousand points.
};

/// The maps' channels with values that are more than kStrictSlack of the covered range off it, in the order of
/// maps_of() and channels_of(). Takes some milliseconds at most. REQUIRES: validate_printing() passes.
std::vector<ValuesOffMap> find_values_off_maps(const Printing& printing, const LimitSolid& solid);

}  // namespace ccslice
