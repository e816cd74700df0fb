// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How the layers of a random job are delivered, in encodings, orders and contours of all kinds; and what is read of
// them, without the code that wrote them where there is another way.

#pragma once

#include <string>

#include "core/limit/limit_solid.h"
#include "tests/oracle/hostile/hostile_finding.h"
#include "tests/oracle/hostile/hostile_job.h"
#include "tests/oracle/hostile/hostile_random.h"

namespace ccslice::oracle {

/// The job with other encodings of some planes, with columns or rows descending, and with contours, by cell region
/// where there are some. Appends what that is to the text.
SliceJob draw_hostile_pictures(HostileRandom& random, const SolidSummary& solid, const SliceJob& job,
                               std::string& text);

/// All planes raw, rows and columns ascending, no contours, and maps that take any values.
SliceJob without_pictures(SliceJob asked);

/// A layer of `asked`, as without_pictures(asked) would have it: of all of the grid, or of a region of this extent.
/// Counts planes whose checksum, size or alpha is wrong. Throws std::runtime_error for files that can't be read.
Layer read_pictures(const SolidSummary& solid, const SliceJob& asked, const Layer& layer, const GridExtent& extent,
                    HostileFinding& finding);

}  // namespace ccslice::oracle
