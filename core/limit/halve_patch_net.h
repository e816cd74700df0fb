// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Halving of a bicubic Bezier net, of heights or of points.
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstddef>

namespace ccslice {

/// De Casteljau's algorithm at 1/2. `net`: 4 * row + column. `stride`: 1 halves along rows, 4 along columns.
template <typename Value>
void halve_patch_net(const std::array<Value, 16>& net, std::size_t stride, std::array<Value, 16>& low,
                     std::array<Value, 16>& high) {
  for (std::size_t line = 0; line < 4; ++line) {
    const std::size_t p = line * (stride == 1 ? 4 : 1), q = p + stride, r = q + stride, s = r + stride;
    const Value pq = 0.5 * (net[p] + net[q]), qr = 0.5 * (net[q] + net[r]), rs = 0.5 * (net[r] + net[s]);
    const Value pqr = 0.5 * (pq + qr), qrs = 0.5 * (qr + rs);
    low[p] = net[p], low[q] = pq, low[r] = pqr, low[s] = high[p] = 0.5 * (pqr + qrs);
    high[q] = qrs, high[r] = rs, high[s] = net[s];
  }
}

}  // namespace ccslice
