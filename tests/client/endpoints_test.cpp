// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/endpoints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

ClientOptions options_of(const std::vector<std::string>& addresses) {
  ClientOptions options;
  options.addresses = addresses;
  return options;
}

std::vector<std::string> addresses_of(const EndpointList& endpoints) {
  std::vector<std::string> addresses;
  for (const auto& endpoint : endpoints) addresses.push_back(endpoint->address);
  return addresses;
}

std::string id_number(int i) { return mesh_id_of(std::to_string(i)); }

TEST(Endpoints, AreInTheOrderGivenForCallsAboutNoMesh) {
  const std::vector<std::string> addresses = {"10.0.0.3:1", "10.0.0.1:1", "10.0.0.2:1"};
  EXPECT_EQ(addresses_of(Endpoints(options_of(addresses)).in_order("")), addresses);
}

TEST(Endpoints, AreInOneOrderForAMeshWhateverTheOrderGiven) {
  const Endpoints one(options_of({"10.0.0.3:1", "10.0.0.1:1", "10.0.0.2:1"}));
  const Endpoints other(options_of({"10.0.0.1:1", "10.0.0.2:1", "10.0.0.3:1"}));
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(addresses_of(one.in_order(id_number(i))), addresses_of(other.in_order(id_number(i))));
  }
}

TEST(Endpoints, ShareTheMeshesEvenly) {
  const Endpoints endpoints(options_of({"10.0.0.1:1", "10.0.0.2:1", "10.0.0.3:1"}));
  std::map<std::string, int> firsts, seconds;
  for (int i = 0; i < 3000; ++i) {
    const std::vector<std::string> order = addresses_of(endpoints.in_order(id_number(i)));
    ++firsts[order[0]];
    ++seconds[order[1]];
  }
  for (const auto& counts : {firsts, seconds}) {
    ASSERT_EQ(counts.size(), 3u);
    for (const auto& [address, count] : counts) EXPECT_NEAR(count, 1000, 120) << address;
  }
}

TEST(Endpoints, LeaveTheMeshesOfTheOthersWhereOneGoes) {
  const Endpoints all(options_of({"10.0.0.1:1", "10.0.0.2:1", "10.0.0.3:1"}));
  const Endpoints left(options_of({"10.0.0.1:1", "10.0.0.3:1"}));
  for (int i = 0; i < 100; ++i) {
    std::vector<std::string> order = addresses_of(all.in_order(id_number(i)));
    std::erase(order, "10.0.0.2:1");
    EXPECT_EQ(addresses_of(left.in_order(id_number(i))), order);
  }
}

// All clients of all versions agree, or each server would get all meshes.
TEST(Endpoints, KeepTheirOrderForEver) {
  const Endpoints endpoints(options_of({"10.0.0.1:50051", "10.0.0.2:50051", "slicer-3:50051"}));
  EXPECT_THAT(addresses_of(endpoints.in_order(mesh_id_of("abc"))),
              testing::ElementsAre("10.0.0.2:50051", "slicer-3:50051", "10.0.0.1:50051"));
}

TEST(Endpoints, RefuseAddressesThatAreNone) {
  EXPECT_EQ(error_of([] { Client client(options_of({"a:1", "a:1"})); }).reason(), local_reason::kAddressInvalid);
  EXPECT_EQ(error_of([] { Client client({.address = "nowhere"}); }).reason(), local_reason::kAddressInvalid);
}

}  // namespace
}  // namespace ccslice::client
