// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/connection_listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/service/kept_connections.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

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

TEST(ConnectionListener, TakesOneOfEachAddressInTurnWhereMemoryRunsShort) {
  Keeper keeper(limits(100, 100), "127.0.0.1:0", [](std::size_t) { return true; });
  std::vector<Descriptor> many;
  while (many.size() < 60) many.push_back(call_from("127.0.0.2", keeper.address()));
  ASSERT_LT(keeper.kept(), 40u);
  const auto begin = std::chrono::steady_clock::now();
  const Descriptor one = call_from("127.0.0.1", keeper.address());
  const Peer peer = own_address(one);
  const auto is_kept = [&] { return keeper.keeps(peer); };
  while (!is_kept() && std::chrono::steady_clock::now() - begin < 10s) usleep(1000);
  EXPECT_TRUE(is_kept());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s) << "60 turns take three";
  EXPECT_LT(keeper.kept(), 60u);
}

TEST(ConnectionListener, LosesNoTurnToConnectionsThatHaveLeft) {
  Keeper keeper(limits(100, 100), "127.0.0.1:0", [](std::size_t) { return true; });
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 60; ++i) call_from("127.0.0.1", keeper.address());
  const Descriptor last = call_from("127.0.0.1", keeper.address());
  const Peer peer = own_address(last);
  while (!keeper.keeps(peer) && std::chrono::steady_clock::now() - begin < 10s) usleep(1000);
  EXPECT_TRUE(keeper.keeps(peer));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s) << "60 turns take three";
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
