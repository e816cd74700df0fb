// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/unzip.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"

namespace ccslice {
namespace {

std::string text() {
  std::string text;
  for (std::int64_t i = 0; i < 100'000; ++i) text += std::to_string(i * i);
  return text;
}

TEST(Unzip, UnpacksGzipAndZlib) {
  EXPECT_TRUE(is_gzip(gzipped(text())));
  EXPECT_FALSE(is_gzip(zlibbed(text())));
  EXPECT_EQ(unzip(gzipped(text()), 1 << 30, "it"), text());
  EXPECT_EQ(unzip(zlibbed(text()), 1 << 30, "it"), text());
  EXPECT_EQ(unzip(gzipped(""), 1 << 30, "it"), "");
}

TEST(Unzip, TakesSeveralMembersAsOne) {
  EXPECT_EQ(unzip(gzipped("a") + gzipped(text()) + gzipped("z"), 1 << 30, "it"), "a" + text() + "z");
}

/// Programs that pack in parallel write many of them.
TEST(Unzip, TakesManyMembersInLittleTime) {
  std::string members;
  for (int i = 0; i < 50'000; ++i) members += gzipped("ab");
  members += gzipped(std::string(8 << 20, 'c'));
  for (int i = 0; i < 50'000; ++i) members += gzipped("");
  EXPECT_EQ(unzip(members, 1 << 30, "it").size(), 100'000u + (8 << 20));
}

TEST(Unzip, StopsAtTheMost) {
  EXPECT_EQ(unzip(gzipped(text()), 100, "it"), text().substr(0, 100));
  const std::string bomb = gzipped(std::string(64 << 20, '\0'));
  EXPECT_LT(bomb.size(), 100'000u);
  EXPECT_EQ(unzip(bomb, 1000, "it").size(), 1000u);
}

TEST(Unzip, RefusesWhatIsCutOffOrNone) {
  const std::string packed = gzipped(text());
  for (const std::size_t length : {std::size_t{0}, std::size_t{5}, packed.size() / 2, packed.size() - 9}) {
    expect_error([&] { (void)unzip(packed.substr(0, length), 1 << 30, "the samples"); }, ErrorCode::kFileSyntax,
                 "the samples can't be unpacked: it ends too early");
  }
  expect_error([] { (void)unzip("what else", 1 << 30, "it"); }, ErrorCode::kFileSyntax, "it can't be unpacked");
}

}  // namespace
}  // namespace ccslice
