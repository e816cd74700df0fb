// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cache of prepared solids, by mesh id. Volumes are kept among them, as solids are, under ids of the same form.
//
// - The cache is bounded in bytes. Every solid that is alive counts, also one that was dropped while a call still uses
//   it. To make room, the cache drops the least recently used meshes that nobody uses; a mesh in use stays.
// - Two requests for the same mesh at the same time cause one preparation, and share its result or its error. It is
//   cancelled once nobody waits for it any more. It begins in the turn of whoever of those who wait has it first. One
//   that lacks memory goes back to its lane until there is some.
// - A preparation that fails caches nothing.
// - Meshes that nobody used for a while expire, if a time to live is set.

#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/preparation_progress.h"
#include "core/volume/volume.h"
#include "server/service/meshes/preparation_memory.h"
#include "server/service/scheduling/executor.h"

namespace ccslice::server {

using Clock = std::chrono::system_clock;

/// What a preparation yields.
struct PreparedMesh {
  std::shared_ptr<const LimitSolid> solid;  // Null if it is a volume.
  std::shared_ptr<const Volume> volume;     // Null if it is a solid.
  std::uint64_t serialized_bytes = 0;       // Size of the ControlMesh or Volume.
  std::uint64_t memory_bytes = 0;           // Size of the solid or volume, which counts in the cache.
  std::chrono::nanoseconds preparation_time{0};
};

/// A cached mesh. Immutable; in use as long as somebody besides the cache holds a pointer to it.
class CachedMesh {
 public:
  CachedMesh(std::string id, PreparedMesh prepared, Clock::time_point created,
             std::shared_ptr<std::atomic<std::uint64_t>> live_bytes);
  ~CachedMesh();
  CachedMesh(const CachedMesh&) = delete;
  CachedMesh& operator=(const CachedMesh&) = delete;

  const std::string& id() const noexcept { return id_; }
  /// Throws ServiceError{kMeshIdInvalid} of this field if it is a volume.
  const std::shared_ptr<const LimitSolid>& solid(const std::string& field = "mesh_id") const;
  /// Null if it is a solid.
  const std::shared_ptr<const Volume>& volume() const noexcept { return prepared_.volume; }
  const PreparedMesh& prepared() const noexcept { return prepared_; }
  Clock::time_point created() const noexcept { return created_; }

 private:
  std::string id_;
  PreparedMesh prepared_;
  Clock::time_point created_;
  std::shared_ptr<std::atomic<std::uint64_t>> live_bytes_;
};

using MeshPtr = std::shared_ptr<const CachedMesh>;

/// Solids of the first `count`, those of a job's parts. Throws ServiceError{kMeshIdInvalid} of "job.parts[i].mesh_id"
/// if one of them is a volume.
std::vector<std::shared_ptr<const LimitSolid>> solids_of_parts(const std::vector<MeshPtr>& meshes, int count);

/// Volumes by their ids; those in use keep their place in the cache.
using Volumes = std::map<std::string, std::shared_ptr<const Volume>>;
/// Volumes among the meshes of a request.
Volumes volumes_of(const std::vector<MeshPtr>& meshes);

/// A mesh as the list shows it.
struct ListedMesh {
  MeshPtr mesh;
  Clock::time_point last_use;
  std::optional<Clock::time_point> expires;
};

struct CacheUse {
  std::uint64_t capacity_bytes = 0;
  std::uint64_t used_bytes = 0;  // Alive, dropped ones in use included.
  std::size_t meshes = 0;
  // Since the start:
  std::uint64_t hits = 0, misses = 0;
  std::uint64_t evictions = 0;  // For room or age.
  std::uint64_t prepared = 0, failed_preparations = 0;
};

/// A mesh that found no room because all others are in use.
struct RefusedMesh {
  std::string client;
  std::uint64_t bytes = 0;
  std::uint64_t missing_bytes = 0;  // Besides what nobody uses.
};

/// Thread-safe.
class MeshCache {
 public:
  struct Options {
    std::uint64_t capacity_bytes = 1ull << 30;
    std::chrono::milliseconds time_to_live{0};  // Since the last use. 0: never expires.
    std::function<Clock::time_point()> now = &Clock::now;
  };
  /// A long piece of work on a worker thread; may throw. Destroyed as soon as it is over, or nobody waits for it. Where
  /// it throws PreparationMemory::Lack it isn't over: it is called again, as the next piece of its lane.
  using Prepare = std::function<PreparedMesh(const CancellationToken& cancel, PreparationProgress& progress)>;
  struct Outcome {
    MeshPtr mesh;              // Null if it failed.
    std::exception_ptr error;  // Why.
    bool already_cached = false;
  };
  /// Called exactly once, without locks held, on the caller's thread or a worker's.
  using Done = std::function<void(Outcome)>;

