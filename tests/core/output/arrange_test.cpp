// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/arrange.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/raster/occupancy.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Of columns 10 to 12 and rows 20 to 21.
constexpr LayerWindow kFrom{10, 20, 3, 2};
const Bytes kSamples = {1, 2, 3, 4, 5, 6};
const Bytes kOutside = {9};

Bytes arranged(const Bytes& samples, std::size_t bytes, const Arrangement& arrangement) {
  Bytes out;
  const auto result = arrange(samples, Bytes(bytes, 9), arrangement, out, {});
  return {result.begin(), result.end()};
}

TEST(Arrange, LeavesWhatIsAsItShouldBeWhereItIs) {
  Bytes out;
  EXPECT_EQ(arrange(kSamples, kOutside, {kFrom, kFrom, {}}, out, {}).data(), kSamples.data());
}

TEST(Arrange, TurnsRowsAndColumns) {
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, kFrom, {true, false}}), (Bytes{3, 2, 1, 6, 5, 4}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, kFrom, {false, true}}), (Bytes{4, 5, 6, 1, 2, 3}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, kFrom, {true, true}}), (Bytes{6, 5, 4, 3, 2, 1}));
}

TEST(Arrange, CropsAndKeepsSamplesOfSeveralBytesTogether) {
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, {11, 20, 2, 2}, {}}), (Bytes{2, 3, 5, 6}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, {11, 21, 2, 1}, {true, true}}), (Bytes{6, 5}));
  EXPECT_EQ(arranged(kSamples, 3, {{0, 0, 2, 1}, {0, 0, 2, 1}, {true, false}}), (Bytes{4, 5, 6, 1, 2, 3}));
}

TEST(Arrange, PutsWhatThereIsIntoALargerPicture) {
  const LayerWindow larger{9, 19, 5, 3}, beside{11, 21, 3, 2};
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, larger, {}}), (Bytes{9, 9, 9, 9, 9, 9, 1, 2, 3, 9, 9, 4, 5, 6, 9}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, beside, {}}), (Bytes{5, 6, 9, 9, 9, 9}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, beside, {true, true}}), (Bytes{9, 9, 9, 9, 6, 5}));
  EXPECT_EQ(arranged(kSamples, 1, {kFrom, {30, 0, 2, 1}, {}}), (Bytes{9, 9}));
  EXPECT_EQ(held_window({kFrom, beside, {}}), (LayerWindow{0, 0, 2, 1}));
  EXPECT_EQ(held_window({kFrom, beside, {true, true}}), (LayerWindow{1, 1, 2, 1}));
}

// Rows and columns of a picture are counted up to the window's end.
TEST(Arrange, HoldsNothingBesideAllSamples) {
  for (const LayerWindow& beside : {LayerWindow{0, 0, 2, 2}, LayerWindow{0, 900, 2, 2}, LayerWindow{900, 0, 2, 2}}) {
    for (const bool descending : {false, true}) {
      EXPECT_EQ(held_window({kFrom, beside, {descending, descending}}), LayerWindow{});
    }
  }
}

TEST(Arrange, StopsWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  Bytes out;
  EXPECT_THROW(arrange(kSamples, kOutside, {kFrom, kFrom, {true, false}}, out, cancel), Error);
}

TEST(ArrangeSpans, CropsAndTurnsThemInOrder) {
  const std::vector<VoxelRun> spans = {{19, 0, 50}, {20, 5, 11}, {20, 12, 40}, {21, 11, 12}};
  BitImage image;
  std::vector<VoxelRun> arranged;
  const auto rows = [&](const PictureOrder& order) {
    arrange_spans(spans, {kFrom, kFrom, order}, arranged);
    draw_bits(arranged, kFrom.columns, kFrom.rows, image);
    return image.bits;
  };
  EXPECT_EQ(rows({}), (Bytes{0b10100000, 0b01000000}));
  EXPECT_EQ(rows({false, true}), (Bytes{0b01000000, 0b10100000}));
  const LayerWindow two{10, 20, 2, 2};
  arrange_spans(spans, {kFrom, two, {true, false}}, arranged);
  draw_bits(arranged, two.columns, two.rows, image);
  EXPECT_EQ(image.bits, (Bytes{0b01000000, 0b10000000})) << "nothing is left of what was there";
}

}  // namespace
}  // namespace ccslice
