// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/connection_table.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/service/kept_connections.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

void send_kib(const Descriptor& socket, std::size_t kib) {
  const std::string much(kib << 10, 'x');
  ASSERT_EQ(write(socket.get(), much.data(), much.size()), static_cast<ssize_t>(much.size()));
}

ConnectionLimits arriving_limits(std::size_t connections, std::size_t kib) {
  ConnectionLimits result = limits(connections, connections);
  result.arriving_bytes = kib << 10;
  return result;
}

TEST(ConnectionTable, DropsConnectionsWithoutCallsWhenTheirTimeIsUpAndLeavesThoseWithOne) {
  ConnectionLimits some = limits(10, 10);
  some.idle = 200ms;
  Keeper keeper(some);
  const Descriptor silent = call_from("127.0.0.1", keeper.address()), busy = call_from("127.0.0.2", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(busy.get(), reinterpret_cast<sockaddr*>(&own), &size);
  const ConnectionTable::ConnectionId call = keeper.table().begin_call(*peer_of(own));
  ASSERT_NE(call, 0u);
  EXPECT_TRUE(is_closed_soon(silent));
  EXPECT_FALSE(is_closed_soon(busy, 1500));
  keeper.table().end_call(call, ConnectionTable::Clock::now(), /*served=*/true);
  EXPECT_TRUE(is_closed_soon(busy));
}

TEST(ConnectionTable, DropsSoonerWhatSendsMuchThatMakesNoCall) {
  ConnectionLimits some = limits(10, 10);
  some.arriving = 200ms;
  Keeper keeper(some);
  const Descriptor silent = call_from("127.0.0.1", keeper.address()), half = call_from("127.0.0.2", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  send_kib(half, 64);
  EXPECT_TRUE(is_closed_soon(half));
  EXPECT_FALSE(is_closed_soon(silent, 1500));
}

TEST(ConnectionTable, DropsItAlsoWhileOthersAreRefusedAgainAndAgain) {
  ConnectionLimits some = limits(1, 1);
  some.arriving = 200ms;
  Keeper keeper(some);
  const Descriptor half = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(1));
  send_kib(half, 64);
  bool is_closed = false;
  for (int i = 0; i < 50 && !is_closed; ++i) {
    const Descriptor refused = call_from("127.0.0.2", keeper.address());
    is_closed = is_closed_soon(half, 100);
  }
  EXPECT_TRUE(is_closed);
}

TEST(ConnectionTable, CountsTheTimeOfARequestFromWhenItBeginsToCome) {
  ConnectionLimits some = limits(10, 10);
  some.arriving = 1h;
  Keeper keeper(some);
  const Descriptor half = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(1));
  const ConnectionTable::Clock::time_point now = ConnectionTable::Clock::now();
  send_kib(half, 2);
  EXPECT_EQ(keeper.table().sweep(now + 2h).arriving, 0u) << "a few calls that were cancelled";
  send_kib(half, 64);
  EXPECT_EQ(keeper.table().sweep(now + 3h).arriving, 0u);
  EXPECT_EQ(keeper.table().sweep(now + 4h).arriving, 1u);
  EXPECT_TRUE(is_closed_soon(half));
}

TEST(ConnectionTable, DropsThoseOverWhichMostHasComeUntilTheOthersAreWithinTheBound) {
  Keeper keeper(arriving_limits(10, 128));
  std::vector<Descriptor> callers;
  for (const std::size_t kib : {96, 32, 48}) {
    callers.push_back(call_from("127.0.0.1", keeper.address()));
    send_kib(callers.back(), kib);
  }
  EXPECT_TRUE(is_closed_soon(callers[0]));
  EXPECT_FALSE(is_closed_soon(callers[1], 500));
  EXPECT_FALSE(is_closed_soon(callers[2], 500));
}

