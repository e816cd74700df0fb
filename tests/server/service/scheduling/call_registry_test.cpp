// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/call_registry.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

ServiceErrorCode refusal(CallRegistry& registry, const std::string& client = {}) {
  try {
    const CallRegistry::Ticket ticket = registry.open_call({}, client);
  } catch (const ServiceError& error) {
    return error.code();
  }
  return ServiceErrorCode{};
}

TEST(CallRegistry, OpensNoMoreThanItHasMemoryFor) {
  CallRegistry registry(/*most=*/2);
  CallRegistry::Ticket first = registry.open_call();
  const CallRegistry::Ticket second = registry.open_call();
  EXPECT_EQ(refusal(registry), ServiceErrorCode::kServerBusy);
  first = {};
  EXPECT_EQ(refusal(registry), ServiceErrorCode{});
}

TEST(CallRegistry, LeavesAQuarterOfManyToOtherClients) {
  CallRegistry registry(/*most=*/8);
  std::vector<CallRegistry::Ticket> open;
  for (int i = 0; i < 6; ++i) open.push_back(registry.open_call({}, "one"));
  EXPECT_EQ(refusal(registry, "one"), ServiceErrorCode::kServerBusy);
  EXPECT_EQ(refusal(registry, "other"), ServiceErrorCode{});
  open.pop_back();
  EXPECT_EQ(refusal(registry, "one"), ServiceErrorCode{});
}

TEST(CallRegistry, CountsAnswersUntilTheirCallsAreClosed) {
  CallRegistry registry(/*most=*/16);
  CallRegistry::Ticket first = registry.open_call({}, "one"), second = registry.open_call({}, "one");
  EXPECT_TRUE(second.hold(1000)) << "small ones count with their calls";
  EXPECT_TRUE(first.hold(9 << 14));
  EXPECT_FALSE(second.hold(2 << 14)) << "12 are one client's";
  EXPECT_TRUE(second.hold(1 << 14));
  CallRegistry::Ticket other = registry.open_call({}, "other");
  EXPECT_FALSE(other.hold(4 << 14));
  first = {};
  EXPECT_TRUE(other.hold(4 << 14));
  EXPECT_EQ(registry.open(), 2u);
}

TEST(CallRegistry, RefusesEverythingOnceItDrainsAndWaitsForTheRest) {
  CallRegistry registry;
  CallRegistry::Ticket running = registry.open_call();
  registry.drain();
  EXPECT_EQ(refusal(registry), ServiceErrorCode::kServerDraining);
  EXPECT_FALSE(registry.wait_idle(std::chrono::steady_clock::now() + std::chrono::milliseconds(5)));
  running = {};
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

TEST(CallRegistry, CutsOffTheCallsThatAreOpen) {
  CallRegistry registry;
  int first_cuts = 0, second_cuts = 0;
  CallRegistry::Ticket first = registry.open_call([&] { ++first_cuts; });
  const CallRegistry::Ticket second = registry.open_call([&] { ++second_cuts; });
  const CallRegistry::Ticket third = registry.open_call();
  first = {};
  EXPECT_FALSE(registry.cutting_off());
  registry.cut_off_all();
  EXPECT_TRUE(registry.cutting_off());
  EXPECT_EQ(first_cuts, 0) << "it was closed";
  EXPECT_EQ(second_cuts, 1);
}

TEST(CallRegistry, HasOpenCallsLookAndLeavesThemOpen) {
  CallRegistry registry;
  int cuts = 0, checks = 0;
  const CallRegistry::Ticket first = registry.open_call([&] { ++cuts; }, "client", [&] { ++checks; });
  const CallRegistry::Ticket second = registry.open_call([&] { ++cuts; });
  registry.check_all();
  EXPECT_EQ(checks, 1);
  EXPECT_EQ(cuts, 0);
  EXPECT_FALSE(registry.cutting_off());
}

TEST(CallRegistry, ACallMayEndWhileItIsCutOff) {
  CallRegistry registry;
  CallRegistry::Ticket ticket;
  ticket = registry.open_call([&] { ticket = {}; });
  registry.cut_off_all();
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

}  // namespace
}  // namespace ccslice::server
