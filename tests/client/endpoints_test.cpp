// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/endpoints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

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

/// A name, and what it stands for at the moment. Outlives clients, as resolvers have to.
class Name {
 public:
  void stand_for(const std::vector<std::string>& addresses) {
    const std::lock_guard lock(mutex_);
    addresses_ = addresses;
  }
  int times_asked() const { return asked_; }
  static ClientOptions options(const std::shared_ptr<Name>& name) {
    return {.address = "slicers.example:50051", .resolver = [name](const std::string& host, const std::string& port) {
              EXPECT_EQ(host + ":" + port, "slicers.example:50051");
              ++name->asked_;
              const std::lock_guard lock(name->mutex_);
              return name->addresses_;
            }};
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> addresses_;
  std::atomic<int> asked_ = 0;
};

template <typename Condition>
bool comes_true(const Condition& condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return condition();
}

TEST(Endpoints, AreAllThatANameStandsFor) {
  const auto name = std::make_shared<Name>();
  name->stand_for({"10.0.0.1:50051", "10.0.0.2:50051"});
  ClientOptions options = Name::options(name);
  options.addresses = {"10.0.0.9:1", options.address};
  const Endpoints endpoints(options);
  EXPECT_EQ(name->times_asked(), 0) << "nobody is called before the first call";
  EXPECT_THAT(addresses_of(endpoints.in_order("")),
              testing::ElementsAre("10.0.0.9:1", "10.0.0.1:50051", "10.0.0.2:50051"));
}

TEST(Endpoints, AreTheNameItselfWhereNobodyKnowsIt) {
  const Endpoints endpoints(Name::options(std::make_shared<Name>()));
  EXPECT_THAT(addresses_of(endpoints.in_order("")), testing::ElementsAre("slicers.example:50051"));
}

TEST(Endpoints, AreLookedUpAgainAfterFailuresAndKeepTheirConnections) {
  const auto name = std::make_shared<Name>();
  name->stand_for({"10.0.0.1:50051", "10.0.0.2:50051"});
  const Endpoints endpoints(Name::options(name));
  const EndpointList before = endpoints.in_order("");
  name->stand_for({"10.0.0.2:50051", "10.0.0.3:50051"});
  endpoints.look_up_soon();
  ASSERT_TRUE(comes_true([&] { return endpoints.in_order("").back()->address == "10.0.0.3:50051"; }));
  EXPECT_EQ(endpoints.in_order("").front(), before.back());
  name->stand_for({});
  endpoints.look_up_soon();
  ASSERT_TRUE(comes_true([&] { return name->times_asked() == 3; }));
  EXPECT_EQ(endpoints.in_order("").size(), 2u) << "what was known is better than nothing";
}

TEST(Endpoints, AreNotLookedUpMoreThanOnceASecond) {
  const auto name = std::make_shared<Name>();
  const Endpoints endpoints(Name::options(name));
  for (int i = 0; i < 30; ++i) {
    endpoints.in_order("");
    endpoints.look_up_soon();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_LE(name->times_asked(), 2);
}

TEST(Endpoints, AreTheNameItselfAsLongAsTheAnswerTakesItsTime) {
  const auto answers = std::make_shared<std::atomic<bool>>(false);
  const Endpoints endpoints({.address = "slow.example:1", .resolver = [answers](const auto&, const auto&) {
                               for (int i = 0; i < 1000 && !*answers; ++i) {
                                 std::this_thread::sleep_for(std::chrono::milliseconds(10));
                               }
                               return std::vector<std::string>{"10.0.0.1:1", "10.0.0.2:1"};
                             }});
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(addresses_of(endpoints.in_order("")), testing::ElementsAre("slow.example:1"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  *answers = true;
  EXPECT_TRUE(comes_true([&] { return endpoints.in_order("").size() == 2; }));
}

TEST(Endpoints, DoNotWaitForAnAnswerWhenTheyEnd) {
  const auto asked = std::make_shared<std::atomic<int>>(0);
  const auto begin = std::chrono::steady_clock::now();
  {
    const Endpoints endpoints({.address = "slow.example:1", .resolver = [asked](const auto&, const auto&) {
                                 if (++*asked > 1) std::this_thread::sleep_for(std::chrono::seconds(10));
                                 return std::vector<std::string>();
                               }});
    endpoints.in_order("");
    endpoints.look_up_soon();
    ASSERT_TRUE(comes_true([&] { return *asked == 2; }));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(9));
}

TEST(Endpoints, RefuseAddressesThatAreNone) {
  EXPECT_EQ(error_of([] { Client client(options_of({"a:1", "a:1"})); }).reason(), local_reason::kAddressInvalid);
  EXPECT_EQ(error_of([] { Client client({.address = "nowhere"}); }).reason(), local_reason::kAddressInvalid);
}

}  // namespace
}  // namespace ccslice::client
