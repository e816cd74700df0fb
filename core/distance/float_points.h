// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points and triangles of floats, mm.

#pragma once

#include <array>

#include "core/base/types.h"

namespace ccslice {

using FloatPoint = std::array<float, 3>;
using FloatTriangle = std::array<FloatPoint, 3>;

inline FloatPoint to_float_point(const Vec3& p) noexcept {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}
inline Vec3 to_vec3(const FloatPoint& p) noexcept { return {p[0], p[1], p[2]}; }

}  // namespace ccslice
