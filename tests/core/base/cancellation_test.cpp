// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/cancellation.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(CancellationToken, IsSharedByItsCopies) {
  const CancellationToken token = CancellationToken::make(), copy = token, other = CancellationToken::make();
  EXPECT_FALSE(copy.cancelled());
  copy.throw_if_cancelled();
  token.cancel();
  EXPECT_TRUE(copy.cancelled());
  EXPECT_FALSE(other.cancelled());
  try {
    copy.throw_if_cancelled();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(CancellationToken, OfItselfNeverCancels) {
  const CancellationToken token;
  EXPECT_FALSE(token.cancelled());
  token.throw_if_cancelled();
}

int polls = 0;

TEST(CancellationToken, GivesWayAtEveryPollAndBeforeItThrows) {
  const CancellationToken token = CancellationToken::make([]() noexcept { ++polls; });
  token.throw_if_cancelled();
  EXPECT_EQ(polls, 1);
  EXPECT_FALSE(token.cancelled());
  EXPECT_EQ(polls, 1) << "a look is no poll";
  token.cancel();
  EXPECT_THROW(token.throw_if_cancelled(), Error);
  EXPECT_EQ(polls, 2);
}

TEST(PeriodicPoll, LooksAtItsTokenOnceInAPeriod) {
  const CancellationToken token = CancellationToken::make();
  token.cancel();
  PeriodicPoll poll(token, 3);
  for (int round = 0; round < 2; ++round) {
    poll();
    poll();
    EXPECT_THROW(poll(), Error);
  }
}

}  // namespace
}  // namespace ccslice
