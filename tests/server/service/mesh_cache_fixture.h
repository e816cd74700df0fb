// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A small cache for tests, filled with meshes that are nothing but a number of bytes.

#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <exception>
#include <future>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "server/service/base/service_error.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

inline PreparedMesh mesh_of(std::uint64_t bytes) {
  PreparedMesh prepared;
  prepared.memory_bytes = bytes;
  return prepared;
}

/// What an outcome says: 0, an ErrorCode or a ServiceErrorCode.
inline int code_of(const MeshCache::Outcome& outcome) {
  try {
    if (outcome.error) std::rethrow_exception(outcome.error);
  } catch (const Error& error) {
    return static_cast<int>(error.code());
  } catch (const ServiceError& error) {
    return static_cast<int>(error.code());
  }
  return 0;
}

/// A cache of 100 bytes, with a clock of its own, whose preparations have two threads.
class MeshCacheTest : public ::testing::Test {
 protected:
  MeshCache::Options options() {
    MeshCache::Options options{.capacity_bytes = 100, .time_to_live = std::chrono::milliseconds(0)};
    options.now = [this] { return now_; };
    return options;
  }

  MeshCache::Outcome get(const std::string& id, MeshCache::Prepare prepare) {
    std::promise<MeshCache::Outcome> done;
    cache_.get_or_prepare(id, std::move(prepare),
                          [&done](const MeshCache::Outcome& outcome) { done.set_value(outcome); });
    return done.get_future().get();
  }
  MeshCache::Outcome put(const std::string& id, std::uint64_t bytes) {
    return get(id, [bytes](const CancellationToken&, PreparationProgress&) { return mesh_of(bytes); });
  }

  Clock::time_point now_ = Clock::time_point(std::chrono::hours(1000));
  Executor executor_{2};
  MeshCache cache_{executor_, options()};
};

}  // namespace ccslice::server
