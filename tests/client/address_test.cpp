// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;

std::string refusal_of(const std::vector<std::string>& texts) {
  const ClientError error = error_of([&] { parse_addresses(texts); });
  EXPECT_EQ(error.reason(), local_reason::kAddressInvalid);
  return error.what();
}

TEST(Address, IsAHostAndAPort) {
  const Address address = parse_address("slicer.example:50051");
  EXPECT_EQ(address.target, "slicer.example:50051");
  EXPECT_EQ(address.host, "slicer.example");
  EXPECT_EQ(address.port, "50051");
  EXPECT_FALSE(address.tls);
  EXPECT_EQ(parse_address("[::1]:7").host, "[::1]");
}

TEST(Address, MayAskForTls) {
  EXPECT_EQ(parse_address("https://slicer.example:8443").target, "slicer.example:8443");
  EXPECT_EQ(parse_address("https://slicer.example").target, "slicer.example:443");
  EXPECT_TRUE(parse_address("https://slicer.example").tls);
}

TEST(Address, MayBelongToGrpc) {
  for (const char* text : {"unix:/run/ccsliced.sock", "unix:/run/99999:99999", "dns:///slicer:50051", "dns:slicer",
                           "ipv4:127.0.0.1:50051,127.0.0.2:50051", "ipv6:[::1]:50051", "dns:///2001:db8::0"}) {
    EXPECT_EQ(parse_address(text).target, text);
    EXPECT_FALSE(is_name(parse_address(text)));
  }
  EXPECT_THAT(refusal_of({"dns:///slicer:65536"}), HasSubstr("there is no port 65536, as in 'dns:///slicer:65536'"));
  EXPECT_THAT(refusal_of({"ipv4:127.0.0.1:50051,127.0.0.2:0"}), HasSubstr("there is no port 0"));
  EXPECT_THAT(refusal_of({"ipv6:[::1]:70000"}), HasSubstr("there is no port 70000"));
  EXPECT_THAT(refusal_of({"unix:"}), HasSubstr("unix: takes the path of a socket"));
}

TEST(Address, IsANameOnlyWhereItMayStandForSeveralServers) {
  EXPECT_TRUE(is_name(parse_address("slicer:50051")));
  EXPECT_FALSE(is_name(parse_address("localhost:50051")));
  EXPECT_FALSE(is_name(parse_address("10.0.0.1:50051")));
  EXPECT_FALSE(is_name(parse_address("[fe80::1]:50051")));
}

TEST(Address, IsRefusedWithWhatWouldBeRight) {
  for (const char* text : {"", "host", ":50051", "host:", "host:0", "host:65536", "host:http", "host:1 ", "ho st:1",
                           "http://host:1", "https://", "https://host:1/", "fe80::1:50051", "user@host:1", "[]:1"}) {
    EXPECT_THAT(refusal_of({text}), HasSubstr("HOST:PORT")) << text;
  }
}

TEST(Address, OfThisMachineNeedsNoProxy) {
  for (const char* target :
       {"localhost:50051", "LOCALHOST:1", "localhost.:1", "127.0.0.1:50051", "127.9.9.9:1", "[::1]:7",
        "[::ffff:127.0.0.1]:7", "unix:/run/s.sock", "unix-abstract:s", "dns:///localhost:1", "dns:localhost:1",
        "dns://8.8.8.8/localhost:1", "dns:localhost", "ipv4:127.0.0.1:50051,127.0.0.2:50051", "ipv6:[::1]:50051"}) {
    EXPECT_TRUE(is_loopback(target)) << target;
  }
  for (const char* target : {"slicer:50051", "127.example:1", "localhost.example:1", "notlocalhost:1", "a.localhost:1",
                             "10.0.0.1:1", "128.0.0.1:1", "[fe80::1]:1", "[::]:1", "ipv4:127.0.0.1:1,10.0.0.1:1",
                             "dns:///slicer:1", "xds:localhost", "dns://localhost/slicer:1", ""}) {
    EXPECT_FALSE(is_loopback(target)) << target;
  }
}

TEST(Address, NamesTheProxyOnTheWay) {
  for (const char* name : {"grpc_proxy", "https_proxy", "http_proxy", "no_grpc_proxy", "no_proxy"}) unsetenv(name);
  EXPECT_EQ(proxy_variable("slicer:50051"), "");
  setenv("http_proxy", "http://proxy:3128", 1);
  EXPECT_EQ(proxy_variable("slicer:50051"), "http_proxy");
  EXPECT_EQ(proxy_variable("dns:///slicer:50051"), "http_proxy");
  EXPECT_EQ(proxy_variable("localhost:50051"), "");
  setenv("no_proxy", "other,.example", 1);
  EXPECT_EQ(proxy_variable("slicer:50051"), "http_proxy");
  EXPECT_EQ(proxy_variable("slicer.EXAMPLE:50051"), "");
  setenv("no_grpc_proxy", "slicer", 1);
  EXPECT_EQ(proxy_variable("slicer:50051"), "");
  EXPECT_EQ(proxy_variable("slicer.example:50051"), "http_proxy");
  setenv("grpc_proxy", "", 1);
  EXPECT_EQ(proxy_variable("slicer.example:50051"), "") << "an empty one means none";
  for (const char* name : {"grpc_proxy", "http_proxy", "no_grpc_proxy", "no_proxy"}) unsetenv(name);
}

TEST(Address, IsLookedUp) {
  EXPECT_THAT(look_up("localhost", "50051"), testing::ElementsAre("localhost:50051"))
      << "one server, whatever leads there";
  EXPECT_THAT(look_up("127.0.0.1", "50051"), testing::ElementsAre("127.0.0.1:50051"));
  EXPECT_THAT(look_up("no-such-name.invalid", "50051"), testing::IsEmpty());
}

TEST(Addresses, AreOneOrMoreAndDiffer) {
  EXPECT_EQ(parse_addresses({"a:1", "b:1", "unix:x"}).size(), 3u);
  EXPECT_THAT(refusal_of({}), HasSubstr("no address"));
  EXPECT_THAT(refusal_of({"a:1", "", "b:1"}), HasSubstr("empty"));
  EXPECT_THAT(refusal_of({"a:1", "b:1", "a:1"}), HasSubstr("'a:1' is in the list twice"));
  EXPECT_THAT(refusal_of({"a:1", "https://a:1"}), HasSubstr("twice"));
  EXPECT_THAT(refusal_of({"a:1", "b:99999"}), HasSubstr("'b:99999'"));
}

}  // namespace
}  // namespace ccslice::client
