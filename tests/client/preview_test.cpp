// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/preview.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;

/// A picture of 2 x 3 pixels in two parts, then one with an outline.
std::vector<v1::PreviewResponse> good_parts() {
  std::vector<v1::PreviewResponse> parts(3);
  for (v1::PreviewResponse& part : parts) {
    part.set_number(7);
    part.set_stage(v1::PREVIEW_STAGE_FULL);
  }
  parts[0].mutable_header()->set_width(2);
  parts[0].mutable_header()->set_height(3);
  parts[0].mutable_header()->set_picture_bytes(24);
  parts[0].set_picture(std::string(16, 'a'));
  parts[1].set_picture(std::string(8, 'b'));
  parts[2].add_outlines()->add_points_mm(1);
  parts[2].set_last(true);
  return parts;
}

std::string error_of_parts(std::vector<v1::PreviewResponse> parts, PreviewAssembler assembler = PreviewAssembler()) {
  try {
    for (v1::PreviewResponse& part : parts) assembler.add(std::move(part));
  } catch (const ClientError& error) {
    EXPECT_EQ(error.reason(), local_reason::kAnswerCorrupt);
    return error.what();
  }
  return {};
}

TEST(PreviewAssembler, PutsPicturesTogether) {
  PreviewAssembler assembler;
  for (int round = 0; round < 2; ++round) {
    std::vector<v1::PreviewResponse> parts = good_parts();
    EXPECT_FALSE(assembler.add(std::move(parts[0])));
    EXPECT_FALSE(assembler.add(std::move(parts[1])));
    const auto picture = assembler.add(std::move(parts[2]));
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->number, 7u);
    EXPECT_EQ(picture->bytes, std::string(16, 'a') + std::string(8, 'b'));
    EXPECT_EQ(picture->outlines.size(), 1u);
  }
}

TEST(PreviewAssembler, RefusesWhatIsOutOfShape) {
  const auto changed = [](auto&& change) {
    std::vector<v1::PreviewResponse> parts = good_parts();
    change(parts);
    return error_of_parts(parts);
  };
  EXPECT_EQ(changed([](auto&) {}), "");
  EXPECT_THAT(changed([](auto& p) { p[0].clear_header(); }), HasSubstr("a part of no picture"));
  EXPECT_THAT(changed([](auto& p) { *p[1].mutable_header() = p[0].header(); }), HasSubstr("inside another one"));
  EXPECT_THAT(changed([](auto& p) { p[1].set_number(8); }), HasSubstr("a part of another picture"));
  EXPECT_THAT(changed([](auto& p) { p[1].set_stage(v1::PREVIEW_STAGE_COARSE); }), HasSubstr("of another picture"));
  EXPECT_THAT(changed([](auto& p) { p[1].set_picture(std::string(9, 'b')); }), HasSubstr("longer than announced"));
  EXPECT_THAT(changed([](auto& p) { p[1].clear_picture(); }), HasSubstr("shorter than announced"));
  EXPECT_THAT(changed([](auto& p) { p[0].mutable_header()->set_width(0); }), HasSubstr("impossible size"));
  EXPECT_THAT(changed([](auto& p) { p[0].mutable_header()->set_height(5000); }), HasSubstr("impossible size"));
  EXPECT_THAT(changed([](auto& p) { p[0].mutable_header()->set_picture_bytes(1ull << 40); }),
              HasSubstr("impossible length"));
}

TEST(PreviewAssembler, TakesNoPartsThatBringNothingForLong) {
  std::vector<v1::PreviewResponse> parts = good_parts();
  parts[1].clear_picture();
  parts.insert(parts.begin() + 1, parts[1]);
  EXPECT_THAT(error_of_parts(parts), HasSubstr("parts of a picture with nothing in them"));
}

TEST(PreviewAssembler, TakesNoMoreOutlinesThanThereCanBe) {
  const auto error_of_outlines = [](int outlines, int points) {
    std::vector<v1::PreviewResponse> parts = good_parts();
    parts[2].clear_outlines();
    for (int i = 0; i < outlines; ++i) {
      v1::PreviewOutline& outline = *parts[1].add_outlines();
      for (int k = 0; k < 2 * points; ++k) outline.add_points_mm(k);
    }
    return error_of_parts(parts, PreviewAssembler(/*most_outline_points=*/100));
  };
  EXPECT_EQ(error_of_outlines(2, 40), "");
  EXPECT_THAT(error_of_outlines(2, 50), HasSubstr("more outlines than there can be"));
  EXPECT_THAT(error_of_outlines(30, 0), HasSubstr("more outlines than there can be")) << "each takes memory of its own";
}

}  // namespace
}  // namespace ccslice::client
