// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/stored_meshes.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <future>
#include <utility>

#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

constexpr std::size_t kMostRequests = 4096;
constexpr std::size_t kMostMarks = 100'000;
constexpr const char* kServer = "";  // Asks by itself, for no client.

}  // namespace

StoredMeshes::StoredMeshes(std::unique_ptr<MeshStore> store, MemoryBudget& budget, Options options)
    : store_(std::move(store)), budget_(budget), options_(options) {
  server_ = std::thread([this] { serve(); });
  clock_ = std::thread([this] { watch(); });
}

StoredMeshes::~StoredMeshes() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  server_.join();
  clock_.join();
  for (const RequestPtr& request : queue_) request->give_up();
}

void StoredMeshes::load(const std::string& mesh_id, const std::string& client, Loaded done) {
  {
    const std::lock_guard lock(mutex_);
    std::vector<Loaded>& readers = readers_[mesh_id];
    readers.push_back(std::move(done));
    if (readers.size() > 1) return;
  }
  post(
      StoreOperation::kRead, client,
      [this, mesh_id](const MeshStore::Progress& progress) -> std::function<void()> {
        std::shared_ptr<Upload> upload;
        std::exception_ptr error;
        try {
          upload = read(mesh_id, progress);
        } catch (const ServiceError&) {
          error = std::current_exception();  // No fault of the store's.
        }
        return [this, mesh_id, upload, error] { tell_readers(mesh_id, upload, error); };
      },
      [this, mesh_id] { tell_readers(mesh_id, nullptr, nullptr); });
}

void StoredMeshes::tell_readers(const std::string& mesh_id, const std::shared_ptr<Upload>& upload,
                                const std::exception_ptr& error) {
  std::vector<Loaded> readers;
  {
    const std::lock_guard lock(mutex_);
    readers.swap(readers_[mesh_id]);
    readers_.erase(mesh_id);
  }
  for (const Loaded& done : readers) done(upload, error);
}

/// Bytes that aren't the mesh's are worse than none: the next upload brings the right ones. A mesh that is too large
/// for this server may be right for others.
std::shared_ptr<Upload> StoredMeshes::read(const std::string& mesh_id, const MeshStore::Progress& progress) {
  auto upload = std::make_shared<Upload>(budget_, options_.max_mesh_bytes);
  std::uint64_t bytes = 0;
  try {
    const bool found = store_->read(mesh_id, {.begin =
                                                  [&](std::uint64_t size) {
                                                    bytes = size;
                                                    upload->start(mesh_id, size);
                                                  },
                                              .append =
                                                  [&](std::string_view piece) {
                                                    upload->append(piece);
                                                    progress();
                                                  }});
    if (found) upload->finish();
    note(StoreOperation::kRead, found ? StoreOutcome::kFound : StoreOutcome::kMissing);
    return found ? upload : nullptr;
  } catch (const ServiceError& error) {
    if (error.code() == ServiceErrorCode::kServerBusy) throw;
    if (bytes > options_.max_mesh_bytes) {
      note(StoreOperation::kRead, StoreOutcome::kMissing);
      spdlog::warn("the mesh store's {} has {} bytes, more than --max-mesh-bytes", mesh_id, bytes);
      return nullptr;
    }
    note(StoreOperation::kRead, StoreOutcome::kDamaged);
    spdlog::warn("the mesh store's bytes of {} are damaged, and dropped: {}", mesh_id, error.what());
    (void)store_->erase(mesh_id);
    return nullptr;
  }
}

void StoredMeshes::keep(std::shared_ptr<Upload> upload, const std::string& client, Done done) {
  const std::string mesh_id = upload->mesh_id();
  post(
      StoreOperation::kWrite, client,
      [this, upload = std::move(upload), done](const MeshStore::Progress& progress) -> std::function<void()> {
        store_->write(upload->mesh_id(), upload->bytes().blocks(), progress);
        note(StoreOperation::kWrite, StoreOutcome::kFound);
        return [done] { done(true); };
      },
      [done] { done(std::nullopt); });
}

void StoredMeshes::find(std::vector<std::string> mesh_ids, const std::string& client, Held done) {
  post(
      StoreOperation::kLook, client,
      [this, mesh_ids = std::move(mesh_ids), done](const MeshStore::Progress& progress) -> std::function<void()> {
        std::vector<bool> held;
        const auto end = Clock::now() + options_.patience;
        for (const std::string& mesh_id : mesh_ids) {
          held.push_back(Clock::now() < end && store_->contains(mesh_id));  // A store this slow holds little.
          note(StoreOperation::kLook, held.back() ? StoreOutcome::kFound : StoreOutcome::kMissing);
          progress();
        }
        return [done, held] { done(held); };
      },
      [done] { done({}); });
}

void StoredMeshes::erase(const std::string& mesh_id, const std::string& client, Done done) {
  {
    const std::lock_guard lock(mutex_);
    marked_.erase(mesh_id);
  }
  post(
      StoreOperation::kErase, client,
      [this, mesh_id, done](const MeshStore::Progress&) -> std::function<void()> {
        const bool was_there = store_->erase(mesh_id);
        note(StoreOperation::kErase, was_there ? StoreOutcome::kFound : StoreOutcome::kMissing);
        return [done, was_there] { done(was_there); };
      },
      [done] { done(std::nullopt); });
}

void StoredMeshes::mark_used(const std::string& mesh_id) {
  const auto now = Clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (marked_.size() > kMostMarks) marked_.clear();
    const auto [mark, is_new] = marked_.try_emplace(mesh_id, now);
    if (!is_new && now - mark->second < options_.mark_every) return;
    mark->second = now;
  }
  find({mesh_id}, kServer, [](const std::vector<bool>&) {});
}

