// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/call_registry.h"

#include <gtest/gtest.h>

#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

ServiceErrorCode refusal(CallRegistry& registry) {
  try {
    const CallRegistry::Ticket ticket = registry.admit();
  } catch (const ServiceError& error) {
    return error.code();
  }
  return ServiceErrorCode{};
}

TEST(CallRegistry, AdmitsNoMoreThanItsMaximumAtATime) {
  CallRegistry registry(2);
  CallRegistry::Ticket first = registry.admit();
  const CallRegistry::Ticket second = registry.admit();
  EXPECT_EQ(refusal(registry), ServiceErrorCode::kServerBusy);
  first = {};
  EXPECT_EQ(refusal(registry), ServiceErrorCode{});
  EXPECT_EQ(registry.running(), 1u);
}

TEST(CallRegistry, RefusesEverythingOnceItDrainsAndWaitsForTheRest) {
  CallRegistry registry(2);
  CallRegistry::Ticket running = registry.admit();
  registry.drain();
  EXPECT_EQ(refusal(registry), ServiceErrorCode::kServerDraining);
  EXPECT_FALSE(registry.wait_idle(std::chrono::steady_clock::now() + std::chrono::milliseconds(5)));
  running = {};
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

TEST(CallRegistry, ACallWithItsStatusMakesRoomButADrainStillWaitsForIt) {
  CallRegistry registry(1);
  CallRegistry::Ticket ending = registry.admit();
  ending.end_run();
  ending.end_run();
  EXPECT_EQ(registry.running(), 0u);
  EXPECT_EQ(registry.open(), 1u);
  EXPECT_EQ(refusal(registry), ServiceErrorCode{}) << "there is room";
  EXPECT_FALSE(registry.wait_idle(std::chrono::steady_clock::now()));
  ending = {};
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

TEST(CallRegistry, CutsOffTheCallsThatAreOpen) {
  CallRegistry registry(3);
  int first_cuts = 0, second_cuts = 0;
  CallRegistry::Ticket first = registry.admit([&] { ++first_cuts; });
  const CallRegistry::Ticket second = registry.admit([&] { ++second_cuts; });
  const CallRegistry::Ticket third = registry.admit();
  first = {};
  EXPECT_FALSE(registry.cutting_off());
  registry.cut_off_all();
  EXPECT_TRUE(registry.cutting_off());
  EXPECT_EQ(first_cuts, 0) << "it was closed";
  EXPECT_EQ(second_cuts, 1);
}

TEST(CallRegistry, ACallMayEndWhileItIsCutOff) {
  CallRegistry registry(1);
  CallRegistry::Ticket ticket;
  ticket = registry.admit([&] { ticket = {}; });
  registry.cut_off_all();
  EXPECT_TRUE(registry.wait_idle(std::chrono::steady_clock::now()));
}

}  // namespace
}  // namespace ccslice::server
