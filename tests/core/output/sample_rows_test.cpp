// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/sample_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;

TEST(SampleRows, AreThoseOfTheImageWithoutAWindow) {
  const std::vector<std::uint8_t> samples{1, 2, 3, 4, 5, 6};
  const SampleImage image{.type = SampleType::kUint8, .width = 3, .height = 2, .samples = samples};
  SampleRows rows(image);
  EXPECT_THAT(rows(0), ElementsAre(1, 2, 3));
  EXPECT_THAT(rows(1), ElementsAre(4, 5, 6));
  EXPECT_THAT(rows.outside(), ElementsAre(0, 0, 0));
}

TEST(SampleRows, ShowWhatIsOutsideRoundAWindow) {
  const std::vector<std::uint8_t> samples{1, 2, 3, 4};
  const SampleImage image{.type = SampleType::kUint16,
                          .width = 3,
                          .height = 3,
                          .samples = samples,
                          .outside = {7, 8},
                          .window = LayerWindow{1, 1, 2, 1}};
  SampleRows rows(image);
  EXPECT_THAT(rows(0), ElementsAre(7, 8, 7, 8, 7, 8));
  EXPECT_THAT(rows(1), ElementsAre(7, 8, 1, 2, 3, 4));
  EXPECT_THAT(rows(2), ElementsAre(7, 8, 7, 8, 7, 8));
}

TEST(SampleRows, PlaceBitsThatBeginWithinAByte) {
  const std::vector<std::uint8_t> samples{0b10100000};
  const SampleImage image{
      .type = SampleType::kBit, .width = 12, .height = 1, .samples = samples, .window = LayerWindow{6, 0, 3, 1}};
  SampleRows rows(image);
  EXPECT_THAT(rows(0), ElementsAre(0b00000010, 0b10000000));
}

TEST(SampleRows, HoldNothingOfAnEmptyWindow) {
  const SampleImage image{
      .type = SampleType::kUint8, .width = 2, .height = 2, .samples = {}, .outside = {9}, .window = LayerWindow{}};
  SampleRows rows(image);
  for (const std::uint32_t y : {0u, 1u}) EXPECT_THAT(rows(y), ElementsAre(9, 9));
}

TEST(SampleRows, HaveTheSamplesOfAllChannels) {
  const std::vector<std::uint8_t> samples{1, 2};
  const std::vector<std::string> names{"a", "b"};
  const SampleImage image{.type = SampleType::kUint8,
                          .width = 2,
                          .height = 1,
                          .samples = samples,
                          .channel_names = names,
                          .outside = {5},
                          .window = LayerWindow{1, 0, 1, 1}};
  SampleRows rows(image);
  EXPECT_THAT(rows(0), ElementsAre(5, 5, 1, 2));
}

}  // namespace
}  // namespace ccslice