  /// A place in the queue for a preparation.
  class Ticket {
   public:
    Ticket() = default;
    /// Stops waiting: `done` is called with Error{kCancelled} unless it was called already. Any thread, any number of
    /// times.
    void cancel();

   private:
    friend class MeshCache;
    Ticket(MeshCache& cache, std::string id, std::uint64_t waiter)
        : cache_(&cache), id_(std::move(id)), waiter_(waiter) {}
    MeshCache* cache_ = nullptr;
    std::string id_;
    std::uint64_t waiter_ = 0;
  };

  /// The executor outlives the cache.
  MeshCache(Executor& executor, Options options);

  /// The mesh, marked as used now; null if it isn't there.
  MeshPtr find(const std::string& id);
  /// The mesh if it's there; otherwise prepares it, or joins the preparation that is running.
  /// Errors: what `prepare` throws; ServiceError{kMeshExceedsCache, kCacheFull}; Error{kCancelled}.
  /// `client`: who a preparation that begins in his turn is charged to.
  Ticket get_or_prepare(const std::string& id, Prepare prepare, Done done, const std::string& client = {});
  /// How far the preparation of the mesh is; nothing if none is under way. Doesn't use the mesh.
  std::optional<PreparationProgress::State> preparation(const std::string& id);
  /// A mesh that found no room, as all others are in use (kCacheFull), since this was asked last; the latest one.
  std::optional<RefusedMesh> take_refused();
  /// Drops the mesh; false if it wasn't there. A preparation that is running goes on.
  bool erase(const std::string& id);
  /// Up to `limit` meshes with ids behind `after`, by id.
  std::vector<ListedMesh> list(const std::string& after, std::size_t limit);
  /// One mesh as the list shows it, without using it; nothing if it isn't there.
  [[nodiscard]] std::optional<ListedMesh> peek(const std::string& id);
  CacheUse use();
  /// Drops what has expired. Every other call does so too.
  void sweep();

 private:
  struct Entry {
    MeshPtr mesh;
    Clock::time_point last_use;
    std::list<std::string>::iterator recency;
  };
  struct Preparation {
    Prepare prepare;  // Until it runs, or nobody waits for it any more.
    std::string client;
    std::map<std::string, Executor::Lane> lanes;  // Of each client who waited for it. The first to come to it runs it.
    bool runs = false;                            // Or it is over.
    CancellationToken cancel = Executor::make_token();
    std::unique_ptr<PreparationProgress> progress = std::make_unique<PreparationProgress>();  // Of this attempt.
    std::map<std::uint64_t, Done> waiters;
  };

  void run(const std::string& id, const std::shared_ptr<Preparation>& preparation);
  void wait_for_memory(const std::string& id, const std::shared_ptr<Preparation>& preparation,
                       const PreparationMemory::Lack& lack);
  void run_again(const std::string& id, const std::shared_ptr<Preparation>& preparation);
  PreparedMesh prepare(Preparation& preparation);
  MeshPtr insert(const std::string& id, PreparedMesh prepared, const std::string& client);
  MeshPtr insert_locked(const std::string& id, PreparedMesh& prepared, const std::string& client,
                        std::vector<MeshPtr>& dropped);
  /// Drops what nobody uses, as far as room for `bytes` takes it. Nothing, if that isn't enough: what is missing then.
  std::uint64_t make_room_locked(std::uint64_t bytes, std::vector<MeshPtr>& dropped);
  void touch_locked(Entry& entry);
  void sweep_locked(std::vector<MeshPtr>& dropped);
  void drop_locked(std::map<std::string, Entry>::iterator entry);
  ListedMesh listed_locked(const Entry& entry) const;
  void cancel(const std::string& id, std::uint64_t waiter);

  Executor& executor_;
  const Options options_;
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::list<std::string> recency_;  // Ids, least recently used first.
  std::map<std::string, std::shared_ptr<Preparation>> preparations_;
  std::uint64_t next_waiter_ = 1;
  std::shared_ptr<std::atomic<std::uint64_t>> live_bytes_;
  CacheUse counts_;                  // What happened since the start.
  std::uint64_t leaving_bytes_ = 0;  // Dropped for their room and about to be freed: alive, but not counted.
  std::optional<RefusedMesh> refused_;
};

}  // namespace ccslice::server
