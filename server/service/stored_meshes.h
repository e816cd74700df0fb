// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The mesh store as calls see it: asked on a thread of its own, answered by callbacks, and never waited for for long.
//
//     call -> queue -> the store's thread -> done
//                 \--> the clock, where the store makes no progress -> done, as if the mesh weren't there
//
// A store that is slow or down looks empty. After three failures in a row, or one that took its time, it is left alone
// for a while: then calls don't even wait.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/service/memory_budget.h"
#include "server/service/mesh_store.h"
#include "server/service/upload.h"

namespace ccslice::server {

/// What is done to a store.
enum class StoreOperation { kRead, kWrite, kLook, kErase };
/// How that ends.
enum class StoreOutcome { kFound, kMissing, kDamaged, kFailed };
inline constexpr std::array kStoreOperations = {"read", "write", "look", "erase"};
inline constexpr std::array kStoreOutcomes = {"found", "missing", "damaged", "failed"};

/// Thread-safe.
class StoredMeshes {
 public:
  struct Options {
    std::uint64_t max_mesh_bytes = 0;
    std::chrono::milliseconds patience{1'200};     // With a store that makes no progress.
    std::chrono::milliseconds rest{5'000};         // After kMostFailures.
    std::chrono::milliseconds mark_every{60'000};  // Uses of cached meshes.
  };
  static constexpr int kMostFailures = 3;

  /// The bytes of a mesh, whole and checked; null where the store doesn't have it, or isn't there. Instead of both: why
  /// the bytes can't be held.
  using Loaded = std::function<void(std::shared_ptr<Upload> upload, std::exception_ptr error)>;
  /// One for each that was asked for; none if the store isn't there.
  using Held = std::function<void(std::vector<bool> held)>;
  /// Nothing: the store isn't there.
  using Done = std::function<void(std::optional<bool> done)>;

  /// `budget`: of the bytes that were read. It outlives this.
  StoredMeshes(std::unique_ptr<MeshStore> store, MemoryBudget& budget, Options options);
  /// Waits for what the store is doing. What is queued is answered.
  ~StoredMeshes();
  StoredMeshes(const StoredMeshes&) = delete;
  StoredMeshes& operator=(const StoredMeshes&) = delete;

  // All callbacks run once: on the store's thread, on the clock's, or on the caller's where the store rests. `client`:
  // who asks (client_id.h): clients take turns, and a quarter of what may wait is never one client's.

  /// Many who ask for the same mesh at the same time share one read, and its bytes.
  void load(const std::string& mesh_id, const std::string& client, Loaded done);
  /// Whether it was kept. The upload's bytes stay as they are until then.
  void keep(std::shared_ptr<Upload> upload, const std::string& client, Done done);
  /// Which of the meshes are there.
  void find(std::vector<std::string> mesh_ids, const std::string& client, Held done);
  /// Whether it was there.
  void erase(const std::string& mesh_id, const std::string& client, Done done);
  /// A cached mesh was used: the store learns it now and then.
  void mark_used(const std::string& mesh_id);
  /// Up to so many ids, last used first; waits for them. None where the store isn't there.
  [[nodiscard]] std::vector<std::string> last_used(std::size_t count);

  std::uint64_t count(StoreOperation operation, StoreOutcome outcome) const {
    return counts_[static_cast<std::size_t>(operation)][static_cast<std::size_t>(outcome)].load();
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Runs on the store's thread, and gives what tells the caller.
  using Work = std::function<std::function<void()>(const MeshStore::Progress& progress)>;
  struct Request {
    StoreOperation operation;
    std::string client;
    Work work;
    std::function<void()> give_up;  // In place of what the work gives.
    Clock::time_point posted;
    bool answered = false;  // By the clock, before the work was over.
  };
  using RequestPtr = std::shared_ptr<Request>;

  void post(StoreOperation operation, const std::string& client, Work work, std::function<void()> instead);
  bool has_room_locked(const std::string& client) const;
  RequestPtr take_next_locked();
  void serve();
  void run(const RequestPtr& request);
  void watch();
  Clock::time_point next_look_locked() const;
  std::vector<RequestPtr> take_overdue_locked(Clock::time_point now);
  /// Leaves the store alone; those who wait for it.
  std::vector<RequestPtr> rest_locked(Clock::time_point now);
  std::vector<RequestPtr> count_failure_locked(bool hangs);
  void give_up(const std::vector<RequestPtr>& requests);
  void note(StoreOperation operation, StoreOutcome outcome) {
    ++counts_[static_cast<std::size_t>(operation)][static_cast<std::size_t>(outcome)];
  }
  std::shared_ptr<Upload> read(const std::string& mesh_id, const MeshStore::Progress& progress);
  void tell_readers(const std::string& mesh_id, const std::shared_ptr<Upload>& upload, const std::exception_ptr& error);

  const std::unique_ptr<MeshStore> store_;  // The store's thread's alone.
  MemoryBudget& budget_;
  const Options options_;
  std::array<std::array<std::atomic<std::uint64_t>, kStoreOutcomes.size()>, kStoreOperations.size()> counts_{};

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<RequestPtr> queue_;                  // As they came.
  std::map<std::string, std::uint64_t> last_of_;  // By client with a turn or a request: the number of its last turn.
  std::uint64_t turns_ = 0;
  RequestPtr current_;
  Clock::time_point progress_;  // Of the current request.
  Clock::time_point rests_until_;
  int failures_ = 0;  // In a row.
  bool over_ = false;
  std::map<std::string, std::vector<Loaded>> readers_;  // By mesh.
  std::map<std::string, Clock::time_point> marked_;     // Uses that the store knows.
  std::thread server_, clock_;
};

}  // namespace ccslice::server
