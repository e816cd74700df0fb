// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_cache.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/service/base/service_error.h"

namespace ccslice::server {

CachedMesh::CachedMesh(std::string id, PreparedMesh prepared, Clock::time_point created,
                       std::shared_ptr<std::atomic<std::uint64_t>> live_bytes)
    : id_(std::move(id)), prepared_(std::move(prepared)), created_(created), live_bytes_(std::move(live_bytes)) {
  live_bytes_->fetch_add(prepared_.memory_bytes);
}

const std::shared_ptr<const LimitSolid>& CachedMesh::solid(const std::string& field) const {
  if (prepared_.solid) return prepared_.solid;
  throw ServiceError(ServiceErrorCode::kMeshIdInvalid,
                     id_ + " is the id of a volume, and a mesh's is needed; volumes are for fields", field);
}

std::vector<std::shared_ptr<const LimitSolid>> solids_of_parts(const std::vector<MeshPtr>& meshes, int count) {
  std::vector<std::shared_ptr<const LimitSolid>> solids;
  for (std::size_t part = 0; part < static_cast<std::size_t>(count); ++part) {
    solids.push_back(meshes[part]->solid("job.parts[" + std::to_string(part) + "].mesh_id"));
  }
  return solids;
}

Volumes volumes_of(const std::vector<MeshPtr>& meshes) {
  Volumes volumes;
  for (const MeshPtr& mesh : meshes) {
    if (mesh->volume()) volumes.emplace(mesh->id(), std::shared_ptr<const Volume>(mesh, mesh->volume().get()));
  }
  return volumes;
}

CachedMesh::~CachedMesh() { live_bytes_->fetch_sub(prepared_.memory_bytes); }

MeshCache::MeshCache(Executor& executor, Options options)
    : executor_(executor), options_(std::move(options)), live_bytes_(std::make_shared<std::atomic<std::uint64_t>>(0)) {}

MeshPtr MeshCache::find(const std::string& id) {
  std::vector<MeshPtr> dropped;
  std::lock_guard lock(mutex_);
  sweep_locked(dropped);
  const auto entry = entries_.find(id);
  ++(entry == entries_.end() ? counts_.misses : counts_.hits);
  if (entry == entries_.end()) return nullptr;
  touch_locked(entry->second);
  return entry->second.mesh;
}

MeshCache::Ticket MeshCache::get_or_prepare(const std::string& id, Prepare prepare, Done done,
                                            const std::string& client) {
  Ticket ticket;
  MeshPtr mesh;
  std::shared_ptr<Preparation> awaited;
  std::optional<Executor::Lane> lane;  // New for it.
  {
    std::lock_guard lock(mutex_);
    if (const auto entry = entries_.find(id); entry != entries_.end()) {
      touch_locked(entry->second);
      mesh = entry->second.mesh;
    } else {
      std::shared_ptr<Preparation>& preparation = preparations_[id];
      if (!preparation) {
        preparation = std::make_shared<Preparation>();
        preparation->prepare = std::move(prepare);
        preparation->client = client;
      }
      awaited = preparation;
      if (!awaited->lanes.contains(client)) {
        const Executor::Lane own = executor_.make_lane(client, Pieces::kLong);
        awaited->lanes.emplace(client, own);
        if (!awaited->runs) lane = own;  // Else it may come to it if it has to begin anew.
      }
      ticket = Ticket(*this, id, next_waiter_++);
      preparation->waiters.emplace(ticket.waiter_, std::move(done));
    }
  }
  if (mesh) done({.mesh = std::move(mesh), .error = nullptr, .already_cached = true});
  if (lane) lane->post([this, id, awaited] { run(id, awaited); });
  return ticket;
}

void MeshCache::run(const std::string& id, const std::shared_ptr<Preparation>& preparation) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(preparation->runs, true)) return;
  }
  Outcome outcome;
  try {
    outcome.mesh = insert(id, prepare(*preparation), preparation->client);
  } catch (const PreparationMemory::Lack& lack) {
    return wait_for_memory(id, preparation, lack);
  } catch (...) {
    outcome.error = std::current_exception();
  }
  std::map<std::uint64_t, Done> waiters;
  {
    std::lock_guard lock(mutex_);
    ++(outcome.error ? counts_.failed_preparations : counts_.prepared);
    waiters.swap(preparation->waiters);
    const auto own = preparations_.find(id);  // Another one, if everybody had left this one.
    if (own != preparations_.end() && own->second == preparation) preparations_.erase(own);
  }
  for (auto& [waiter, done] : waiters) done(outcome);
}

