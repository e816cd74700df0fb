// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/service_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/datagrams.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using ::testing::MatchesRegex;

TEST(ServiceManager, IsToldByDatagrams) {
  for (const bool abstract : {false, true}) {
    const Datagrams manager(abstract);
    const ServiceManager service(manager.name());
    service.say_ready("serves on 127.0.0.1:1");
    EXPECT_EQ(manager.next(5s), "READY=1\nSTATUS=serves on 127.0.0.1:1") << manager.name();
    service.say_reloading();
    EXPECT_THAT(manager.next(5s), MatchesRegex("RELOADING=1\nMONOTONIC_USEC=[0-9]+"));
    service.say_stopping(25s);
    EXPECT_EQ(manager.next(5s), "STOPPING=1\nSTATUS=stopping: running calls may end\nEXTEND_TIMEOUT_USEC=25000000");
  }
}

TEST(ServiceManager, MayBeAbsent) {
  const std::string longer(200, 'x');
  for (const std::string& socket : {std::string(), std::string("/nowhere/notify"), std::string("vsock:2:1"),
                                    std::string("@nobody-listens-here"), "/" + longer, "@" + longer}) {
    EXPECT_NO_THROW(ServiceManager(socket).say_ready("")) << socket;
  }
}

}  // namespace
}  // namespace ccslice::server
