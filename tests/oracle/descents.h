// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Descents: from a limit cell's one-ring to one of its children, and on, comparing the corners of every cell on the
// way.

#pragma once

#include <random>

#include "tests/oracle/subject.h"

namespace ccslice::oracle {

struct Descent {
  int levels = 16;
  int fixed_bits = 0;          // Where the descent goes along the axes of `fixed_axes`: towards a corner or an edge.
  int fixed_axes = 7;          // Bit d: axis d is fixed; the others wander at random.
  bool irregular_end = false;  // At the end, compare corners too whose limit must be found by refining.
};

/// Compares at all corners of the cells of the descent whose limit is known in closed form.
void compare_on_descent(const Subject& subject, LimitEvaluator& evaluator, LimitCellId limit_cell,
                        const Descent& descent, std::mt19937& random, WorstError& worst);

/// Corners, edges and the inside: fixed_axes with 3, 2, 1 or no axes.
Descent random_descent(std::mt19937& random, int levels, bool irregular_end);

}  // namespace ccslice::oracle
