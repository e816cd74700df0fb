// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_share.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "client/cli/base/message_json.h"
#include "core/job/slice_job.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

/// What a function says is wrong with the command line.
template <typename Function>
std::string usage_error(Function&& function) {
  try {
    function();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

std::vector<LayerRange> shares_of(std::uint32_t count, const LayerRange& job) {
  std::vector<LayerRange> shares;
  for (std::uint32_t number = 1; number <= count; ++number) shares.push_back(layers_of_share({number, count}, job));
  return shares;
}

/// Whether the shares are the job, cut at multiples of `block`.
void expect_cut(const std::vector<LayerRange>& shares, const LayerRange& job, std::uint32_t block) {
  ASSERT_EQ(shares.front().first, job.first);
  ASSERT_EQ(shares.back().last, job.last);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    ASSERT_LE(shares[i].first, shares[i].last);
    if (i == 0) continue;
    ASSERT_EQ(shares[i].first, shares[i - 1].last + 1);
    ASSERT_EQ(shares[i].first % block, 0u);
  }
}

TEST(JobShare, LongJobsAreCutAtMultiplesOf64AndShortOnesOf16) {
  expect_cut(shares_of(8, {0, 8 * 4 * 64 - 1}), {0, 8 * 4 * 64 - 1}, 64);
  const std::vector<LayerRange> some = shares_of(2, {100, 899});
  expect_cut(some, {100, 899}, 64);
  EXPECT_EQ(some[1].first, 64u * (1 + 14 / 2)) << "layers 64 to 959 are 14 blocks";
  const std::vector<LayerRange> few = shares_of(3, {5, 50});
  expect_cut(few, {5, 50}, 16);
  EXPECT_EQ(few[0].last, 15u);
  EXPECT_EQ(few[1].last, 31u);
  EXPECT_EQ(shares_of(1, {7, 7}).front().last, 7u);
}

TEST(JobShare, RandomJobsAreCutWithoutGapsBetweenSlabs) {
  const auto seed = static_cast<unsigned>(testing::UnitTest::GetInstance()->random_seed());
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t first = below(5000);
    const LayerRange job = {first, first + below(i % 2 ? 500 : 20'000)};
    const std::uint32_t blocks = job.last / 16 - job.first / 16 + 1, count = 1 + below(blocks);
    const std::vector<LayerRange> shares = shares_of(count, job);
    expect_cut(shares, job, kSlabLayers);
    std::uint32_t longest = 0, shortest = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t s = 0; s < shares.size(); ++s) {
      EXPECT_EQ(share_of_layer(shares[s].first, count, job), s + 1);
      EXPECT_EQ(share_of_layer(shares[s].last, count, job), s + 1);
      if (s == 0 || s + 1 == shares.size()) continue;  // The job's ends cut these short.
      longest = std::max(longest, shares[s].last - shares[s].first + 1);
      shortest = std::min(shortest, shares[s].last - shares[s].first + 1);
    }
    if (shares.size() > 2) {
      EXPECT_LE(longest - shortest, 64u);
    }
  }
}

TEST(JobShare, TheLastLayersThatNumbersCanCountAreCutToo) {
  const LayerRange job = {0, std::numeric_limits<std::uint32_t>::max() - 1};
  const std::vector<LayerRange> shares = {layers_of_share({1, 1 << 20}, job), layers_of_share({1 << 20, 1 << 20}, job)};
  EXPECT_EQ(shares[0].first, 0u);
  EXPECT_EQ(shares[1].last, job.last);
  EXPECT_GT(shares[1].first, shares[0].last);
}

TEST(JobShare, MoreSharesThanBlocksAreRefused) {
  EXPECT_EQ(
      usage_error([] {
        layers_of_share({1, 4}, {0, 47});
      }),
      "--share 1/4: layers 0 to 47 make no more than 3 shares, since they are cut at multiples of 16; take fewer");
  EXPECT_EQ(usage_error([] { layers_of_share({2, 2}, {15, 16}); }), "no error");
  EXPECT_THAT(usage_error([] { layers_of_share({1, 4'000'000'000}, {0, 999'999}); }), HasSubstr("62500 shares"));
}

TEST(JobShare, WhatIsNoShareIsRefusedByName) {
  const auto refusal = [](const std::string& text) { return usage_error([&] { parse_share("--share", text); }); };
  EXPECT_EQ(refusal("2/8"), "no error");
  EXPECT_EQ(parse_share("--share", "2/8").number, 2u);
  EXPECT_EQ(parse_share("--share", "2/8").count, 8u);
  for (const char* text : {"", "2", "/", "2/", "/8", "a/b", "1/8/2", "-1/8", "1/-8", "1.5/8", " 1/8", "1/8 ", "1 of 8",
                           "0/0", "1/0", "1/4294967296"}) {
    EXPECT_EQ(refusal(text), "--share takes I/N, share I of N, as in 2/8, not '" + std::string(text) + "'");
  }
  EXPECT_EQ(refusal("0/8"), "--share '0/8': the shares are numbered from 1 to 8");
  EXPECT_EQ(refusal("9/8"), "--share '9/8': the shares are numbered from 1 to 8");
}

TEST(JobShare, RecordsAreReadAsTheyWereWritten) {
  const ShareRecord record = {{2, 3}, {64, 100}, "job", {5, 200}, "digest"};
  const std::string json = json_of(document_of(record));
  v1::JobPart document;
  ASSERT_TRUE(read_json(json, document));
  const auto read = share_record(document);
  ASSERT_TRUE(read);
  EXPECT_EQ(json_of(document_of(*read)), json);
  EXPECT_EQ(json,
            R"({"number":2,"count":3,"first_layer":64,"layers":37,"job":{"id":"job","first_layer":5,"layers":196},)"
            R"("contact_sheet_sha256":"digest"})");
  EXPECT_EQ(describe(record), "share 2/3, layers 64 to 100 of 5 to 200");
}

TEST(JobShare, RecordsThatCantBeRightAreNone) {
  const auto read = [](const std::string& share, const std::string& layers, const std::string& job) {
    v1::JobPart document;
    EXPECT_TRUE(read_json("{" + share + "," + layers + R"(,"job":{"id":"j",)" + job + "}}", document));
    return share_record(document);
  };
  const std::string share = R"("number":2,"count":3)", layers = R"("first_layer":64,"layers":37)",
                    job = R"("first_layer":5,"layers":196)";
  EXPECT_TRUE(read(share, layers, job));
  EXPECT_FALSE(read(R"("number":0,"count":3)", layers, job));
  EXPECT_FALSE(read(R"("number":4,"count":3)", layers, job));
  EXPECT_FALSE(read(R"("number":4,"count":4000000000)", layers, job)) << "more shares than blocks";
  EXPECT_FALSE(read(share, R"("first_layer":64,"layers":0)", job));
  EXPECT_FALSE(read(share, R"("first_layer":64,"layers":1000)", job)) << "beyond the job";
  EXPECT_FALSE(read(share, layers, R"("first_layer":65,"layers":196)"));
  EXPECT_FALSE(read(share, layers, R"("first_layer":4294967295,"layers":4294967295)"));
  EXPECT_FALSE(share_record({}));
}

}  // namespace
}  // namespace ccslice::cli
