// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The mesh store as calls see it: asked on a thread of its own, answered by callbacks, and never waited for for long.
//
//     call -> queue -> the store's thread -> done
//                 \--> the clock, where the store makes no progress -> done, as if the mesh weren't there
//
// A store that is slow or down looks empty. After three failures in a row, or one that took its time, it is left alone
// for a while: then calls don't even wait. While nobody asks, it is looked after now and then, so that somebody who
// watches learns that it is gone.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/service/meshes/mesh_store.h"
#include "server/service/meshes/upload.h"
#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// What is done to a store.
enum class StoreOperation { kRead, kWrite, kLook, kErase, kCheck };
/// How that ends.
enum class StoreOutcome { kFound, kMissing, kDamaged, kFailed };
inline constexpr std::array kStoreOperations = {"read", "write", "look", "erase", "check"};
inline constexpr std::array kStoreOutcomes = {"found", "missing", "damaged", "failed"};

/// Thread-safe.
class StoredMeshes {
 public:
  struct Options {
    std::uint64_t max_mesh_bytes = 0;
    std::chrono::milliseconds patience{1'200};     // With a store that makes no progress.
    std::chrono::milliseconds rest{5'000};         // After kMostFailures.
    std::chrono::milliseconds mark_every{60'000};  // Uses of cached meshes.
    std::chrono::milliseconds check_every{0};      // Whether the store is there, while nobody asks. 0: never.
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

  /// Many who ask for the same mesh at the same time share one read, in the turn of whoever of them has it first, and
  /// its bytes.
  void load(const std::string& mesh_id, const std::string& client, Loaded done);
  /// Whether it was kept. The upload's bytes stay as they are until then.
  void keep(std::shared_ptr<Upload> upload, const std::string& client, Done done);
  /// Which of the meshes are there. Others have their turns between two of them.
  void find(std::vector<std::string> mesh_ids, const std::string& client, Held done);
  /// Whether it was there.
  void erase(const std::string& mesh_id, const std::string& client, Done done);
  /// A cached mesh was used: the store learns it now and then.
  void mark_used(const std::string& mesh_id);
  /// Up to so many ids, last used first; waits for them. None where the store isn't there.
  [[nodiscard]] std::vector<std::string> last_used(std::size_t count);

  /// Whether the store worked when it was asked last.
  bool is_there() const noexcept { return is_there_.load(); }
  std::uint64_t count(StoreOperation operation, StoreOutcome outcome) const {
    return counts_[static_cast<std::size_t>(operation)][static_cast<std::size_t>(outcome)].load();
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Runs on the store's thread, and gives what tells the caller; nothing, if it gave way and isn't over yet.
  using Work = std::function<std::function<void()>(const MeshStore::Progress& progress)>;
  struct Request;
  using RequestPtr = std::shared_ptr<Request>;
  using Requests = std::list<RequestPtr>;
  struct Request {
    StoreOperation operation;
    Work work;
    std::function<void()> give_up;  // In place of what the work gives.
    Clock::time_point posted{};     // Or since when it waits to go on.
    bool answered = false;          // By the clock, before the work was over.
    std::string client{};           // In whose turn it runs.
    bool waits = false;
    // Where it is then among all, and among those of each client who wants it.
    Requests::iterator position{};
    std::map<std::string, Requests::iterator> places{};
  };
  struct Client {
    std::uint64_t last_turn = 0;
    Requests waiting;
  };
  struct Reading {
    std::vector<Loaded> readers;
    RequestPtr request;
  };
  struct Looking;

  void post(const RequestPtr& request, const std::string& client);
  /// False if there is no room for it.
  bool post_locked(const RequestPtr& request, const std::string& client);
  void refuse(const RequestPtr& request);
  bool has_room_locked(const std::string& client) const;
  void wait_locked(const RequestPtr& request, const std::string& client, bool is_next);
  void join_locked(const RequestPtr& request, const std::string& client, bool is_next);
  void take_out_locked(const RequestPtr& request);
  RequestPtr take_next_locked();
  bool others_wait();
  /// Waits for a request, and makes one where nobody has asked for long.
  void wait_for_request(std::unique_lock<std::mutex>& lock);
  RequestPtr make_check();
  void note_whether_it_is_there(StoreOperation operation, bool is_there, const std::string& why);
  std::function<void()> look(Looking& looking, const MeshStore::Progress& progress);
  void serve();
  void run(const RequestPtr& request);
  void watch();
  Clock::time_point next_look_locked() const;
  std::vector<RequestPtr> take_overdue_locked(Clock::time_point now);
  /// Leaves the store alone; those who wait for it.
  std::vector<RequestPtr> rest_locked(Clock::time_point now);
  std::vector<RequestPtr> count_failure_locked(StoreOperation operation, bool hangs);
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

  std::atomic<bool> is_there_{false};

  std::mutex mutex_;
  std::condition_variable changed_;
  Requests queue_;                                           // As they came.
  std::map<std::string, Client> clients_;                    // With a turn or a request.
  std::set<std::pair<std::uint64_t, std::string>> in_turn_;  // Those with requests, by their last turn.
  std::uint64_t turns_ = 0;
  RequestPtr current_;
  Clock::time_point progress_;  // Of the current request.
  Clock::time_point rests_until_;
  Clock::time_point asked_;  // Last, by whomever.
  int failures_ = 0;         // In a row.
  bool over_ = false;
  std::map<std::string, Reading> readings_;          // By mesh.
  std::map<std::string, Clock::time_point> marked_;  // Uses that the store knows.
  std::thread server_, clock_;
};

}  // namespace ccslice::server
