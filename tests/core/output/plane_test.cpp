// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/plane.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace ccslice {
namespace {

TEST(SampleBytes, PadRowsOfBitsToWholeBytes) {
  EXPECT_EQ(sample_bytes(SampleType::kBit, 9, 3), 6u);
  EXPECT_EQ(sample_bytes(SampleType::kUint2, 5, 3), 6u);
  EXPECT_EQ(sample_bytes(SampleType::kUint4, 5, 3), 9u);
  EXPECT_EQ(sample_bytes(SampleType::kBit, 0, 3), 0u);
}

TEST(SampleBytes, CountChannelsOfWiderSamples) {
  EXPECT_EQ(sample_bytes(SampleType::kUint8, 5, 3), 15u);
  EXPECT_EQ(sample_bytes(SampleType::kUint16, 5, 3, 2), 60u);
  EXPECT_EQ(sample_bytes(SampleType::kFloat32, 100'000, 100'000), 40'000'000'000u);
}

TEST(SampleBytes, OfAWindowAreThoseOfItsRowsAndColumns) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannels;
  plane.channels = {"a", "b"};
  plane.sample_type = SampleType::kFloat32;
  EXPECT_EQ(sample_bytes(plane, {.first_column = 2, .first_row = 7, .columns = 5, .rows = 3}), 120u);
}

TEST(SampleBytes, OfAnUnknownTypeAreRefused) {
  EXPECT_THROW((void)sample_bytes(static_cast<SampleType>(99), 1, 1), Error);
}

}  // namespace
}  // namespace ccslice
