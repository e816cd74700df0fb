// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/header_sizes.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/server/service/http2_bytes.h"

namespace ccslice::server {
namespace {

using namespace std::string_literals;

constexpr std::size_t kMost = HeaderSizes::kMostBytes, kEach = HeaderSizes::kHeaderBytes;

bool takes(HeaderSizes& sizes, const std::string& bytes) { return sizes.take(bytes_of(bytes)); }

/// How many times a list may have these bytes.
std::size_t most_times(HeaderSizes& sizes, const std::string& bytes) {
  sizes.begin_list();
  std::size_t count = 0;
  while (takes(sizes, bytes)) ++count;
  return count;
}
std::size_t most_times(const std::string& bytes) {
  HeaderSizes sizes;
  return most_times(sizes, bytes);
}

/// What a list comes to: the rest has room for one more header of so much text.
std::size_t bytes_of_list(const std::string& list) {
  HeaderSizes sizes;
  EXPECT_TRUE(takes(sizes, list));
  std::size_t most = 0;
  for (HeaderSizes more = sizes; takes(more, literal("", std::string(most + 1, 'v'))); more = sizes) ++most;
  return kMost - kEach - most;
}

TEST(HeaderSizes, CountEachHeaderBesidesItsText) {
  EXPECT_EQ(most_times(literal("", "")), kMost / kEach);
  EXPECT_EQ(most_times(literal("name", "value")), kMost / (kEach + 9));
  EXPECT_EQ(most_times(literal("name", std::string(1000, 'v'))), kMost / (kEach + 1004));
  EXPECT_EQ(most_times("\x0f\x01\x05value"s), kMost / (kEach + 32 + 5)) << "the name of an entry of the static table";
}

TEST(HeaderSizes, CountAReferenceAsWhatItStandsFor) {
  HeaderSizes sizes;
  ASSERT_TRUE(takes(sizes, literal(std::string(3000, 'n'), std::string(500, 'v'), kKept)));
  EXPECT_EQ(most_times(sizes, "\xbe"), kMost / (kEach + 3500));
  HeaderSizes others;
  ASSERT_TRUE(takes(others, literal(std::string(3000, 'n'), std::string(500, 'v'), kKept) + literal("n", "v", kKept)));
  EXPECT_EQ(most_times(others, "\xbe"), kMost / (kEach + 2));
  others.begin_list();
  EXPECT_EQ(most_times(others, "\xbf"), kMost / (kEach + 3500));
  EXPECT_EQ(most_times(others, "\x0f\x30\x01w"s), kMost / (kEach + 3000 + 1)) << "its name alone";
}

TEST(HeaderSizes, CountTheLettersOfHuffmansCode) {
  EXPECT_EQ(bytes_of_list("\0\x01n\x8a"s + std::string(10, '\0')), kEach + 1 + 16) << "five bits each";
  const auto value_of = [](const std::string& code) {
    return "\0\x01n"s + static_cast<char>(0x80 | code.size()) + code;
  };
  // RFC 7541, C.4.1 and C.6.1.
  const std::string host = "\xf1\xe3\xc2\xe5\xf2\x3a\x6b\xa0\xab\x90\xf4\xff";  // www.example.com
  EXPECT_EQ(bytes_of_list(value_of(host)), kEach + 1 + 15);
  const std::string date =  // Mon, 21 Oct 2013 20:13:21 GMT
      "\xd0\x7a\xbe\x94\x10\x54\xd4\x44\xa8\x20\x05\x95\x04\x0b\x81\x66\xe0\x82\xa6\x2d\x1b\xff";
  EXPECT_EQ(bytes_of_list(value_of(date)), kEach + 1 + 29);
}

TEST(HeaderSizes, CountWhatTheTableMayHaveDroppedAsTheLargestEntry) {
  HeaderSizes sizes;
  ASSERT_TRUE(takes(sizes, literal("old", "", kKept) + literal(std::string(4040, 'n'), "", kKept)));
  EXPECT_EQ(most_times(sizes, "\xbf"), kMost / (kEach + 4064));
  EXPECT_EQ(most_times("\xbe"), kMost / (kEach + 4064)) << "not there";
}

TEST(HeaderSizes, KeepAnEntryThatMayBeTooLargeForTheTableAsLargeAsThat) {
  HeaderSizes sizes;
  // 3,000 bytes of Huffman's code, 4,800 letters.
  ASSERT_TRUE(takes(sizes, literal("old", "", kKept) + "\x40\x01n\xff\xb9\x16"s + std::string(3000, '\0')));
  EXPECT_EQ(most_times(sizes, "\xbe"), kMost / (kEach + 4064));
  sizes.begin_list();
  ASSERT_TRUE(takes(sizes, literal("new", "", kKept)));
  EXPECT_EQ(most_times(sizes, "\xbe"), kMost / (kEach + 3));
}

TEST(HeaderSizes, FollowTheTablesSize) {
  HeaderSizes sizes;
  ASSERT_TRUE(takes(sizes, literal("name", "value", kKept) + "\x20" + "\x3f\x21"s));  // 0, then 64.
  EXPECT_EQ(most_times(sizes, "\xbe"), kMost / (kEach + 4064)) << "dropped";
  sizes.begin_list();
  ASSERT_TRUE(takes(sizes, literal(std::string(100, 'n'), "", kKept)));
  EXPECT_EQ(most_times(sizes, "\xbe"), kMost / (kEach + 32)) << "if it's there, it has no more than 64";
  EXPECT_FALSE(takes(sizes, "\x3f\xe2\x1f"s)) << "4097";
}

TEST(HeaderSizes, RefuseWhatIsntHpack) {
  EXPECT_EQ(most_times("\x80"), 0u) << "index 0";
  EXPECT_EQ(most_times("\xff\x80\x80\x80\x80\x00"s), 0u) << "a number in more bytes than any needs";
  EXPECT_EQ(most_times("\0\x7f\xff\xff\xff\x7f"s), 0u) << "a text of 256 MB, before it comes";
}

TEST(HeaderSizes, AreTheSameWhereverBytesAreCut) {
  const std::string list = literal("name", "value", kKept) + literal(std::string(300, 'n'), std::string(200, 'v')) +
                           "\xbe" + "\x3f\xe1\x1f" + "\x0f\x2f\x03new"s;
  HeaderSizes whole, cut;
  ASSERT_TRUE(takes(whole, list));
  for (const char byte : list) ASSERT_TRUE(takes(cut, std::string(1, byte)));
  EXPECT_TRUE(cut.is_between_headers());
  ASSERT_TRUE(takes(cut, "\0\x02n"s));
  EXPECT_FALSE(cut.is_between_headers());
  ASSERT_TRUE(takes(cut, "n\0"s));
  std::size_t left = 0, left_cut = 0;
  ASSERT_TRUE(takes(whole, "\0\x02nn\0"s));
  while (takes(whole, "\xbe")) ++left;
  while (takes(cut, "\xbe")) ++left_cut;
  EXPECT_EQ(left, left_cut);
  EXPECT_GT(left, 10u);
}

}  // namespace
}  // namespace ccslice::server
