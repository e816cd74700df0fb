// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
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

TEST(FormulaSource, ReadsDistancesExactly) {
  std::size_t bounds_asked_for = 0;
  const auto zs = [&](const SourceRow& row, std::span<float> values) {
    bounds_asked_for += row.bounds.size();
    for (std::uint32_t k = 0; k < row.count; ++k) values[k] = static_cast<float>(row.mesh(k).z());
  };
  class Distance final : public ChannelSource {
   public:
    explicit Distance(std::function<void(const SourceRow&, std::span<float>)> fill) : fill_(std::move(fill)) {}
    const ChannelRange& range() const noexcept override { return range_; }
    void sample_row(const SourceRow& row, std::span<const std::span<const float>>,
                    std::span<float> values) const override {
      fill_(row, values);
    }
    double memory_bytes(const CancellationToken&) const override { return 1000; }

   private:
    ChannelRange range_{"distance", 0, 9};
    std::function<void(const SourceRow&, std::span<float>)> fill_;
  };
  const std::vector<std::string> channels = {"Core"};
  const FormulaSource sum({"Formula", -1000, 1000}, Formula::parse("distance(9) + 100*Core", channels),
                          FormulaFrame::kMesh, {std::make_shared<Distance>(zs)});
  EXPECT_THAT(sum.inputs(), ElementsAre("Core"));
  EXPECT_EQ(sum.memory_bytes(), 1000);
  const std::vector<float> core = {1, 2, 3, 4}, bounds = {0.5f};
  const std::span<const float> inputs[] = {core};
  SourceRow with_bounds = row();
  with_bounds.bounds = bounds;
  std::vector<float> values(4);
  sum.sample_row(with_bounds, inputs, values);
  EXPECT_THAT(values, ElementsAre(101, 203, 305, 407));
  EXPECT_EQ(bounds_asked_for, 0u);
}

TEST(FormulaSource, ClampsToItsRange) {
  const FormulaSource clamped = source("x", FormulaFrame::kWorld, 14.5);
  EXPECT_EQ(clamped.range().name, "Formula");
  EXPECT_THAT(sampled(clamped), ElementsAre(13, 14, 14.5, 14.5));
  EXPECT_THAT(sampled(source("-1e30", FormulaFrame::kWorld)), ElementsAre(-1000, -1000, -1000, -1000));
}

}  // namespace
}  // namespace ccslice
