// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of channels that material maps don't take as they are. Those beyond what a map covers take what its end gives,
// which is seldom meant where they are many: a channel of 30 to 90 on a map of 0 to 1 prints in one material. Fractions
// of less than 1 in all are scaled up, and a density of a tenth prints as a whole.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"
#include "core/printing/printing.h"

namespace ccslice {

struct ValuesOffMap {
  const MaterialMap* map = nullptr;  // One of maps_of(printing).
  ChannelRange channel;
  std::array<double, 2> covered{};  // By the map, smallest and largest value.
  double share = 0;                 // Of the volume that the map is for, estimated at a few thousand points.
};

/// The maps' channels with values that are more than kStrictSlack of the covered range off it, in the
/// order of maps_of() and channels_of(). Takes some milliseconds at most. REQUIRES: validate_printing() passes.
std::vector<ValuesOffMap> find_values_off_maps(const Printing& printing, const LimitSolid& solid,
                                               const ChannelSources& sources = {},
                                               const Placement& placement = Placement::Identity());

struct FractionsBelowOne {
  const MaterialMap* map = nullptr;  // One of maps_of(printing): direct, without a material for the rest.
  double share = 0;                  // As above.
  double least_sum = 1;              // Of the fractions, at these points.
};

/// The maps of the solid's channels whose fractions add up to less than 1 by more than kStrictSlack, in the order of
/// maps_of(). As above.
std::vector<FractionsBelowOne> find_fractions_below_one(const Printing& printing, const LimitSolid& solid);

}  // namespace ccslice
