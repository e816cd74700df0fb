// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/patch_lanes.h"

namespace ccslice {

LaneBasis::LaneBasis(const std::array<Lanes, 3>& uvw) noexcept {
  constexpr double kSixth = 1.0 / 6;
  for (std::size_t a = 0; a < 3; ++a) {
    const Lanes t = uvw[a], s = 1 - t, t2 = t * t, s2 = s * s;
    value[a] = {s2 * s * kSixth, (t2 * (3 * t - 6) + 4) * kSixth, (s2 * (3 * s - 6) + 4) * kSixth, t2 * t * kSixth};
  }
}

std::array<Lanes, 3> patch_positions(const Patch& patch, const LaneBasis& basis) noexcept {
  const auto& [bu, bv, bw] = basis.value;
  std::array<Lanes, 3> sum{};
  const double* p = patch.points;
  for (std::size_t k = 0; k < 4; ++k) {
    std::array<Lanes, 3> plane{};
    for (std::size_t j = 0; j < 4; ++j) {
      std::array<Lanes, 3> row{};
      for (std::size_t i = 0; i < 4; ++i, p += 4) {
        for (std::size_t d = 0; d < 3; ++d) row[d] = multiply_add(bu[i], p[d], row[d]);
      }
      for (std::size_t d = 0; d < 3; ++d) plane[d] = multiply_add(bv[j], row[d], plane[d]);
    }
    for (std::size_t d = 0; d < 3; ++d) sum[d] = multiply_add(bw[k], plane[d], sum[d]);
  }
  return sum;
}

Lanes patch_channel(const Patch& patch, std::size_t channel, std::size_t channel_count,
                    const LaneBasis& basis) noexcept {
  const auto& [bu, bv, bw] = basis.value;
  Lanes sum{};
  const double* p = patch.channels + channel;
  for (std::size_t k = 0; k < 4; ++k) {
    Lanes plane{};
    for (std::size_t j = 0; j < 4; ++j) {
      Lanes row{};
      for (std::size_t i = 0; i < 4; ++i, p += channel_count) row = multiply_add(bu[i], *p, row);
      plane = multiply_add(bv[j], row, plane);
    }
    sum = multiply_add(bw[k], plane, sum);
  }
  return sum;
}

}  // namespace ccslice
