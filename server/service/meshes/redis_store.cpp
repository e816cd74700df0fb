// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/redis_store.h"

#include <hiredis/hiredis.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <random>
#include <utility>

#include "core/base/echo.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

constexpr timeval kConnectWait{.tv_sec = 0, .tv_usec = 200'000};
constexpr timeval kAnswerWait{.tv_sec = 1, .tv_usec = 0};
constexpr std::uint64_t kPieceBytes = 4 << 20;
constexpr const char* kLastUses = "ccslice:meshes";
constexpr const char* kBeyondMostUses = "-100001";  // All ranks but the last 100,000.
constexpr const char* kAbandonedAfterS = "600";     // Nobody writes a mesh for so long.

/// In braces: a cluster keeps the mesh, and what is to become it, together.
std::string key_of(const std::string& mesh_id) { return "ccslice:mesh:{" + mesh_id + "}"; }

std::string now_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
}

std::string text_of(const redisReply& reply) { return {reply.str, reply.len}; }

}  // namespace

void RedisStore::FreeContext::operator()(redisContext* context) const noexcept { redisFree(context); }
void RedisStore::FreeReply::operator()(redisReply* reply) const noexcept { freeReplyObject(reply); }

RedisStore::RedisStore(MeshStorePlace place, std::string password, std::uint64_t time_to_live_s)
    : place_(std::move(place)), password_(std::move(password)), time_to_live_s_(time_to_live_s) {}

RedisStore::~RedisStore() = default;

bool RedisStore::read(const std::string& mesh_id, const Sink& sink) {
  const std::string key = key_of(mesh_id);
  const auto size = static_cast<std::uint64_t>(ask_number({"STRLEN", key}));
  if (size == 0) {
    (void)ask({"ZREM", kLastUses, mesh_id});  // Dropped by Redis.
    return false;
  }
  mark_used(mesh_id);
  sink.begin(size);
  for (std::uint64_t at = 0; at < size; at += kPieceBytes) {
    const std::uint64_t last = std::min(at + kPieceBytes, size) - 1;
    const Reply piece = ask({"GETRANGE", key, std::to_string(at), std::to_string(last)});
    if (piece->type != REDIS_REPLY_STRING) fail("it gave no bytes");
    sink.append({piece->str, piece->len});
  }
  return true;
}

void RedisStore::write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress& progress) {
  const std::string key = key_of(mesh_id);
  const std::string fresh =
      key + ":new:" + std::to_string(std::random_device()()) + std::to_string(std::random_device()());
  try {
    write_as(fresh, blocks, progress);
    (void)ask({"RENAME", fresh, key});
  } catch (const StoreError&) {
    if (context_) {  // The connection is fine: Redis refused.
      try {
        (void)ask_connected({"DEL", fresh});
      } catch (const StoreError&) {
        context_.reset();
      }
    }
    throw;
  }
  if (time_to_live_s_ == 0) (void)ask({"PERSIST", key});
  mark_used(mesh_id);
  (void)ask({"ZREMRANGEBYRANK", kLastUses, "0", kBeyondMostUses});
}

void RedisStore::write_as(const std::string& key, const std::vector<std::string>& blocks, const Progress& progress) {
  bool is_first = true;
  for (const std::string& block : blocks) {
    for (std::size_t at = 0; at < block.size(); at += kPieceBytes) {
      (void)ask({"APPEND", key, block.substr(at, kPieceBytes)});
      if (is_first) (void)ask({"EXPIRE", key, kAbandonedAfterS});
      is_first = false;
      progress();
    }
  }
}

bool RedisStore::contains(const std::string& mesh_id) {
  if (ask_number({"EXISTS", key_of(mesh_id)}) == 0) return false;
  mark_used(mesh_id);
  return true;
}

bool RedisStore::erase(const std::string& mesh_id) {
  (void)ask({"ZREM", kLastUses, mesh_id});
  return ask_number({"DEL", key_of(mesh_id)}) > 0;
}

