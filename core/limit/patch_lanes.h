// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Evaluation of one patch at four parameters at once, a lane each. The patch's polynomials may be evaluated beyond
// [0,1]^3. Private to the core.

#pragma once

#include <array>
#include <cstddef>

#include "core/base/lanes.h"
#include "core/limit/patch.h"

namespace ccslice {

/// Values of the cubic uniform B-splines at four parameters along each axis.
struct LaneBasis {
  std::array<std::array<Lanes, 4>, 3> value;

  explicit LaneBasis(const std::array<Lanes, 3>& uvw) noexcept;
};

/// x, y, z in mm, mesh frame.
std::array<Lanes, 3> patch_positions(const Patch& patch, const LaneBasis& basis) noexcept;

/// Contracts 4 x 4 x 4 points (index i + 4 j + 16 k, all four lanes alike) along one axis after another, so that a grid
/// of parameters takes far less than each of them alone. `basis`: by axis, then by parameter. Writes Nodes^3 values,
/// the first axis' parameter fastest.
template <std::size_t Nodes>
void contract(const std::array<Lanes, 64>& points, const std::array<std::array<std::array<double, 4>, Nodes>, 3>& basis,
              std::array<Lanes, Nodes * Nodes * Nodes>& out) noexcept {
  std::array<Lanes, Nodes * 16> rows;
  const auto dot = [](const std::array<double, 4>& b, Lanes p, Lanes q, Lanes r, Lanes s) {
    return multiply_add(p, b[0], q * b[1]) + multiply_add(r, b[2], s * b[3]);
  };
  for (std::size_t jk = 0; jk < 16; ++jk) {
    const Lanes* p = &points[4 * jk];
    for (std::size_t u = 0; u < Nodes; ++u) rows[Nodes * jk + u] = dot(basis[0][u], p[0], p[1], p[2], p[3]);
  }
  std::array<Lanes, Nodes * Nodes * 4> planes;
  for (std::size_t k = 0; k < 4; ++k) {
    const Lanes* p = &rows[4 * Nodes * k];
    for (std::size_t v = 0; v < Nodes; ++v) {
      for (std::size_t u = 0; u < Nodes; ++u) {
        planes[Nodes * (Nodes * k + v) + u] = dot(basis[1][v], p[u], p[Nodes + u], p[2 * Nodes + u], p[3 * Nodes + u]);
      }
    }
  }
  constexpr std::size_t kPlane = Nodes * Nodes;
  for (std::size_t w = 0; w < Nodes; ++w) {
    for (std::size_t uv = 0; uv < kPlane; ++uv) {
      out[kPlane * w + uv] =
          dot(basis[2][w], planes[uv], planes[kPlane + uv], planes[2 * kPlane + uv], planes[3 * kPlane + uv]);
    }
  }
}

/// One of the patch's `channel_count` channels.
Lanes patch_channel(const Patch& patch, std::size_t channel, std::size_t channel_count,
                    const LaneBasis& basis) noexcept;

}  // namespace ccslice
