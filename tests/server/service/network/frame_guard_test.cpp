// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/frame_guard.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "tests/server/service/http2_bytes.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using Fault = FrameGuard::Fault;

const std::string kList = request_list("/service/Method");

std::string call(std::uint32_t stream, const std::string& list = kList) {
  return frame(kHeaders, kEndHeaders, stream, list);
}

/// A connection's bytes, at times of the test's choice.
class Client {
 public:
  explicit Client(std::size_t calls = 0, const std::string& greeting = kGreeting) : guard_(calls) { send(greeting); }

  bool send(const std::string& bytes) { return guard_.take(bytes_of(bytes), now_); }
  /// How many calls it may begin until it is to end, at most 1,000.
  std::size_t begin_calls() {
    std::size_t count = 0;
    for (; count < 1000 && send(call(stream_)); stream_ += 2) ++count;
    return count;
  }
  void pass(std::chrono::milliseconds time) { now_ += time; }
  FrameGuard& guard() { return guard_; }

 private:
  FrameGuard guard_;
  FrameGuard::Clock::time_point now_;
  std::uint32_t stream_ = 1;
};

TEST(FrameGuard, PassesCallsWithTheirDataInAnyPieces) {
  const std::string all =
      kGreeting + frame(kSettings, kAck, 0, "") + call(1) + frame(kData, 0, 1, std::string(16384, 'x')) +
      frame(kHeaders, 0, 3, kList.substr(0, 40)) + frame(kContinuation, kEndHeaders, 3, kList.substr(40)) +
      frame(kHeaders, kEndHeaders | 0x20, 5, "prior" + kList) + frame(6, 0, 0, "8 bytes.") + reset(3) + call(7);
  for (const std::size_t size : {1u, 2u, 7u, 100u, 100'000u}) {
    Client client(2, "");
    for (std::size_t at = 0; at < all.size(); at += size) ASSERT_TRUE(client.send(all.substr(at, size))) << at;
    EXPECT_FALSE(client.send(call(9))) << "the fifth";
    EXPECT_EQ(client.guard().fault(), Fault::kCalls);
  }
}

TEST(FrameGuard, EndsConnectionsWithListsThatBecomeLarge) {
  Client client;
  ASSERT_TRUE(client.send(call(1, kList + literal(std::string(3900, 'x'), "", kKept))));
  EXPECT_TRUE(client.send(call(3, kList + std::string(3, '\xbe'))));
  EXPECT_FALSE(client.send(call(5, kList + std::string(4, '\xbe'))));
  EXPECT_EQ(client.guard().fault(), Fault::kHeaders);
  EXPECT_FALSE(client.send(frame(6, 0, 0, "8 bytes."))) << "from then on";
}

TEST(FrameGuard, EndsConnectionsWithListsThatGoOnOverFramesWithoutEnd) {
  Client client;
  ASSERT_TRUE(client.send(frame(kHeaders, 0, 1, kList)));
  int frames = 0;
  while (frames < 1000 && client.send(frame(kContinuation, 0, 1, "\x82"))) ++frames;
  EXPECT_LT(frames, 64);
  EXPECT_EQ(client.guard().fault(), Fault::kHeaders);
}

TEST(FrameGuard, EndsConnectionsWithATextThatIsTooLongBeforeItComes) {
  Client client;
  EXPECT_FALSE(client.send(frame(kHeaders, 0, 1, std::string("\0\x01x\x7f\x81\xff\xff\x7f", 8))));
}

TEST(FrameGuard, EndsConnectionsWhoseListsEndWithinAHeader) {
  const std::string part = kList + std::string("\0\x05na", 4);
  EXPECT_FALSE(Client().send(call(1, part)));
  Client client;
  EXPECT_TRUE(client.send(frame(kHeaders, 0, 1, part)));
  EXPECT_FALSE(client.send(frame(kContinuation, kEndHeaders, 1, "")));
}

TEST(FrameGuard, EndsConnectionsWithPaddingAndFramesThatAreTooShort) {
  EXPECT_FALSE(Client().send(frame(kHeaders, kEndHeaders | 0x8, 1, std::string(1, '\0') + kList)));
  EXPECT_FALSE(Client().send(frame(kHeaders, kEndHeaders | 0x20, 1, "prio")));
}

TEST(FrameGuard, EndsConnectionsThatBeginCallsFasterThanTheyEnd) {
  Client client(10);
  EXPECT_EQ(client.begin_calls(), 20u);
  EXPECT_EQ(client.guard().fault(), Fault::kCalls);
}

TEST(FrameGuard, LetsCallsBeginAsOthersEnd) {
  Client client(10);
  for (int i = 0; i < 500; ++i) client.guard().note_end();  // Of those that were forgotten: no reason for more.
  EXPECT_EQ(client.begin_calls(), 20u);

  Client steady(1);
  for (std::uint32_t stream = 1; stream < 2000; stream += 2) {
    ASSERT_TRUE(steady.send(call(stream) + reset(stream)));
    steady.guard().note_end();
  }
}

TEST(FrameGuard, CountsTrailersAsNoCall) {
  Client client(1);
  EXPECT_TRUE(client.send(call(1) + call(3)));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(client.send(call(1)));
}

TEST(FrameGuard, ForgetsCallsThatNobodyHeardOfOnceSettingsAreAcknowledged) {
  const std::string acknowledgement = frame(kSettings, kAck, 0, "");
  Client silent(10), client(10);
  ASSERT_TRUE(client.send(acknowledgement));
  for (Client* const each : {&silent, &client}) {
    for (std::uint32_t stream = 1; stream < 20; stream += 2) ASSERT_TRUE(each->send(call(stream)));
    each->pass(700ms);
  }
  std::size_t more = 0, more_silent = 0;
  for (std::uint32_t stream = 21; client.send(call(stream)); stream += 2) ++more;
  for (std::uint32_t stream = 21; silent.send(call(stream)); stream += 2) ++more_silent;
  EXPECT_EQ(more, 17u);
  EXPECT_EQ(more_silent, 10u);
}

TEST(FrameGuard, ForgetsNoMoreThanHaveBegun) {
  Client client(10);
  ASSERT_TRUE(client.send(frame(kSettings, kAck, 0, "")));
  client.pass(1h);
  EXPECT_EQ(client.begin_calls(), 20u);
}

}  // namespace
}  // namespace ccslice::server