std::vector<std::string> RedisStore::last_used(std::size_t count, const Progress&) {
  if (count == 0) return {};
  const Reply reply = ask({"ZREVRANGE", kLastUses, "0", std::to_string(count - 1)});
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < reply->elements; ++i) {
    const std::string id = text_of(*reply->element[i]);
    if (is_mesh_id(id)) ids.push_back(id);
  }
  return ids;
}

void RedisStore::check() { (void)ask({"PING"}); }

void RedisStore::mark_used(const std::string& mesh_id) {
  if (time_to_live_s_ > 0) (void)ask({"EXPIRE", key_of(mesh_id), std::to_string(time_to_live_s_)});
  (void)ask({"ZADD", kLastUses, now_ms(), mesh_id});
}

long long RedisStore::ask_number(const std::vector<std::string>& arguments) {
  const Reply reply = ask(arguments);
  if (reply->type != REDIS_REPLY_INTEGER) fail("it gave no number");
  return reply->integer;
}

RedisStore::Reply RedisStore::ask(const std::vector<std::string>& arguments) {
  if (!is_still_connected()) connect();
  return ask_connected(arguments);
}

/// Redis closes connections that nobody used for a while, and all when it starts again.
bool RedisStore::is_still_connected() {
  constexpr std::chrono::seconds kSure(1);
  if (!context_) return false;
  if (std::chrono::steady_clock::now() - last_use_ < kSure) return true;
  try {
    (void)ask_connected({"PING"});
    return true;
  } catch (const StoreError& error) {
    if (error.fault() == StoreFault::kHangs) throw;
    context_.reset();
    return false;
  }
}

RedisStore::Reply RedisStore::ask_connected(const std::vector<std::string>& arguments) {
  std::vector<const char*> pointers;
  std::vector<std::size_t> sizes;
  for (const std::string& argument : arguments) {
    pointers.push_back(argument.data());
    sizes.push_back(argument.size());
  }
  Reply reply(static_cast<redisReply*>(
      redisCommandArgv(context_.get(), static_cast<int>(pointers.size()), pointers.data(), sizes.data())));
  if (!reply && context_->err == REDIS_ERR_IO && errno == EAGAIN) {
    fail("it doesn't answer within a second", StoreFault::kHangs);
  }
  if (!reply) fail(context_->errstr);
  last_use_ = std::chrono::steady_clock::now();
  // Redis is reached and says no: the connection can go on.
  if (reply->type == REDIS_REPLY_ERROR) {
    // Where AUTH isn't known, Redis repeats the password.
    const std::string why = arguments.front() == "AUTH" ? "the user or the password" : echoed(text_of(*reply), 200);
    throw StoreError(StoreFault::kRefuses,
                     "the mesh store " + show_mesh_store(place_) + " refuses " + arguments.front() + ": " + why);
  }
  return reply;
}

void RedisStore::connect() {
  context_.reset(redisConnectWithTimeout(place_.host.c_str(), place_.port, kConnectWait));
  if (!context_) fail("there is no memory for a connection");
  if (context_->err != 0) {
    const bool hangs = errno == ETIMEDOUT || errno == EINPROGRESS;
    fail(context_->errstr, hangs ? StoreFault::kHangs : StoreFault::kFails);
  }
  if (redisSetTimeout(context_.get(), kAnswerWait) != REDIS_OK) fail(context_->errstr);
  redisEnableKeepAlive(context_.get());
  try {
    if (!place_.user.empty()) {
      (void)ask_connected({"AUTH", place_.user, password_});
    } else if (!password_.empty()) {
      (void)ask_connected({"AUTH", password_});
    }
    if (place_.database != 0) (void)ask_connected({"SELECT", std::to_string(place_.database)});
  } catch (const StoreError&) {
    context_.reset();
    throw;
  }
}

void RedisStore::fail(const std::string& why, StoreFault fault) {
  const std::string text = "the mesh store " + show_mesh_store(place_) + " fails: " + echoed(why, 200);
  context_.reset();
  throw StoreError(fault, text);
}

}  // namespace ccslice::server
