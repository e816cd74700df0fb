// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Images and bounds of points that are padded to one register. As registers, not as Eigen's vectors: those are copied
// by halves, and reading a whole one waits until both are stored.
//
// Private to core/limit.

#pragma once

#include <limits>

#include "core/base/lanes.h"
#include "core/base/types.h"

namespace ccslice {

inline Lanes to_lanes(const Vec3& v) noexcept { return Lanes{v[0], v[1], v[2], 0}; }
inline Vec3 to_vec3(const Lanes& lanes) noexcept { return {lanes[0], lanes[1], lanes[2]}; }

/// A linear map of padded vectors.
class LaneMap {
 public:
  explicit LaneMap(const Mat3& map) noexcept
      : u_(to_lanes(map.col(0))), v_(to_lanes(map.col(1))), w_(to_lanes(map.col(2))) {}

  Lanes operator()(Lanes p) const noexcept { return multiply_add(w_, p[2], multiply_add(v_, p[1], u_ * p[0])); }

 private:
  Lanes u_, v_, w_;  // Columns.
};

struct LaneBox {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Lanes low = {kInfinity, kInfinity, kInfinity, kInfinity}, high = -low;

  void extend(Lanes point) noexcept {
    low = lesser(low, point);
    high = greater(high, point);
  }
  void extend(const LaneBox& other) noexcept {
    low = lesser(low, other.low);
    high = greater(high, other.high);
  }
  Box3 box() const { return {to_vec3(low), to_vec3(high)}; }
};

}  // namespace ccslice