std::vector<std::string> StoredMeshes::last_used(std::size_t count) {
  const auto promise = std::make_shared<std::promise<std::vector<std::string>>>();
  post(
      StoreOperation::kLook, kServer,
      [this, count, promise](const MeshStore::Progress& progress) -> std::function<void()> {
        return [promise, ids = store_->last_used(count, progress)] { promise->set_value(ids); };
      },
      [promise] { promise->set_value({}); });
  return promise->get_future().get();
}

void StoredMeshes::post(StoreOperation operation, const std::string& client, Work work, std::function<void()> instead) {
  {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (now >= rests_until_ && !over_ && has_room_locked(client)) {
      queue_.push_back(std::make_shared<Request>(Request{operation, client, std::move(work), std::move(instead), now}));
      changed_.notify_all();
      return;
    }
  }
  note(operation, StoreOutcome::kFailed);
  instead();
}

bool StoredMeshes::has_room_locked(const std::string& client) const {
  if (queue_.size() < kMostRequests / 4 * 3) return true;
  const auto own = std::ranges::count(queue_, client,
                                      [](const RequestPtr& request) -> const std::string& { return request->client; });
  return queue_.size() < kMostRequests && static_cast<std::size_t>(own) < kMostRequests / 4 * 3;
}

/// That of the client whose last turn was longest ago. REQUIRES: there is one.
StoredMeshes::RequestPtr StoredMeshes::take_next_locked() {
  constexpr std::size_t kManyClients = 1000;
  if (last_of_.size() > kManyClients) last_of_.clear();
  const auto next = std::ranges::min_element(queue_, {}, [this](const RequestPtr& request) {
    const auto last = last_of_.find(request->client);
    return last == last_of_.end() ? 0 : last->second;
  });
  RequestPtr request = std::move(*next);
  queue_.erase(next);
  last_of_[request->client] = ++turns_;
  return request;
}

void StoredMeshes::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return over_ || !queue_.empty(); });
    if (over_) return;
    current_ = take_next_locked();
    progress_ = Clock::now();
    const RequestPtr request = current_;
    changed_.notify_all();
    lock.unlock();
    run(request);
    lock.lock();
    current_ = nullptr;
  }
}

void StoredMeshes::run(const RequestPtr& request) {
  std::function<void()> tell = request->give_up;
  bool failed = false, refused = false, hangs = false, is_late = false;
  std::vector<RequestPtr> given_up;
  try {
    tell = request->work([this] {
      const std::lock_guard lock(mutex_);
      progress_ = Clock::now();
    });
  } catch (const std::exception& error) {
    const auto* store_error = dynamic_cast<const StoreError*>(&error);
    hangs = store_error != nullptr && store_error->fault() == StoreFault::kHangs;
    refused = store_error != nullptr && store_error->fault() == StoreFault::kRefuses;
    failed = !refused;
    note(request->operation, StoreOutcome::kFailed);
    spdlog::warn("{}", error.what());
  }
  {
    const std::lock_guard lock(mutex_);
    if (failed) {
      given_up = count_failure_locked(hangs);
    } else if (!request->answered) {
      failures_ = 0;
    }
    is_late = std::exchange(request->answered, true);
  }
  give_up(given_up);
  if (!is_late) tell();
}

/// One failure is enough where it cost time: the next call would wait as long.
std::vector<StoredMeshes::RequestPtr> StoredMeshes::count_failure_locked(bool hangs) {
  if (++failures_ < kMostFailures && !hangs) return {};
  spdlog::warn("the mesh store fails: it is left alone for {} ms", options_.rest.count());
  return rest_locked(Clock::now());
}

std::vector<StoredMeshes::RequestPtr> StoredMeshes::rest_locked(Clock::time_point now) {
  failures_ = 0;
  rests_until_ = now + options_.rest;
  std::vector<RequestPtr> waiting(queue_.begin(), queue_.end());
  queue_.clear();
  return waiting;
}

void StoredMeshes::give_up(const std::vector<RequestPtr>& requests) {
  for (const RequestPtr& request : requests) {
    note(request->operation, StoreOutcome::kFailed);
    request->give_up();
  }
}

StoredMeshes::Clock::time_point StoredMeshes::next_look_locked() const {
  Clock::time_point next = Clock::time_point::max();
  if (current_) next = progress_ + options_.patience;
  if (!queue_.empty()) next = std::min(next, queue_.front()->posted + options_.patience);
  return next;
}

/// Where the store makes no progress, all who wait for it. Where it works for others, those who have waited for long.
std::vector<StoredMeshes::RequestPtr> StoredMeshes::take_overdue_locked(Clock::time_point now) {
  std::vector<RequestPtr> overdue;
  if (current_ && now - progress_ >= options_.patience) {
    overdue = rest_locked(now);
    if (!current_->answered) {
      spdlog::warn("the mesh store has made no progress for {} ms", options_.patience.count());
      current_->answered = true;
      overdue.push_back(current_);
    }
    progress_ = now;  // Looked at again after as long.
  }
  while (!queue_.empty() && now - queue_.front()->posted >= options_.patience) {
    overdue.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  return overdue;
}

void StoredMeshes::watch() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (!current_ && queue_.empty()) {
      changed_.wait(lock, [this] { return over_ || current_ || !queue_.empty(); });
      continue;
    }
    changed_.wait_until(lock, next_look_locked());
    if (over_) return;
    const std::vector<RequestPtr> overdue = take_overdue_locked(Clock::now());
    if (overdue.empty()) continue;
    lock.unlock();
    give_up(overdue);
    lock.lock();
  }
}

}  // namespace ccslice::server
