// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A FRAME chooses axes for a cell: framed corner j (bits) is the cell's corner origin ^ (bit a of j moved to bit
// axis[a], for every a). In parameters: framed coordinate a is the cell's coordinate axis[a], or one minus it where the
// origin's bit is set. 48 frames, of which the 24 proper ones (rotations) keep the sign of the Jacobian.

#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/base/types.h"

namespace ccslice {

struct Frame {
  std::array<std::uint8_t, 3> axis = {0, 1, 2};
  std::uint8_t origin = 0;

  constexpr std::uint8_t corner(unsigned framed) const {
    unsigned bits = origin;
    for (unsigned a = 0; a < 3; ++a) bits ^= (framed >> a & 1u) << axis[a];
    return static_cast<std::uint8_t>(bits);
  }
  constexpr bool proper() const {
    const bool even = axis[1] == (axis[0] + 1) % 3;
    return even == (std::popcount(origin) % 2 == 0);
  }
  /// The one of x, y and z, which belong to the cell's axes, that belongs to a framed axis. It stays in registers:
  /// numbers written one by one to memory and read back in pairs would stall.
  template <typename T>
  constexpr T along(std::size_t framed, T x, T y, T z) const {
    return axis[framed] == 0 ? x : axis[framed] == 1 ? y : z;
  }
  constexpr bool is_mirrored(std::size_t framed) const { return origin >> axis[framed] & 1; }
  Vec3 to_framed(const Vec3& uvw) const {
    const double x = uvw[0], y = uvw[1], z = uvw[2];
    const auto coordinate = [&](std::size_t a) { return is_mirrored(a) ? 1 - along(a, x, y, z) : along(a, x, y, z); };
    return {coordinate(0), coordinate(1), coordinate(2)};
  }
  Vec3 from_framed(const Vec3& framed) const {
    Vec3 uvw;
    for (std::size_t a = 0; a < 3; ++a) {
      const double coordinate = framed[static_cast<Eigen::Index>(a)];
      uvw[axis[a]] = is_mirrored(a) ? 1 - coordinate : coordinate;
    }
    return uvw;
  }
  friend bool operator==(const Frame&, const Frame&) = default;
};

/// The proper frame whose origin is `corner` and whose third axis runs along the cell's axis `along`.
constexpr Frame frame_at(std::uint8_t corner, std::uint8_t along) {
  const auto next = static_cast<std::uint8_t>((along + 1) % 3), last = static_cast<std::uint8_t>((along + 2) % 3);
  const Frame frame{{next, last, along}, corner};
  return frame.proper() ? frame : Frame{{last, next, along}, corner};
}

}  // namespace ccslice
