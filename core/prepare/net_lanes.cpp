// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/net_lanes.h"

namespace ccslice {
namespace {

// What the test of boxes itself rounds, with room. A determinant that is less than a thousandth of what the columns'
// lengths allow isn't looked at: rounding would be more of it.
constexpr float kBoxRounding = 1e-3F, kLeastDeterminant = 1e-3F;

using MatrixLanes = std::array<PointLanes, 3>;  // Columns.

PointLanes cross(const PointLanes& a, const PointLanes& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

FloatLanes dot(const PointLanes& a, const PointLanes& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }

PointLanes magnitudes(const PointLanes& p) noexcept { return {absolute(p.x), absolute(p.y), absolute(p.z)}; }

FloatLanes longest(const PointLanes& p) noexcept {
  const PointLanes lengths = magnitudes(p);
  return greater(greater(lengths.x, lengths.y), lengths.z);
}

/// Bit k: I - S is an M-matrix, S having no negative entry.
unsigned keeping_regular(const MatrixLanes& s) noexcept {
  const FloatLanes a = 1 - s[0].x, b = 1 - s[1].y, c = 1 - s[2].z;
  const FloatLanes corner = a * b - s[1].x * s[0].y;
  const FloatLanes whole =
      c * corner - a * s[2].y * s[1].z - b * s[2].x * s[0].z - s[0].y * s[1].z * s[2].x - s[0].z * s[2].y * s[1].x;
  return float_lanes_of(a > 0) & float_lanes_of(corner > 0) & float_lanes_of(whole > 0);
}

/// Calls visit(p) for the first of each four points along an axis, which are kStep = 4^axis apart.
template <std::size_t kStep, typename Visit>
void for_each_quad(std::size_t count, Visit visit) {
  for (std::size_t block = 0; block < count; block += 4 * kStep) {
    for (std::size_t p = block; p < block + kStep; ++p) visit(p);
  }
}

template <std::size_t kStep>
void fill_phantoms_along(std::span<PointLanes> grid, bool low, bool high) noexcept {
  if (!low && !high) return;
  for_each_quad<kStep>(grid.size(), [&](std::size_t p) {
    if (low) grid[p] = 2 * grid[p + kStep] - grid[p + 2 * kStep];
    if (high) grid[p + 3 * kStep] = 2 * grid[p + 2 * kStep] - grid[p + kStep];
  });
}

/// One coordinate after the other: four of each fit into registers.
template <std::size_t kStep>
void bezier_along(std::span<PointLanes> grid) noexcept {
  constexpr float kThird = 1.0F / 3, kSixth = 1.0F / 6;
  for_each_quad<kStep>(grid.size(), [&](std::size_t p) {
    for (FloatLanes PointLanes::*coordinate : {&PointLanes::x, &PointLanes::y, &PointLanes::z}) {
      FloatLanes &a = grid[p].*coordinate, &b = grid[p + kStep].*coordinate;
      FloatLanes &c = grid[p + 2 * kStep].*coordinate, &d = grid[p + 3 * kStep].*coordinate;
      const FloatLanes first = b, last = c, both = b + c;
      b = kThird * (both + first), c = kThird * (both + last);
      a = kSixth * multiply_add(first, 4, a + last), d = kSixth * multiply_add(last, 4, d + first);
    }
  });
}

template <std::size_t kStep>
void extend_along(std::span<const PointLanes> net, BoxLanes& box) noexcept {
  BoxLanes here = box;
  for_each_quad<kStep>(net.size(), [&](std::size_t p) {
    for (std::size_t i = p; i < p + 3 * kStep; i += kStep) here.extend(net[i + kStep] - net[i]);
  });
  box = here;
}

}  // namespace

unsigned proper_lanes(const std::array<BoxLanes, 3>& columns) noexcept {
  MatrixLanes centre, radius;
  for (std::size_t c = 0; c < 3; ++c) {
    centre[c] = 0.5F * (columns[c].high + columns[c].low);
    radius[c] = 0.5F * (columns[c].high - columns[c].low);
  }
  // Rows of the inverse, times the determinant.
  const MatrixLanes rows = {cross(centre[1], centre[2]), cross(centre[2], centre[0]), cross(centre[0], centre[1])};
  const FloatLanes determinant = dot(centre[0], rows[0]);
  const FloatLanes least = kLeastDeterminant * longest(centre[0]) * longest(centre[1]) * longest(centre[2]);
  const FloatLanes per_determinant = (1 + kBoxRounding) / determinant;
  MatrixLanes spread;
  for (std::size_t c = 0; c < 3; ++c) {
    spread[c] = {dot(magnitudes(rows[0]), radius[c]) * per_determinant,
                 dot(magnitudes(rows[1]), radius[c]) * per_determinant,
                 dot(magnitudes(rows[2]), radius[c]) * per_determinant};
  }
  return float_lanes_of(determinant > least) & keeping_regular(spread);
}

void fill_phantoms(std::span<PointLanes> grid, PhantomMask phantoms) noexcept {
  fill_phantoms_along<1>(grid, phantoms & 1, phantoms & 2);
  if (grid.size() >= 16) fill_phantoms_along<4>(grid, phantoms & 4, phantoms & 8);
  if (grid.size() >= 64) fill_phantoms_along<16>(grid, phantoms & 16, phantoms & 32);
}

void bspline_to_bezier(std::span<PointLanes> grid) noexcept {
  bezier_along<1>(grid);
  if (grid.size() >= 16) bezier_along<4>(grid);
  if (grid.size() >= 64) bezier_along<16>(grid);
}

void extend_by_differences(std::span<const PointLanes> net, std::array<BoxLanes, 3>& columns) noexcept {
  extend_along<1>(net, columns[0]);
  extend_along<4>(net, columns[1]);
  extend_along<16>(net, columns[2]);
}

}  // namespace ccslice
