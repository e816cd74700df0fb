// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a cache holds, drops and counts. mesh_cache_turns_test.cpp has how meshes are prepared for it.

#include "server/service/meshes/mesh_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "server/service/base/service_error.h"
#include "tests/server/service/mesh_cache_fixture.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST_F(MeshCacheTest, PreparesWhatItLacksAndFindsWhatItHas) {
  EXPECT_EQ(cache_.find("a"), nullptr);
  EXPECT_FALSE(put("a", 10).already_cached);
  EXPECT_NE(cache_.find("a"), nullptr);
  const MeshCache::Outcome again = get("a", [](const CancellationToken&, PreparationProgress&) -> PreparedMesh {
    ADD_FAILURE() << "prepared again";
    return {};
  });
  EXPECT_TRUE(again.already_cached);
  EXPECT_EQ(cache_.use().used_bytes, 10u);
}

TEST_F(MeshCacheTest, DropsTheLeastRecentlyUsedFirst) {
  for (const char* id : {"a", "b", "c"}) put(id, 30);
  EXPECT_NE(cache_.find("a"), nullptr);
  put("d", 30);
  EXPECT_NE(cache_.find("a"), nullptr);
  EXPECT_EQ(cache_.find("b"), nullptr);
  EXPECT_NE(cache_.find("c"), nullptr);
  EXPECT_LE(cache_.use().used_bytes, 100u);
}

TEST_F(MeshCacheTest, NeverDropsWhatIsInUse) {
  const MeshPtr used = put("a", 60).mesh;
  EXPECT_EQ(code_of(put("b", 60)), static_cast<int>(ServiceErrorCode::kCacheFull));
  EXPECT_NE(cache_.find("a"), nullptr);
  EXPECT_EQ(cache_.find("b"), nullptr);
  EXPECT_EQ(code_of(put("c", 40)), 0);
}

TEST_F(MeshCacheTest, DropsNothingForAMeshThatDoesntFitAnyway) {
  const MeshPtr used = put("a", 40).mesh;
  put("b", 40);
  EXPECT_EQ(code_of(put("c", 70)), static_cast<int>(ServiceErrorCode::kCacheFull));
  EXPECT_NE(cache_.find("b"), nullptr);
  EXPECT_EQ(code_of(put("d", 60)), 0);
  EXPECT_EQ(cache_.find("b"), nullptr);
}

TEST_F(MeshCacheTest, CountsWhatWasDeletedWhileInUse) {
  MeshPtr used = put("a", 60).mesh;
  EXPECT_TRUE(cache_.erase("a"));
  EXPECT_FALSE(cache_.erase("a"));
  EXPECT_EQ(cache_.use().used_bytes, 60u);
  EXPECT_EQ(code_of(put("b", 60)), static_cast<int>(ServiceErrorCode::kCacheFull));
  used.reset();
  EXPECT_EQ(cache_.use().used_bytes, 0u);
  EXPECT_EQ(code_of(put("b", 60)), 0);
}

TEST_F(MeshCacheTest, RefusesWhatIsLargerThanItself) {
  put("a", 60);
  EXPECT_EQ(code_of(put("b", 101)), static_cast<int>(ServiceErrorCode::kMeshExceedsCache));
  EXPECT_NE(cache_.find("a"), nullptr) << "nothing is dropped in vain";
}

TEST_F(MeshCacheTest, ExpiresWhatNobodyUsedForAWhile) {
  MeshCache::Options with_ttl = options();
  with_ttl.time_to_live = 1min;
  MeshCache cache(executor_, with_ttl);
  const auto put_into = [&](const std::string& id) {
    std::promise<MeshPtr> done;
    cache.get_or_prepare(
        id, [](const CancellationToken&, PreparationProgress&) { return mesh_of(10); },
        [&](const MeshCache::Outcome& outcome) { done.set_value(outcome.mesh); });
    return done.get_future().get();
  };
  put_into("a");
  put_into("b");
  const MeshPtr used = put_into("c");
  now_ += 40s;
  EXPECT_NE(cache.find("a"), nullptr);
  EXPECT_EQ(*cache.peek("a")->expires, now_ + 1min);
  now_ += 40s;
  cache.sweep();
  EXPECT_EQ(cache.use().meshes, 2u);
  EXPECT_EQ(cache.find("b"), nullptr);
  EXPECT_NE(cache.find("c"), nullptr) << "in use";
}

TEST_F(MeshCacheTest, ListsByIdInPages) {
  for (const char* id : {"c", "a", "b"}) put(id, 10);
  const auto page = cache_.list("", 2);
  ASSERT_EQ(page.size(), 2u);
  EXPECT_EQ(page[0].mesh->id(), "a");
  EXPECT_EQ(page[1].mesh->id(), "b");
  EXPECT_EQ(cache_.list("b", 2).at(0).mesh->id(), "c");
}

TEST_F(MeshCacheTest, FreesWhatItDropsWithoutHoldingUpOthers) {
  bool freed = false;
  const auto slow_to_free = [&](const CancellationToken&, PreparationProgress&) {
    PreparedMesh prepared = mesh_of(80);
    prepared.solid.reset(static_cast<const LimitSolid*>(nullptr), [&](const LimitSolid*) {
      freed = true;
      EXPECT_EQ(cache_.find("a"), nullptr) << "would never come back if the cache were locked";
    });
    return prepared;
  };
  EXPECT_EQ(code_of(get("a", slow_to_free)), 0);
  EXPECT_EQ(code_of(put("b", 90)), 0);
  EXPECT_TRUE(freed);
  EXPECT_EQ(cache_.use().used_bytes, 90u);
}

TEST_F(MeshCacheTest, ConsistentUnderConcurrentUse) {
  std::vector<std::thread> clients;
  for (int client = 0; client < 6; ++client) {
    clients.emplace_back([&, client] {
      for (int round = 0; round < 200; ++round) {
        const std::string id(1, static_cast<char>('a' + (client * 7 + round * 3) % 8));
        std::promise<MeshCache::Outcome> done;
        auto ticket = cache_.get_or_prepare(
            id, [](const CancellationToken&, PreparationProgress&) { return mesh_of(20); },
            [&](const MeshCache::Outcome& outcome) { done.set_value(outcome); });
        if (round % 5 == 0) ticket.cancel();
        if (round % 11 == 0) cache_.erase(id);
        done.get_future().wait();
        ASSERT_LE(cache_.use().used_bytes, 200u);
      }
    });
  }
  for (std::thread& client : clients) client.join();
  executor_.wait_idle();
  EXPECT_LE(cache_.use().used_bytes, 100u);
}

}  // namespace
}  // namespace ccslice::server
