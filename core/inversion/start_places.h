// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where interior starts of Newton's method lie in space, kept for the cells that were asked about last: to tell the
// nearest ones takes a few comparisons then, and no evaluations.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/limit/limit_evaluator.h"

namespace ccslice {

/// The parameters (i + 1/2) / kPerAxis of each axis. One solid, one thread.
template <std::size_t kPerAxis>
class StartPlaces {
 public:
  static constexpr std::size_t kCount = kPerAxis * kPerAxis * kPerAxis;
  using Places = std::array<Vec3, kCount>;

  /// `cells`: how many are kept, a power of two.
  explicit StartPlaces(std::size_t cells) : slots_(cells) {}

  static Vec3 parameter(std::size_t index) {
    const auto at = [](std::size_t i) { return (static_cast<double>(i) + 0.5) / kPerAxis; };
    return {at(index % kPerAxis), at(index / kPerAxis % kPerAxis), at(index / (kPerAxis * kPerAxis))};
  }

  /// geo() at each of the parameters, mm, mesh frame. Valid until the next call.
  const Places& of(LimitCellId cell, LimitEvaluator& evaluator) noexcept {
    Slot& slot = slots_[cell & (slots_.size() - 1)];
    if (slot.cell != cell) {
      for (std::size_t i = 0; i < kCount; ++i) slot.places[i] = evaluator.geo({cell, parameter(i)});
      slot.cell = cell;
    }
    return slot.places;
  }

 private:
  struct Slot {
    std::uint32_t cell = kNone;
    Places places;
  };
  std::vector<Slot> slots_;
};

}  // namespace ccslice
