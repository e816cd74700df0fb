// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_room.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

class Call final : public IdleCall {
 public:
  Call(const int* mesh, std::uint64_t bytes, std::string client) : kept_{mesh, bytes, std::move(client)} {}
  KeptMesh kept_mesh() const override { return kept_; }
  void wait() { arm_wait(begin_wait()); }
  int ended = 0;

 private:
  void idle() override { ++ended; }
  const KeptMesh kept_;
};

class MeshRoom : public testing::Test {
 protected:
  /// A call that waits, since before those that come after it.
  Call& silent(const int& mesh, std::uint64_t bytes, const std::string& client) {
    Call& call = working(mesh, bytes, client);
    call.wait();
    std::this_thread::sleep_for(2ms);
    return call;
  }
  Call& working(const int& mesh, std::uint64_t bytes, const std::string& client) {
    const auto call = std::make_shared<Call>(&mesh, bytes, client);
    calls_.push_back(call);
    return *call;
  }
  std::size_t make_room(const std::string& client, std::uint64_t bytes, std::uint64_t missing) {
    return make_room_for({client, bytes, missing}, calls_, 1ms);
  }

  const int cube_ = 0, ring_ = 0, bone_ = 0;
  std::vector<std::shared_ptr<IdleCall>> calls_;
};

TEST_F(MeshRoom, ComesFromTheMostSilentAndFromNoMoreThanItTakes) {
  const Call& first = silent(cube_, 50, "a");
  const Call& again = silent(cube_, 50, "b");
  const Call& second = silent(ring_, 50, "a");
  const Call& third = silent(bone_, 50, "b");
  EXPECT_EQ(make_room("c", 50, 60), 3u);
  EXPECT_EQ(first.ended + again.ended + second.ended, 3);
  EXPECT_EQ(third.ended, 0);
}

TEST_F(MeshRoom, IsNotTakenFromMeshesThatAreWorkedOn) {
  silent(cube_, 50, "a");
  working(cube_, 50, "b");
  const Call& other = silent(ring_, 50, "a");
  EXPECT_EQ(make_room("c", 50, 60), 0u) << "it wouldn't be enough";
  EXPECT_EQ(make_room("c", 50, 50), 1u);
  EXPECT_EQ(other.ended, 1);
}

TEST_F(MeshRoom, IsNotTakenFromThoseWhoAreSilentForAMomentOnly) {
  silent(cube_, 50, "a");
  EXPECT_EQ(make_room_for({"c", 50, 50}, calls_, 1h), 0u);
}

TEST_F(MeshRoom, IsNotTakenForAClientThatWouldHaveMoreThanTheOther) {
  const Call& own = silent(cube_, 50, "a");
  const Call& other = silent(ring_, 50, "b");
  EXPECT_EQ(make_room("a", 50, 100), 0u);
  EXPECT_EQ(make_room("c", 60, 50), 0u);
  EXPECT_EQ(own.ended + other.ended, 0);
  EXPECT_EQ(make_room("c", 50, 50), 1u) << "of a client with as much";
}

TEST_F(MeshRoom, IsTakenFromTheClientsOwnCalls) {
  const Call& other = silent(ring_, 50, "b");
  const Call& own = silent(cube_, 50, "a");
  EXPECT_EQ(make_room("a", 50, 50), 1u);
  EXPECT_EQ(own.ended, 1);
  EXPECT_EQ(other.ended, 0);
}

TEST_F(MeshRoom, IsNotTakenFromCallsWithoutAMesh) {
  const auto call = std::make_shared<Call>(nullptr, 0, "a");
  calls_.push_back(call);
  call->wait();
  std::this_thread::sleep_for(2ms);
  EXPECT_EQ(make_room("c", 1, 1), 0u);
  EXPECT_EQ(call->ended, 0);
}

TEST(RefusedClients, NeedLessSilenceOnceTheyHaveBeenRefusedForAWhile) {
  RefusedClients refused(10s);
  const RefusedClients::Clock::time_point begin{};
  EXPECT_EQ(refused.least_silence("a", begin), kSilentWithMesh);
  EXPECT_EQ(refused.least_silence("a", begin + 9s), kSilentWithMesh);
  EXPECT_EQ(refused.least_silence("b", begin + 10s), kSilentWithMesh) << "another one";
  EXPECT_EQ(refused.least_silence("a", begin + 10s), kLagsWithMesh);
  EXPECT_EQ(refused.least_silence("a", begin + 39s), kLagsWithMesh);
  EXPECT_EQ(refused.least_silence("a", begin + 70s), kSilentWithMesh) << "after a while without refusals";
}

}  // namespace
}  // namespace ccslice::server
