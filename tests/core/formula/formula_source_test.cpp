// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;

/// Along x of the world, which is z of the mesh.
SourceRow row() { return {Vec3(10, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, -5), Vec3(0, 0, 2), 3, 4}; }

std::vector<float> sampled(const FormulaSource& source, std::span<const std::span<const float>> inputs = {}) {
  std::vector<float> values(row().count);
  source.sample_row(row(), inputs, values);
  return values;
}

FormulaSource source(const std::string& text, FormulaFrame frame, double most = 1000) {
  const std::vector<std::string> channels = {"Core"};
  return {{"Formula", -1000, most}, Formula::parse(text, channels), frame};
}

TEST(FormulaSource, SamplesInEitherFrame) {
  EXPECT_THAT(sampled(source("x + 100 * z", FormulaFrame::kWorld)), ElementsAre(13, 14, 15, 16));
  EXPECT_THAT(sampled(source("x + 100 * z", FormulaFrame::kMesh)), ElementsAre(100, 300, 500, 700));
}

TEST(FormulaSource, ReadsInputsAtTheSamePoints) {
  const FormulaSource doubled = source("2 * Core", FormulaFrame::kMesh);
  EXPECT_THAT(doubled.inputs(), ElementsAre("Core"));
  const std::vector<float> core = {1, 2, 3, 4};
  const std::span<const float> inputs[] = {core};
  EXPECT_THAT(sampled(doubled, inputs), ElementsAre(2, 4, 6, 8));
}

TEST(FormulaSource, ClampsToItsRange) {
  const FormulaSource clamped = source("x", FormulaFrame::kWorld, 14.5);
  EXPECT_EQ(clamped.range().name, "Formula");
  EXPECT_THAT(sampled(clamped), ElementsAre(13, 14, 14.5, 14.5));
  EXPECT_THAT(sampled(source("-1e30", FormulaFrame::kWorld)), ElementsAre(-1000, -1000, -1000, -1000));
}

}  // namespace
}  // namespace ccslice
