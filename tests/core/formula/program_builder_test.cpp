// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/program_builder.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/base/lanes.h"

namespace ccslice {
namespace {

using Value = ProgramBuilder::Value;

TEST(ProgramBuilder, FoldsConstants) {
  ProgramBuilder builder;
  const Value sum = builder.apply(Op::kAdd, builder.constant(2), builder.constant(3));
  const Program program = builder.finish(builder.power(sum, builder.constant(3)));
  EXPECT_TRUE(program.instructions.empty());
  EXPECT_TRUE(program.result.constant);
  EXPECT_EQ(program.constants[program.result.index * kLanes], 125);
}

TEST(ProgramBuilder, MakesEqualValuesOnce) {
  ProgramBuilder builder;
  const Value x = builder.coordinate(Op::kX);
  EXPECT_EQ(builder.coordinate(Op::kX), x);
  const Value sine = builder.apply(Op::kSine, x);
  EXPECT_EQ(builder.apply(Op::kSine, x), sine);
  EXPECT_NE(builder.apply(Op::kCosine, x), sine);
  EXPECT_EQ(builder.apply(Op::kMultiply, x, x), builder.apply(Op::kSquare, x));
  EXPECT_EQ(builder.power(x, builder.constant(2)), builder.apply(Op::kSquare, x));
  EXPECT_NE(builder.constant(0.0), builder.constant(-0.0));
}

TEST(ProgramBuilder, UsesRegistersAgain) {
  ProgramBuilder builder;
  const Value x = builder.coordinate(Op::kX), y = builder.coordinate(Op::kY);
  Value value = x;
  for (int i = 0; i < 100; ++i) value = builder.apply(Op::kAdd, builder.apply(Op::kMultiply, value, y), x);
  EXPECT_EQ(builder.finish(value).registers, 3);
}

TEST(ProgramBuilder, KeepsWhatIsReadLater) {
  ProgramBuilder builder;
  const Value x = builder.coordinate(Op::kX);
  Value sum = x;
  std::vector<Value> kept;
  for (int i = 0; i < 50; ++i) kept.push_back(builder.apply(Op::kAdd, x, builder.constant(i + 1)));
  for (const Value each : kept) sum = builder.apply(Op::kAdd, sum, each);
  EXPECT_EQ(builder.finish(sum).registers, 51);
}

}  // namespace
}  // namespace ccslice
