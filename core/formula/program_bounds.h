// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "core/base/types.h"
#include "core/formula/interval.h"
#include "core/formula/program.h"

namespace ccslice {

/// Bounds of what run_program() gives, rounding included, where coordinates lie in `box` and inputs in `inputs`, by
/// interval arithmetic. Infinite on a side where none is found.
Interval program_bounds(const Program& program, const Box3& box, std::span<const Interval> inputs);

}  // namespace ccslice