TEST(ConnectionTable, DropsThemAlsoWhileCallsAreOpenOnThemButNotWhereAllMessagesComeInWhole) {
  Keeper keeper(arriving_limits(10, 128));
  const Descriptor half = call_from("127.0.0.1", keeper.address()), whole = call_from("127.0.0.2", keeper.address()),
                   slow = call_from("127.0.0.3", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(3));
  std::vector<ConnectionTable::ConnectionId> calls;
  for (const Descriptor* const each : {&half, &whole, &slow}) {
    calls.push_back(keeper.table().begin_call(own_address(*each)));
    ASSERT_NE(calls.back(), 0u);
  }
  for (int i = 0; i < 10; ++i) {
    send_kib(whole, 64);
    usleep(50'000);
    keeper.read_all();
    keeper.table().note_message(calls[1], 64 << 10, ConnectionTable::Clock::now());
  }
  send_kib(slow, 96);
  EXPECT_FALSE(is_closed_soon(slow, 2000)) << "one request that comes slowly";
  send_kib(half, 192);
  EXPECT_TRUE(is_closed_soon(half));
  EXPECT_FALSE(is_closed_soon(slow, 500));
  EXPECT_FALSE(is_closed_soon(whole, 500));
}

TEST(ConnectionTable, GivesMessagesThatComeFastTheTimeToBeWhole) {
  Keeper keeper(arriving_limits(10, 128));
  const Descriptor fast = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(1));
  const ConnectionTable::ConnectionId call = keeper.table().begin_call(own_address(fast));
  for (const auto ahead : {1h, 0h}) {  // However long this test takes.
    keeper.read_all();
    keeper.table().note_message(call, 0, ConnectionTable::Clock::now() + ahead);
    send_kib(fast, 256);
    usleep(50'000);
    keeper.read_all();
    EXPECT_EQ(is_closed_soon(fast, ahead > 0h ? 1500 : 5000), ahead == 0h);
  }
}

/// A chunk of 1 MiB takes some seconds over a slow line; a request of 4 MiB and half of another isn't one message.
TEST(ConnectionTable, GivesOneMessageMoreTimeToBeWholeThanSeveral) {
  Keeper keeper(arriving_limits(10, 128));
  const Descriptor slow = call_from("127.0.0.1", keeper.address()), several = call_from("127.0.0.2", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  ASSERT_NE(keeper.table().begin_call(own_address(slow)), 0u);
  ASSERT_NE(keeper.table().begin_call(own_address(several)), 0u);
  for (int mib = 0; mib < 6; ++mib) {
    if (mib == 0) send_kib(slow, 1024);
    send_kib(several, 1024);
    keeper.read_all();
  }
  EXPECT_TRUE(is_closed_soon(several, 4000));
  EXPECT_FALSE(is_closed_soon(slow, 0));
}

/// HTTP/2 has whoever reads send a little: updates of windows, answers to pings.
TEST(ConnectionTable, TakesWhatAReaderOfLongAnswersSendsForNoRequest) {
  Keeper keeper(arriving_limits(10, 24));
  const Descriptor reader = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(1));
  ASSERT_NE(keeper.table().begin_call(own_address(reader)), 0u);
  std::string answer(1 << 20, 'x');
  std::size_t sent = 0, read = 0;
  for (std::size_t said_kib = 0; read < (32u << 20);) {
    sent += keeper.send(answer);
    while (read < sent) {
      const ssize_t more = recv(reader.get(), answer.data(), answer.size(), 0);
      ASSERT_GT(more, 0);
      read += static_cast<std::size_t>(more);
    }
    for (; said_kib < read / 200 / 1024; ++said_kib) send_kib(reader, 1);
    keeper.read_all();
  }
  EXPECT_FALSE(is_closed_soon(reader, 2500));
  for (int mib = 0; mib < 6; ++mib) {  // More than its answers allow for, into however many segments they went.
    (void)send(reader.get(), answer.data(), answer.size(), MSG_NOSIGNAL);  // It may be closed before all has gone.
    keeper.read_all();
  }
  EXPECT_TRUE(is_closed_soon(reader)) << "that is more";
}

TEST(ConnectionTable, FindsThemAmongHundredsThatAreIdle) {
  Keeper keeper(arriving_limits(400, 24));
  std::vector<Descriptor> idle;
  for (int i = 0; i < 300; ++i) idle.push_back(call_from("127.0.0.1", keeper.address()));
  ASSERT_TRUE(keeper.comes_to_keep(300));
  for (int i = 0; i < 4; ++i) {  // Whatever part of them is looked at.
    const Descriptor greedy = call_from("127.0.0.1", keeper.address());
    const std::string much(48 << 10, 'x');
    ASSERT_EQ(write(greedy.get(), much.data(), much.size()), static_cast<ssize_t>(much.size()));
    EXPECT_TRUE(is_closed_soon(greedy));
  }
  EXPECT_FALSE(is_closed_soon(idle.front(), 100));
}

TEST(ConnectionTable, CountsNoCancelledCallAsServed) {
  ConnectionLimits some = limits(10, 10);
  some.arriving = 500ms;
  Keeper keeper(some);
  const Descriptor half = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(1));
  send_kib(half, 64);
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(half.get(), reinterpret_cast<sockaddr*>(&own), &size);
  usleep(300'000);
  keeper.table().end_call(keeper.table().begin_call(*peer_of(own)), ConnectionTable::Clock::now(), /*served=*/false);
  EXPECT_TRUE(is_closed_soon(half));
}

TEST(ConnectionTable, DropsInNeedThoseOverWhichMostHasComeForNoCall) {
  Keeper keeper(limits(10, 10));
  std::vector<Descriptor> callers;
  for (const std::size_t kib : {0, 1, 3, 2}) {
    callers.push_back(call_from("127.0.0.1", keeper.address()));
    send_kib(callers.back(), kib);
  }
  const Descriptor works = call_from("127.0.0.1", keeper.address());
  send_kib(works, 4);
  ASSERT_TRUE(keeper.comes_to_keep(5));
  const auto call = keeper.table().begin_call(own_address(works));
  const auto drop = [&](std::size_t count) {
    return keeper.table().drop_unserved(count, ConnectionTable::Clock::now());
  };
  EXPECT_EQ(drop(1), 1u);
  EXPECT_TRUE(is_closed_soon(callers[2]));
  EXPECT_EQ(drop(10), 2u) << "not what does no more than greet, and not what makes a call";
  EXPECT_TRUE(is_closed_soon(callers[1]));
  EXPECT_TRUE(is_closed_soon(callers[3]));
  EXPECT_EQ(drop(10), 0u);
  keeper.table().end_call(call, ConnectionTable::Clock::now(), /*served=*/true);
  EXPECT_EQ(drop(10), 0u);
}

TEST(ConnectionTable, DropsInNeedWhatSendsFarMoreThanItsWholeMessages) {
  Keeper keeper(limits(10, 10));
  const Descriptor half = call_from("127.0.0.1", keeper.address()), whole = call_from("127.0.0.2", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  const auto of_half = keeper.table().begin_call(own_address(half)),
             of_whole = keeper.table().begin_call(own_address(whole));
  for (int i = 0; i < 150; ++i) {
    send_kib(half, 64);
    send_kib(whole, 64);
    keeper.read_all();
    keeper.table().note_message(of_half, 10, ConnectionTable::Clock::now());
    keeper.table().note_message(of_whole, 64 << 10, ConnectionTable::Clock::now());
  }
  EXPECT_EQ(keeper.table().drop_unserved(10, ConnectionTable::Clock::now()), 1u);
  EXPECT_TRUE(is_closed_soon(half));
  EXPECT_FALSE(is_closed_soon(whole, 100));
}

TEST(ConnectionTable, DropsInNeedThoseOfTheAddressThatHasMostWithoutACall) {
  Keeper keeper(limits(100, 100));
  std::vector<Descriptor> crowd, few;
  for (int i = 0; i < 40; ++i) crowd.push_back(call_from("127.0.0.1", keeper.address()));
  for (int i = 0; i < 10; ++i) few.push_back(call_from("127.0.0.2", keeper.address()));
  ASSERT_TRUE(keeper.comes_to_keep(50));
  const ConnectionTable::Clock::time_point now = ConnectionTable::Clock::now();
  const auto drop = [&](std::size_t count, ConnectionTable::Clock::time_point when) {
    return keeper.table().drop_of_most_crowded(count, when);
  };
  const auto open_call = keeper.table().begin_call(own_address(crowd[0]));
  const auto served_call = keeper.table().begin_call(own_address(crowd[1]));
  const auto watch = keeper.table().begin_call(own_address(crowd[2]), ConnectionTable::CallKind::kBesides);
  keeper.table().end_call(served_call, now + 1s, /*served=*/true);
  EXPECT_EQ(drop(100, now), 0u) << "all have just come";
  EXPECT_EQ(drop(2, now + 1h), 2u);
  EXPECT_TRUE(is_closed_soon(crowd[2])) << "who watches the health can call again";
  EXPECT_TRUE(is_closed_soon(crowd[3]));
  EXPECT_EQ(drop(100, now + 1h), 3u) << "half of the 5 beyond 32";
  EXPECT_EQ(drop(100, now + 1h), 1u);
  EXPECT_EQ(drop(100, now + 1h), 1u);
  EXPECT_EQ(drop(100, now + 1h), 0u);
  EXPECT_FALSE(is_closed_soon(crowd[0], 100)) << "it has an open call";
  EXPECT_FALSE(is_closed_soon(crowd[1], 100)) << "those come first on which none was served for longest";
  keeper.table().end_call(open_call, now, /*served=*/true);
  keeper.table().end_call(watch, now, /*served=*/true, ConnectionTable::CallKind::kBesides);
}
TEST(Peer, IsReadAsGrpcWritesIt) {
  sockaddr_storage storage{};
  auto& four = reinterpret_cast<sockaddr_in&>(storage);
  four.sin_family = AF_INET;
  four.sin_port = htons(50'000);
  inet_pton(AF_INET, "192.0.2.1", &four.sin_addr);
  EXPECT_EQ(parse_peer("ipv4:192.0.2.1:50000"), peer_of(storage));
  auto& six = reinterpret_cast<sockaddr_in6&>(storage);
  six = {};
  six.sin6_family = AF_INET6;
  six.sin6_port = htons(50'000);
  inet_pton(AF_INET6, "2001:db8::1", &six.sin6_addr);
  EXPECT_EQ(parse_peer("ipv6:[2001:db8::1]:50000"), peer_of(storage));
  EXPECT_EQ(parse_peer("ipv6:%5B2001:db8::1%5D:50000"), peer_of(storage));
  EXPECT_EQ(parse_peer("ipv6:%5B2001:db8::1%25eth0%5D:50000"), peer_of(storage));
  for (const char* const other :
       {"", ":", "unix:", "unix:/tmp/a:1", "ipv4:1.2.3:4", "ipv4:1.2.3.4:65536", "ipv4:1.2.3.4"}) {
    EXPECT_EQ(parse_peer(other), std::nullopt) << other;
  }
}

TEST(Peer, CountsAMappedAddressAsIpv4AndASiteOfIpv6AsOne) {
  sockaddr_storage storage{};
  auto& six = reinterpret_cast<sockaddr_in6&>(storage);
  six.sin6_family = AF_INET6;
  six.sin6_port = htons(1);
  inet_pton(AF_INET6, "::ffff:192.0.2.1", &six.sin6_addr);
  EXPECT_EQ(peer_of(storage), parse_peer("ipv4:192.0.2.1:1"));
  const auto site = [](const char* peer) { return parse_peer(peer)->site(); };
  EXPECT_EQ(site("ipv6:[2001:db8::1]:1"), site("ipv6:[2001:db8::2]:2"));
  EXPECT_NE(site("ipv6:[2001:db8::1]:1"), site("ipv6:[2001:db8:0:1::1]:1"));
  EXPECT_EQ(site("ipv4:192.0.2.1:1"), site("ipv4:192.0.2.1:2"));
  EXPECT_NE(site("ipv4:192.0.2.1:1"), site("ipv4:192.0.2.2:1"));
}

}  // namespace
}  // namespace ccslice::server
