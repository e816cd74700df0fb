// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/call_registry.h"

#include <gtest/gtest.h>

#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

ServiceErrorCode refusal(CallRegistry& registry) {
  try {
    const CallRegistry::Ticket ticket = registry.open_call();
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

TEST(CallRegistry, ACallMayEndWhileItIsCutOff) {
  CallRegistry registry;
  CallRegistry::Ticket ticket;
  ticket = registry.open_call([&] { ticket = {}; });
  registry.cut_off_all();
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

}  // namespace
}  // namespace ccslice::server