PreparedMesh MeshCache::prepare(Preparation& preparation) {
  Prepare prepare;
  {
    std::lock_guard lock(mutex_);
    prepare = std::move(preparation.prepare);
  }
  preparation.cancel.throw_if_cancelled();
  try {
    return prepare(preparation.cancel, *preparation.progress);
  } catch (const PreparationMemory::Lack&) {
    const std::lock_guard lock(mutex_);
    preparation.progress = std::make_unique<PreparationProgress>();
    if (!preparation.waiters.empty()) preparation.prepare = std::move(prepare);
    preparation.runs = false;
    throw;
  }
}

/// Once nobody waits for the preparation any more it is gone, and with it the share.
void MeshCache::wait_for_memory(const std::string& id, const std::shared_ptr<Preparation>& preparation,
                                const PreparationMemory::Lack& lack) {
  lack.share->wait(lack.bytes, [this, id, weak = std::weak_ptr(preparation)] {
    const std::shared_ptr<Preparation> awaited = weak.lock();
    if (awaited) run_again(id, awaited);
  });
}

/// As what comes next of whoever's turn it is first.
void MeshCache::run_again(const std::string& id, const std::shared_ptr<Preparation>& preparation) {
  std::vector<Executor::Lane> lanes;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [client, lane] : preparation->lanes) lanes.push_back(lane);
  }
  for (const Executor::Lane& lane : lanes) lane.post_front([this, id, preparation] { run(id, preparation); });
}

/// Large solids are freed after the lock has been let go of.
MeshPtr MeshCache::insert(const std::string& id, PreparedMesh prepared, const std::string& client) {
  std::vector<MeshPtr> dropped;
  std::uint64_t dropped_bytes = 0;
  MeshPtr mesh;
  std::exception_ptr error;
  {
    std::lock_guard lock(mutex_);
    try {
      mesh = insert_locked(id, prepared, client, dropped);
    } catch (...) {
      error = std::current_exception();
    }
    for (const MeshPtr& gone : dropped) dropped_bytes += gone->prepared().memory_bytes;
    leaving_bytes_ += dropped_bytes;
  }
  dropped.clear();
  {
    std::lock_guard lock(mutex_);
    leaving_bytes_ -= dropped_bytes;
  }
  if (error) std::rethrow_exception(error);
  return mesh;
}

MeshPtr MeshCache::insert_locked(const std::string& id, PreparedMesh& prepared, const std::string& client,
                                 std::vector<MeshPtr>& dropped) {
  if (const auto entry = entries_.find(id); entry != entries_.end()) {
    touch_locked(entry->second);  // Another preparation, begun after this one was cancelled, was faster.
    return entry->second.mesh;
  }
  if (const std::uint64_t missing = make_room_locked(prepared.memory_bytes, dropped); missing > 0) {
    refused_ = RefusedMesh{client, prepared.memory_bytes, missing};
    throw ServiceError(
        ServiceErrorCode::kCacheFull,
        "all meshes in the cache are in use: try again soon, when calls of silent clients have been ended");
  }
  const Clock::time_point now = options_.now();
  auto mesh = std::make_shared<const CachedMesh>(id, std::move(prepared), now, live_bytes_);
  recency_.push_back(id);
  entries_.emplace(id, Entry{mesh, now, std::prev(recency_.end())});
  return mesh;
}

std::uint64_t MeshCache::make_room_locked(std::uint64_t bytes, std::vector<MeshPtr>& dropped) {
  if (bytes > options_.capacity_bytes) {
    throw ServiceError(ServiceErrorCode::kMeshExceedsCache,
                       "the prepared mesh or volume takes " + std::to_string(bytes) + " bytes, the whole cache has " +
                           std::to_string(options_.capacity_bytes) + ": use a server with more memory");
  }
  // Nobody can get hold of a mesh that nobody uses while the cache is locked.
  const auto unused = [](const Entry& entry) { return entry.mesh.use_count() == 1; };
  std::uint64_t freed = leaving_bytes_;
  const auto has_room = [&] { return live_bytes_->load() + bytes <= options_.capacity_bytes + freed; };
  std::uint64_t droppable = 0;
  for (const auto& [id, entry] : entries_) droppable += unused(entry) ? entry.mesh->prepared().memory_bytes : 0;
  const std::uint64_t wanted = live_bytes_->load() + bytes, at_most = options_.capacity_bytes + freed + droppable;
  if (wanted > at_most) return wanted - at_most;
  for (auto id = recency_.begin(); id != recency_.end() && !has_room();) {
    const auto entry = entries_.find(*id++);
    if (!unused(entry->second)) continue;
    freed += entry->second.mesh->prepared().memory_bytes;
    dropped.push_back(entry->second.mesh);
    drop_locked(entry);
    ++counts_.evictions;
  }
  return 0;
}

