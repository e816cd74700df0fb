// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/roff.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(Roff, ShowsTextAsItIs) {
  EXPECT_EQ(roff("plain text."), "plain text.");
  EXPECT_EQ(roff("--map a\\b"), "\\-\\-map a\\eb");
  EXPECT_EQ(roff(".SH\n'x\na.b"), "\\&.SH\n\\&'x\na.b");
  EXPECT_EQ(roff(""), "");
}

}  // namespace
}  // namespace ccslice
