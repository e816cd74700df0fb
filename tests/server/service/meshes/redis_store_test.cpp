// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/redis_store.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/service/redis_process.h"
#include "tests/server/service/stored_bytes.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

RedisStore store_of(const RedisProcess& redis, std::uint64_t time_to_live_s = 0, const std::string& password = "",
                    int database = 0) {
  return RedisStore({.folder = {}, .user = {}, .host = "127.0.0.1", .port = redis.port(), .database = database},
                    password, time_to_live_s);
}

std::string write(RedisStore& store, const std::string& bytes) {
  const std::string id = mesh_id_of(bytes);
  store.write(id, {bytes.substr(0, 1), bytes.substr(1)}, [] {});
  return id;
}

std::string error_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

TEST(RedisStoreTest, GivesBackWhatWasWritten) {
  const RedisProcess redis;
  RedisStore store = store_of(redis), other = store_of(redis), another = store_of(redis, 0, "", 1);
  std::string bytes(9 << 20, '\0');  // Three pieces.
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i % 251);
  EXPECT_FALSE(store.contains(mesh_id_of(bytes)));
  const std::string id = write(store, bytes);
  EXPECT_TRUE(other.contains(id));
  EXPECT_TRUE(stored_bytes(other, id) == bytes);
  EXPECT_FALSE(another.contains(id));
  const std::string second = write(store, "second");
  EXPECT_EQ(write(store, "second"), second);  // In its own place.
  EXPECT_EQ(stored_bytes(store, second), "second");
  EXPECT_EQ(store.last_used(10, [] {}), (std::vector<std::string>{second, id}));
  EXPECT_EQ(store.last_used(0, [] {}), std::vector<std::string>{});
  EXPECT_EQ(redis.ask("DBSIZE"), "3\n");
  EXPECT_EQ(redis.ask("TTL 'ccslice:mesh:{" + id + "}'"), "-1\n");
  EXPECT_TRUE(store.erase(id));
  EXPECT_FALSE(store.erase(id));
  EXPECT_EQ(store.last_used(10, [] {}), (std::vector<std::string>{second}));
}

TEST(RedisStoreTest, UseRenewsTheTimeToLive) {
  const RedisProcess redis;
  RedisStore store = store_of(redis, 1000);
  const std::string id = write(store, "bytes");
  const std::string key = "'ccslice:mesh:{" + id + "}'";
  EXPECT_GT(std::stoi(redis.ask("TTL " + key)), 990);
  redis.ask("EXPIRE " + key + " 5");
  EXPECT_TRUE(store.contains(id));
  EXPECT_GT(std::stoi(redis.ask("TTL " + key)), 990);
}

TEST(RedisStoreTest, PasswordsOpenAndNeverShow) {
  const RedisProcess redis({"--requirepass", "geheim1"});
  RedisStore right = store_of(redis, 0, "geheim1");
  EXPECT_EQ(stored_bytes(right, write(right, "bytes")), "bytes");
  RedisStore wrong = store_of(redis, 0, "geheim2"), none = store_of(redis);
  const std::string refusal = error_of([&] { (void)wrong.contains(mesh_id_of("bytes")); });
  EXPECT_NE(refusal.find("refuses AUTH"), std::string::npos) << refusal;
  EXPECT_EQ(refusal.find("geheim"), std::string::npos) << refusal;
  EXPECT_NE(error_of([&] { (void)none.contains(mesh_id_of("bytes")); }).find("NOAUTH"), std::string::npos);
}

TEST(RedisStoreTest, UsersOpenWithTheirPasswords) {
  const RedisProcess redis;
  redis.ask("ACL SETUSER slicer on '>geheim1' '~ccslice:*' '+@all'");
  redis.ask("ACL SETUSER default off");
  const auto store_of_user = [&](const std::string& user, const std::string& password) {
    return RedisStore({.folder = {}, .user = user, .host = "127.0.0.1", .port = redis.port(), .database = 0}, password,
                      0);
  };
  RedisStore right = store_of_user("slicer", "geheim1");
  EXPECT_EQ(stored_bytes(right, write(right, "bytes")), "bytes");
  right.check();
  RedisStore wrong = store_of_user("slicer", "geheim2"), unknown = store_of_user("nobody", "geheim1");
  for (RedisStore* store : {&wrong, &unknown}) {
    const std::string refusal = error_of([&] { store->check(); });
    EXPECT_NE(refusal.find("refuses AUTH"), std::string::npos) << refusal;
    EXPECT_EQ(refusal.find("geheim"), std::string::npos) << refusal;
  }
}

TEST(RedisStoreTest, AFullRedisIsToldAndHoldsNoHalves) {
  const RedisProcess redis({"--maxmemory", "3mb", "--maxmemory-policy", "noeviction"});
  RedisStore store = store_of(redis);
  const std::string refusal = error_of([&] { write(store, std::string(16 << 20, 'x')); });
  EXPECT_NE(refusal.find("OOM"), std::string::npos) << refusal;
  EXPECT_EQ(redis.ask("DBSIZE"), "0\n");
  EXPECT_FALSE(store.contains(mesh_id_of("y")));
}

TEST(RedisStoreTest, SaysThatItIsDownAndComesBack) {
  RedisProcess redis;
  RedisStore store = store_of(redis);
  const std::string id = write(store, "bytes");
  redis.kill();
  EXPECT_NE(error_of([&] { (void)store.contains(id); }).find("the mesh store redis://127.0.0.1"), std::string::npos);
  EXPECT_NE(error_of([&] { (void)store.contains(id); }).find("refused"), std::string::npos);
  EXPECT_NE(error_of([&] { store.check(); }), "");
  redis.start();
  store.check();
  EXPECT_FALSE(store.contains(id));  // It forgot.
  EXPECT_EQ(stored_bytes(store, write(store, "bytes")), "bytes");
}

TEST(RedisStoreTest, DoesNotWaitForOneThatIsStopped) {
  RedisProcess redis;
  RedisStore store = store_of(redis);
  const std::string id = write(store, "bytes");
  redis.stop_answering();
  const auto begin = Steady::now();
  try {
    (void)store.contains(id);
    ADD_FAILURE();
  } catch (const StoreError& error) {
    EXPECT_EQ(error.fault(), StoreFault::kHangs) << error.what();
  }
  EXPECT_LT(Steady::now() - begin, 4s);
  redis.answer_again();
  EXPECT_EQ(stored_bytes(store, id), "bytes");
}

}  // namespace
}  // namespace ccslice::server
