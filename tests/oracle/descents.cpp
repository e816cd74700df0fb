// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/descents.h"

namespace ccslice::oracle {

void compare_on_descent(const Subject& subject, LimitEvaluator& evaluator, LimitCellId limit_cell,
                        const Descent& descent, std::mt19937& random, WorstError& worst) {
  OneRing ring = subject.one_ring(limit_cell);
  for (int level = 0; level <= descent.levels; ++level) {
    for (int bits = 0; bits < 8; ++bits) {
      const bool at_end = descent.irregular_end && level == descent.levels;
      if (!at_end && !ring.mask_at_corner(kVtkCorner[bits])) continue;
      const CellParam at = subject.locate_corner(ring.focus().from, bits);
      subject.compare(evaluator, at, ring.limit_at_corner(kVtkCorner[bits]), worst);
    }
    if (level == descent.levels) break;
    const int wander = static_cast<int>(random() % 8);
    ring = ring.child((descent.fixed_bits & descent.fixed_axes) | (wander & ~descent.fixed_axes));
  }
}

Descent random_descent(std::mt19937& random, int levels, bool irregular_end) {
  Descent descent;
  descent.levels = levels;
  descent.irregular_end = irregular_end;
  descent.fixed_bits = static_cast<int>(random() % 8);
  constexpr std::array<int, 8> kAxes = {7, 7, 3, 5, 6, 1 << 1, 0, 7};
  descent.fixed_axes = kAxes[random() % 8];
  return descent;
}

}  // namespace ccslice::oracle
