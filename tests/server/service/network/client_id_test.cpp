// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/client_id.h"

#include <gtest/gtest.h>

namespace ccslice::server {
namespace {

TEST(ClientId, IsThePeersAddressWithoutItsPort) {
  EXPECT_EQ(client_of("ipv4:192.0.2.7:50123"), client_of("ipv4:192.0.2.7:50124"));
  EXPECT_NE(client_of("ipv4:192.0.2.7:50123"), client_of("ipv4:192.0.2.8:50123"));
  EXPECT_EQ(client_of("ipv6:%5B2001:db8::1%5D:50123"), client_of("ipv6:%5B2001:db8::1%5D:1"));
  EXPECT_NE(client_of("ipv6:%5B2001:db8::1%5D:50123"), client_of("ipv6:%5B2001:db8::2%5D:50123"));
}

TEST(ClientId, IsTheSameForAllOnUnixSockets) {
  EXPECT_EQ(client_of("unix:"), client_of("unix:/run/ccslice.socket"));
  EXPECT_EQ(client_of("unix:"), client_of("unix-abstract:ccslice"));
}

}  // namespace
}  // namespace ccslice::server
