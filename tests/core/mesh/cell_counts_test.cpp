// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_counts.h"

#include <gtest/gtest.h>

#include "core/base/count_text.h"

namespace ccslice {
namespace {

TEST(CellCounts, HaveTheNounThatThePluralIsOf) {
  for (const CellKindTraits& traits : kCellKinds) EXPECT_EQ(plural_of(noun_of(traits.kind)), traits.plural);
  EXPECT_EQ(count_text(1, noun_of(CellKind::kWedge)), "1 wedge");
}

}  // namespace
}  // namespace ccslice
