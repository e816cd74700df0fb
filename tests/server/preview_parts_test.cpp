// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_parts.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ccslice::server {
namespace {

std::vector<v1::PreviewResponse> picture(v1::PreviewStage stage, const std::string& bytes) {
  std::vector<v1::PreviewResponse> parts;
  for (const char byte : bytes) {
    parts.emplace_back().set_picture(std::string(1, byte));
    parts.back().set_stage(stage);
  }
  return parts;
}

std::string take(PreviewParts& parts, std::size_t count) {
  std::string taken;
  for (std::size_t k = 0; k < count && !parts.empty(); ++k) taken += parts.take().picture();
  return taken;
}

TEST(PreviewParts, AreTakenInOrder) {
  PreviewParts parts;
  parts.begin();
  EXPECT_TRUE(parts.add(v1::PREVIEW_STAGE_COARSE, picture(v1::PREVIEW_STAGE_COARSE, "ab")));
  EXPECT_TRUE(parts.add(v1::PREVIEW_STAGE_FULL, picture(v1::PREVIEW_STAGE_FULL, "cd")));
  EXPECT_FALSE(parts.has_sent_any(v1::PREVIEW_STAGE_COARSE));
  EXPECT_EQ(take(parts, 2), "ab");
  EXPECT_TRUE(parts.has_sent_all(v1::PREVIEW_STAGE_COARSE));
  EXPECT_FALSE(parts.has_sent_any(v1::PREVIEW_STAGE_FULL));
  EXPECT_EQ(take(parts, 5), "cd");
  EXPECT_FALSE(parts.lacks_any());
}

TEST(PreviewParts, ThatWereSentAreLeftOutWhenAPictureComesAgain) {
  PreviewParts parts;
  parts.begin();
  parts.add(v1::PREVIEW_STAGE_COARSE, picture(v1::PREVIEW_STAGE_COARSE, "ab"));
  parts.add(v1::PREVIEW_STAGE_FULL, picture(v1::PREVIEW_STAGE_FULL, "cdef"));
  EXPECT_EQ(take(parts, 1), "a");
  parts.drop();
  EXPECT_TRUE(parts.lacks_any() && parts.empty());
  parts.begin_again();
  EXPECT_FALSE(parts.add(v1::PREVIEW_STAGE_COARSE, picture(v1::PREVIEW_STAGE_COARSE, "ab")));
  EXPECT_FALSE(parts.add(v1::PREVIEW_STAGE_FULL, picture(v1::PREVIEW_STAGE_FULL, "cdef")));
  EXPECT_EQ(take(parts, 3), "bcd");
  EXPECT_FALSE(parts.has_sent_all(v1::PREVIEW_STAGE_FULL));
  parts.drop();
  parts.begin_again();
  parts.add(v1::PREVIEW_STAGE_FULL, picture(v1::PREVIEW_STAGE_FULL, "cdef"));
  EXPECT_EQ(take(parts, 9), "ef");
  EXPECT_TRUE(parts.has_sent_all(v1::PREVIEW_STAGE_FULL));
  parts.drop();
  EXPECT_FALSE(parts.lacks_any()) << "nothing was dropped";
  parts.begin();
  EXPECT_FALSE(parts.has_sent_any(v1::PREVIEW_STAGE_FULL));
}

}  // namespace
}  // namespace ccslice::server
