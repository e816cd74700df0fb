// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/connection_listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// Serves connections by keeping them until it is told to close them.
class Keeper {
 public:
  explicit Keeper(const ConnectionLimits& limits, const std::string& address = "127.0.0.1:0",
                  ConnectionListener::IsCrowded is_crowded = {})
      : listener_(address, limits) {
    const auto keep = [this](int descriptor) {
      const std::lock_guard lock(mutex_);
      kept_.emplace_back(descriptor);
    };
    listener_.start(keep, std::move(is_crowded));
  }
  ~Keeper() { listener_.stop(); }

  const std::string& address() const { return listener_.address(); }
  ConnectionTable& table() { return listener_.connections(); }
  std::size_t kept() {
    const std::lock_guard lock(mutex_);
    return kept_.size();
  }
  bool comes_to_keep(std::size_t connections) {
    for (int i = 0; i < 500 && kept() != connections; ++i) usleep(10'000);
    return kept() == connections;
  }
  void close_all() {
    const std::lock_guard lock(mutex_);
    kept_.clear();
  }
  /// Takes in what has come: the system keeps only so much.
  void read_all() {
    const std::lock_guard lock(mutex_);
    std::string bytes(1 << 20, '\0');
    for (const Descriptor& each : kept_) {
      while (read(each.get(), bytes.data(), bytes.size()) > 0) {
      }
    }
  }
  /// Over the connection that came last, as much as it takes in now. How much that was.
  std::size_t send(const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::max<ssize_t>(write(kept_.back().get(), bytes.data(), bytes.size()), 0));
  }

 private:
  std::mutex mutex_;
  std::vector<Descriptor> kept_;
  ConnectionListener listener_;
};

