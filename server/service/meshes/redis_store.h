// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes in Redis:
//
//   ccslice:mesh:{sha256:...}       the bytes of the mesh; written as ...:new:RANDOM, then renamed
//   ccslice:meshes                  a sorted set: when each was used last
//
// Bytes go and come in pieces, so that no answer is larger than one and none takes long.

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_store.h"

struct redisContext;
struct redisReply;

namespace ccslice::server {

/// Connects at the first use, and anew after each failure.
class RedisStore final : public MeshStore {
 public:
  RedisStore(MeshStorePlace place, std::string password, std::uint64_t time_to_live_s);
  ~RedisStore() override;

  bool read(const std::string& mesh_id, const Sink& sink) override;
  void write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress& progress) override;
  bool contains(const std::string& mesh_id) override;
  bool erase(const std::string& mesh_id) override;
  std::vector<std::string> last_used(std::size_t count, const Progress& progress) override;
  void check() override;

 private:
  struct FreeContext {
    void operator()(redisContext* context) const noexcept;
  };
  struct FreeReply {
    void operator()(redisReply* reply) const noexcept;
  };
  using Reply = std::unique_ptr<redisReply, FreeReply>;

  /// The answer to one command, of which any argument may hold any bytes. Errors are thrown.
  Reply ask(const std::vector<std::string>& arguments);
  Reply ask_connected(const std::vector<std::string>& arguments);
  long long ask_number(const std::vector<std::string>& arguments);
  void connect();
  void mark_used(const std::string& mesh_id);
  void write_as(const std::string& key, const std::vector<std::string>& blocks, const Progress& progress);
  [[noreturn]] void fail(const std::string& why, StoreFault fault = StoreFault::kFails);
  bool is_still_connected();

  const MeshStorePlace place_;
  const std::string password_;
  const std::uint64_t time_to_live_s_;
  std::unique_ptr<redisContext, FreeContext> context_;
  std::chrono::steady_clock::time_point last_use_;
};

}  // namespace ccslice::server
