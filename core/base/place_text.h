// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Places, in messages for people.

#pragma once

#include <string>

#include "core/base/number_text.h"
#include "core/base/types.h"

namespace ccslice {

/// "(1.5, 0, 20) mm".
inline std::string place_text(const Vec3& place, int significant_digits) {
  const auto text = [=](double number) { return number_text(number, significant_digits); };
  return "(" + text(place.x()) + ", " + text(place.y()) + ", " + text(place.z()) + ") mm";
}

}  // namespace ccslice