/// A connection from one of this machine's addresses, 127.0.0.x.
Descriptor call_from(const std::string& source, const std::string& address) {
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in from{}, to{};
  from.sin_family = to.sin_family = AF_INET;
  inet_pton(AF_INET, source.c_str(), &from.sin_addr);
  const std::size_t colon = address.rfind(':');
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  EXPECT_EQ(bind(socket.get(), reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
  EXPECT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  return socket;
}

/// Whether the other end closes, or has closed, this connection.
bool is_closed_soon(const Descriptor& socket, int limit_ms = 5000) {
  pollfd wait{.fd = socket.get(), .events = POLLIN, .revents = 0};
  char byte = 0;
  return poll(&wait, 1, limit_ms) == 1 && read(socket.get(), &byte, 1) <= 0;
}

void send_kib(const Descriptor& socket, std::size_t kib) {
  const std::string much(kib << 10, 'x');
  ASSERT_EQ(write(socket.get(), much.data(), much.size()), static_cast<ssize_t>(much.size()));
}

Peer own_address(const Descriptor& socket) {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size);
  return *peer_of(own);
}

ConnectionLimits limits(std::size_t connections, std::size_t per_address) {
  return {.connections = connections, .per_address = per_address, .idle = 0ms, .arriving = 0ms};
}

/// This process with few files, for a while.
class FewFiles {
 public:
  explicit FewFiles(std::size_t more) {
    getrlimit(RLIMIT_NOFILE, &before_);
    const Descriptor next(dup(0));
    const rlimit few{.rlim_cur = static_cast<rlim_t>(next.get()) + more, .rlim_max = before_.rlim_max};
    setrlimit(RLIMIT_NOFILE, &few);
  }
  ~FewFiles() { setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

TEST(ConnectionListener, TakesAFreePortAndSaysWhich) {
  Keeper keeper(limits(10, 10));
  EXPECT_TRUE(keeper.address().starts_with("127.0.0.1:"));
  EXPECT_NE(keeper.address(), "127.0.0.1:0");
  const Descriptor connection = call_from("127.0.0.1", keeper.address());
  EXPECT_TRUE(keeper.comes_to_keep(1));
}

TEST(ConnectionListener, ClosesConnectionsBeyondItsLimitAtOnceAndTakesNewOnesWhenOthersHaveLeft) {
  Keeper keeper(limits(2, 2));
  const Descriptor first = call_from("127.0.0.1", keeper.address()), second = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  EXPECT_TRUE(is_closed_soon(call_from("127.0.0.1", keeper.address())));
  EXPECT_TRUE(is_closed_soon(call_from("127.0.0.2", keeper.address())));
  keeper.close_all();
  usleep(50'000);
  const Descriptor third = call_from("127.0.0.1", keeper.address());
  EXPECT_TRUE(keeper.comes_to_keep(1));
}

TEST(ConnectionListener, ServesASecondAddressWhileOneHasAllThatOneMayHave) {
  Keeper keeper(limits(10, 2));
  const Descriptor first = call_from("127.0.0.1", keeper.address()), second = call_from("127.0.0.1", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  EXPECT_TRUE(is_closed_soon(call_from("127.0.0.1", keeper.address())));
  const Descriptor other = call_from("127.0.0.2", keeper.address());
  EXPECT_TRUE(keeper.comes_to_keep(3));
}

TEST(ConnectionListener, OutlivesTheEndOfFileDescriptors) {
  Keeper keeper(limits(1000, 1000));
  std::vector<Descriptor> callers;
  for (int i = 0; i < 40; ++i) callers.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(keeper.address().substr(10))));
  inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
  {
    const FewFiles few(8);
    for (const Descriptor& caller : callers) {
      ASSERT_EQ(connect(caller.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    }
    std::size_t refused = 0;
    for (const Descriptor& caller : callers) refused += is_closed_soon(caller, 200) ? 1 : 0;
    EXPECT_GE(refused, 30u);
    EXPECT_LE(keeper.kept(), 8u);
  }
  keeper.close_all();
  const Descriptor later = call_from("127.0.0.1", keeper.address());
  EXPECT_TRUE(keeper.comes_to_keep(1));
}

TEST(ConnectionListener, DropsConnectionsWithoutCallsWhenTheirTimeIsUpAndLeavesThoseWithOne) {
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

TEST(ConnectionListener, DropsSoonerWhatSendsMuchThatMakesNoCall) {
  ConnectionLimits some = limits(10, 10);
  some.arriving = 200ms;
  Keeper keeper(some);
  const Descriptor silent = call_from("127.0.0.1", keeper.address()), half = call_from("127.0.0.2", keeper.address());
  ASSERT_TRUE(keeper.comes_to_keep(2));
  send_kib(half, 64);
  EXPECT_TRUE(is_closed_soon(half));
  EXPECT_FALSE(is_closed_soon(silent, 1500));
}

TEST(ConnectionListener, DropsItAlsoWhileOthersAreRefusedAgainAndAgain) {
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

TEST(ConnectionListener, CountsTheTimeOfARequestFromWhenItBeginsToCome) {
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

TEST(ConnectionListener, DropsThoseOverWhichMostHasComeUntilTheOthersAreWithinTheBound) {
  ConnectionLimits some = limits(10, 10);
  some.arriving_bytes = 128 << 10;
  Keeper keeper(some);
  std::vector<Descriptor> callers;
  for (const std::size_t kib : {96, 32, 48}) {
    callers.push_back(call_from("127.0.0.1", keeper.address()));
    send_kib(callers.back(), kib);
  }
  EXPECT_TRUE(is_closed_soon(callers[0]));
  EXPECT_FALSE(is_closed_soon(callers[1], 500));
  EXPECT_FALSE(is_closed_soon(callers[2], 500));
}

TEST(ConnectionListener, DropsThemAlsoWhileCallsAreOpenOnThemButNotWhereAllMessagesComeInWhole) {
  ConnectionLimits some = limits(10, 10);
  some.arriving_bytes = 128 << 10;
  Keeper keeper(some);
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

TEST(ConnectionListener, GivesMessagesThatComeFastTheTimeToBeWhole) {
  ConnectionLimits some = limits(10, 10);
  some.arriving_bytes = 128 << 10;
  Keeper keeper(some);
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
TEST(ConnectionListener, GivesOneMessageMoreTimeToBeWholeThanSeveral) {
  ConnectionLimits some = limits(10, 10);
  some.arriving_bytes = 128 << 10;
  Keeper keeper(some);
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
TEST(ConnectionListener, TakesWhatAReaderOfLongAnswersSendsForNoRequest) {
  ConnectionLimits some = limits(10, 10);
  some.arriving_bytes = 24 << 10;
  Keeper keeper(some);
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

TEST(ConnectionListener, FindsThemAmongHundredsThatAreIdle) {
  ConnectionLimits some = limits(400, 400);
  some.arriving_bytes = 24 << 10;
  Keeper keeper(some);
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

TEST(ConnectionListener, CountsNoCancelledCallAsServed) {
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

TEST(ConnectionListener, DropsInNeedThoseOverWhichMostHasComeForNoCall) {
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

TEST(ConnectionListener, DropsInNeedWhatSendsFarMoreThanItsWholeMessages) {
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

TEST(ConnectionListener, DropsInNeedThoseOfTheAddressThatHasMostWithoutACall) {
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

TEST(ConnectionListener, ReplacesAUnixSocketThatNobodyListensOnAndNoOther) {
  const std::string path = "/tmp/ccslice-listener-" + std::to_string(getpid()), address = "unix:" + path;
  {
    const Descriptor dead(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), name.sun_path);
    ASSERT_EQ(bind(dead.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  }
  {
    Keeper keeper(limits(10, 1), address);
    EXPECT_EQ(keeper.address(), address);
    EXPECT_THROW(ListenSockets second(address), std::runtime_error);
    EXPECT_TRUE(std::filesystem::exists(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ConnectionListener, SaysWhyItCannotListenAndWhatToDo) {
  const ListenSockets first("127.0.0.1:0");
  try {
    const ListenSockets second(first.address());
    FAIL() << "both listen on " << second.address();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "can't listen on " + first.address() + ": Address already in use; choose another address with --listen");
  }
  EXPECT_THROW(ListenSockets("192.0.2.1:50051"), std::runtime_error);
  EXPECT_THROW(ListenSockets("unix:/no/such/folder/socket"), std::runtime_error);
  EXPECT_THROW(ListenSockets("unix:" + std::string(200, 'x')), std::runtime_error);
}

TEST(ConnectionLimits, ShrinkInProportionWhereDescriptorsAreFewer) {
  ServerOptions options;
  options.max_connections = 10'000;
  options.max_connections_per_address = 7'500;
  EXPECT_EQ(connection_limits(options, 20'000).connections, 10'000u);
  EXPECT_EQ(connection_limits(options, 1'000).connections, 1'000u);
  EXPECT_EQ(connection_limits(options, 1'000).per_address, 750u);
  EXPECT_EQ(connection_limits(options, 1).per_address, 1u);
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

/// `most` at once are more than memory has room for.
std::chrono::nanoseconds time_to_take(std::size_t connections, std::size_t most) {
  Keeper keeper(limits(100, 100), "127.0.0.1:0", [most](std::size_t just_taken) { return just_taken >= most; });
  const auto begin = std::chrono::steady_clock::now();
  std::vector<Descriptor> clients;
  while (clients.size() < connections) clients.push_back(call_from("127.0.0.1", keeper.address()));
  EXPECT_TRUE(keeper.comes_to_keep(connections));
  return std::chrono::steady_clock::now() - begin;
}

// Twenty a second at most: a rest of 50 ms after each, until those before no longer count.
TEST(ConnectionListener, TakesConnectionsOneByOneWhereMemoryRunsShort) {
  EXPECT_GE(time_to_take(8, 1), 7 * 50ms);
  EXPECT_GE(time_to_take(20, 17), 3 * 50ms);
  EXPECT_LT(time_to_take(80, 100), 2s);  // Never crowded: at once.
}

TEST(ConnectionListener, CountsConnectionsAsJustTakenForAWhile) {
  std::atomic<std::size_t> counted = 0;
  const Keeper keeper(limits(100, 100), "127.0.0.1:0", [&](std::size_t just_taken) {
    counted = just_taken;
    return false;
  });
  std::vector<Descriptor> clients;
  const auto connect = [&](std::size_t expected) {
    clients.push_back(call_from("127.0.0.1", keeper.address()));
    for (int i = 0; i < 500 && counted != expected; ++i) usleep(10'000);
    EXPECT_EQ(counted, expected);
  };
  for (std::size_t n = 1; n <= 3; ++n) connect(n);
  std::this_thread::sleep_for(300ms);
  connect(4);
  std::this_thread::sleep_for(600ms);  // More than two quarters of a second.
  connect(1);
}

// They take no memory, and whoever waits behind them shouldn't wait for them.
TEST(ConnectionListener, RefusesConnectionsAtOnceWhereMemoryRunsShort) {
  Keeper keeper(limits(100, 1), "127.0.0.1:0", [](std::size_t) { return true; });
  std::vector<Descriptor> clients;
  clients.push_back(call_from("127.0.0.1", keeper.address()));
  ASSERT_TRUE(keeper.comes_to_keep(1));
  const auto begin = std::chrono::steady_clock::now();
  while (clients.size() < 41) clients.push_back(call_from("127.0.0.1", keeper.address()));
  for (std::size_t n = 1; n < clients.size(); ++n) EXPECT_TRUE(is_closed_soon(clients[n]));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 40 * 50ms / 2);
  EXPECT_EQ(keeper.kept(), 1u);
}

}  // namespace
}  // namespace ccslice::server
