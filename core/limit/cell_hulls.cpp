// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_hulls.h"

namespace ccslice {

void CellHulls::append(const Box3& part) {
  constexpr float kFloatRounding = 1e-5F;  // Rounding of floats near 1, with room.
  parts_.push_back({part.min().cast<float>().array() - kFloatRounding * (1 + part.min().cast<float>().array().abs()),
                    part.max().cast<float>().array() + kFloatRounding * (1 + part.max().cast<float>().array().abs())});
}

}  // namespace ccslice
