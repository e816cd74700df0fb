// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The operations of programs (operations.h) on intervals: each result holds what the operation makes of any numbers of
// its operands, as computed.
//
// + - * / and square roots are rounded to the nearest double, which keeps their order. So bounds that are computed
// alike are true without more. Elementary functions are within 2 units in the last place, and widened by more.

#pragma once

#include "core/formula/interval.h"
#include "core/formula/program.h"

namespace ccslice {

/// REQUIRES: an operation on values; operands that it hasn't are ignored.
Interval on_intervals(Op op, const Interval& a, const Interval& b, const Interval& c) noexcept;

}  // namespace ccslice