std::optional<RefusedMesh> MeshCache::take_refused() {
  const std::lock_guard lock(mutex_);
  return std::exchange(refused_, std::nullopt);
}

std::optional<PreparationProgress::State> MeshCache::preparation(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto running = preparations_.find(id);
  if (running == preparations_.end()) return std::nullopt;
  return running->second->progress->state();
}

bool MeshCache::erase(const std::string& id) {
  std::vector<MeshPtr> dropped;
  std::lock_guard lock(mutex_);
  sweep_locked(dropped);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return false;
  dropped.push_back(entry->second.mesh);
  drop_locked(entry);
  return true;
}

std::vector<ListedMesh> MeshCache::list(const std::string& after, std::size_t limit) {
  std::vector<MeshPtr> dropped;
  std::vector<ListedMesh> meshes;
  std::lock_guard lock(mutex_);
  sweep_locked(dropped);
  for (auto entry = entries_.upper_bound(after); entry != entries_.end() && meshes.size() < limit; ++entry) {
    meshes.push_back(listed_locked(entry->second));
  }
  return meshes;
}

std::optional<ListedMesh> MeshCache::peek(const std::string& id) {
  std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return std::nullopt;
  return listed_locked(entry->second);
}

CacheUse MeshCache::use() {
  std::vector<MeshPtr> dropped;
  std::lock_guard lock(mutex_);
  sweep_locked(dropped);
  const std::uint64_t live = live_bytes_->load();
  CacheUse use = counts_;
  use.capacity_bytes = options_.capacity_bytes;
  use.used_bytes = live - std::min(live, leaving_bytes_);
  use.meshes = entries_.size();
  return use;
}

void MeshCache::sweep() {
  std::vector<MeshPtr> dropped;
  std::lock_guard lock(mutex_);
  sweep_locked(dropped);
}

/// What it drops is handed out, so that a large solid is freed after the caller has let go of the lock.
void MeshCache::sweep_locked(std::vector<MeshPtr>& dropped) {
  if (options_.time_to_live.count() == 0) return;
  const Clock::time_point now = options_.now();
  for (auto id = recency_.begin(); id != recency_.end();) {
    const auto entry = entries_.find(*id++);
    if (entry->second.last_use + options_.time_to_live > now) break;
    if (entry->second.mesh.use_count() > 1) continue;
    dropped.push_back(entry->second.mesh);
    drop_locked(entry);
    ++counts_.evictions;
  }
}

void MeshCache::touch_locked(Entry& entry) {
  entry.last_use = options_.now();
  recency_.splice(recency_.end(), recency_, entry.recency);
}

void MeshCache::drop_locked(std::map<std::string, Entry>::iterator entry) {
  recency_.erase(entry->second.recency);
  entries_.erase(entry);
}

ListedMesh MeshCache::listed_locked(const Entry& entry) const {
  ListedMesh listed{.mesh = entry.mesh, .last_use = entry.last_use, .expires = std::nullopt};
  if (options_.time_to_live.count() != 0) listed.expires = entry.last_use + options_.time_to_live;
  return listed;
}

void MeshCache::cancel(const std::string& id, std::uint64_t waiter) {
  Done done;
  Prepare dropped;  // Freed without the lock.
  {
    std::lock_guard lock(mutex_);
    const auto preparation = preparations_.find(id);
    if (preparation == preparations_.end()) return;
    auto& waiters = preparation->second->waiters;
    const auto own = waiters.find(waiter);
    if (own == waiters.end()) return;
    done = std::move(own->second);
    waiters.erase(own);
    if (waiters.empty()) {
      preparation->second->cancel.cancel();
      dropped = std::move(preparation->second->prepare);
      preparations_.erase(preparation);  // Whoever asks from now on starts afresh.
    }
  }
  done({.mesh = nullptr,
        .error = std::make_exception_ptr(Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline")),
        .already_cached = false});
}

void MeshCache::Ticket::cancel() {
  if (cache_ != nullptr) cache_->cancel(id_, waiter_);
}

}  // namespace ccslice::server
