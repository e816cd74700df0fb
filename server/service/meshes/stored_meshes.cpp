// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/stored_meshes.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <future>
#include <utility>

#include "server/service/base/service_error.h"

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
  const auto request = std::make_shared<Request>(
      Request{.operation = StoreOperation::kRead,
              .work = [this, mesh_id](const MeshStore::Progress& progress) -> std::function<void()> {
                std::shared_ptr<Upload> upload;
                std::exception_ptr error;
                try {
                  upload = read(mesh_id, progress);
                } catch (const ServiceError&) {
                  error = std::current_exception();  // No fault of the store's.
                }
                return [this, mesh_id, upload, error] { tell_readers(mesh_id, upload, error); };
              },
              .give_up = [this, mesh_id] { tell_readers(mesh_id, nullptr, nullptr); }});
  {
    const std::lock_guard lock(mutex_);
    Reading& reading = readings_[mesh_id];
    reading.readers.push_back(std::move(done));
    if (reading.request) return join_locked(reading.request, client, /*is_next=*/false);
    reading.request = request;
    if (post_locked(request, client)) return;
  }
  refuse(request);
}

void StoredMeshes::tell_readers(const std::string& mesh_id, const std::shared_ptr<Upload>& upload,
                                const std::exception_ptr& error) {
  Reading reading;
  {
    const std::lock_guard lock(mutex_);
    std::swap(reading, readings_[mesh_id]);
    readings_.erase(mesh_id);
  }
  for (const Loaded& done : reading.readers) done(upload, error);
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
  const auto write = [this, upload = std::move(upload),
                      done](const MeshStore::Progress& progress) -> std::function<void()> {
    store_->write(upload->mesh_id(), upload->bytes().blocks(), progress);
    note(StoreOperation::kWrite, StoreOutcome::kFound);
    return [done] { done(true); };
  };
  post(std::make_shared<Request>(
           Request{.operation = StoreOperation::kWrite, .work = write, .give_up = [done] { done(std::nullopt); }}),
       client);
}

/// What is asked, and what is known of it.
struct StoredMeshes::Looking {
  std::vector<std::string> mesh_ids;
  Held done;
  std::vector<bool> held{};
  Clock::duration took{};
};

void StoredMeshes::find(std::vector<std::string> mesh_ids, const std::string& client, Held done) {
  const auto looking = std::make_shared<Looking>(Looking{.mesh_ids = std::move(mesh_ids), .done = std::move(done)});
  post(std::make_shared<Request>(
           Request{.operation = StoreOperation::kLook,
                   .work = [this, looking](const MeshStore::Progress& progress) { return look(*looking, progress); },
                   .give_up = [looking] { looking->done({}); }}),
       client);
}

/// A store that is so slow that there is no time for a mesh holds little.
std::function<void()> StoredMeshes::look(Looking& looking, const MeshStore::Progress& progress) {
  std::vector<bool>& held = looking.held;
  while (held.size() < looking.mesh_ids.size()) {
    const auto begin = Clock::now();
    held.push_back(looking.took < options_.patience && store_->contains(looking.mesh_ids[held.size()]));
    note(StoreOperation::kLook, held.back() ? StoreOutcome::kFound : StoreOutcome::kMissing);
    progress();
    looking.took += Clock::now() - begin;
    if (held.size() < looking.mesh_ids.size() && others_wait()) return {};
  }
  return [done = looking.done, held] { done(held); };
}

void StoredMeshes::erase(const std::string& mesh_id, const std::string& client, Done done) {
  {
    const std::lock_guard lock(mutex_);
    marked_.erase(mesh_id);
  }
  const auto erase = [this, mesh_id, done](const MeshStore::Progress&) -> std::function<void()> {
    const bool was_there = store_->erase(mesh_id);
    note(StoreOperation::kErase, was_there ? StoreOutcome::kFound : StoreOutcome::kMissing);
    return [done, was_there] { done(was_there); };
  };
  post(std::make_shared<Request>(
           Request{.operation = StoreOperation::kErase, .work = erase, .give_up = [done] { done(std::nullopt); }}),
       client);
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
  const auto look = [this, count, promise](const MeshStore::Progress& progress) -> std::function<void()> {
    return [promise, ids = store_->last_used(count, progress)] { promise->set_value(ids); };
  };
  post(std::make_shared<Request>(
           Request{.operation = StoreOperation::kLook, .work = look, .give_up = [promise] { promise->set_value({}); }}),
       kServer);
  return promise->get_future().get();
}

void StoredMeshes::post(const RequestPtr& request, const std::string& client) {
  {
    const std::lock_guard lock(mutex_);
    if (post_locked(request, client)) return;
  }
  refuse(request);
}

bool StoredMeshes::post_locked(const RequestPtr& request, const std::string& client) {
  if (Clock::now() < rests_until_ || over_ || !has_room_locked(client)) return false;
  wait_locked(request, client, /*is_next=*/false);
  changed_.notify_all();
  return true;
}

void StoredMeshes::refuse(const RequestPtr& request) {
  note(request->operation, StoreOutcome::kFailed);
  request->give_up();
}

bool StoredMeshes::has_room_locked(const std::string& client) const {
  if (queue_.size() < kMostRequests / 4 * 3) return true;
  const auto own = clients_.find(client);
  return queue_.size() < kMostRequests && (own == clients_.end() || own->second.waiting.size() < kMostRequests / 4 * 3);
}

/// `is_next`: of those of its client.
void StoredMeshes::wait_locked(const RequestPtr& request, const std::string& client, bool is_next) {
  request->posted = Clock::now();
  request->waits = true;
  request->position = queue_.insert(queue_.end(), request);
  join_locked(request, client, is_next);
}

/// Has a request come in the client's turn, too, if it still waits.
void StoredMeshes::join_locked(const RequestPtr& request, const std::string& client, bool is_next) {
  if (!request->waits || request->places.contains(client)) return;
  Client& own = clients_[client];
  if (own.waiting.empty()) in_turn_.emplace(own.last_turn, client);
  request->places[client] = own.waiting.insert(is_next ? own.waiting.begin() : own.waiting.end(), request);
}

void StoredMeshes::take_out_locked(const RequestPtr& request) {
  for (const auto& [client, place] : request->places) {
    Client& own = clients_[client];
    own.waiting.erase(place);
    if (own.waiting.empty()) in_turn_.erase({own.last_turn, client});
  }
  request->places.clear();
  request->waits = false;
  queue_.erase(request->position);
}

/// That of the client whose last turn was longest ago. REQUIRES: there is one.
StoredMeshes::RequestPtr StoredMeshes::take_next_locked() {
  constexpr std::size_t kManyIdle = 1000;
  const std::string client = in_turn_.begin()->second;
  Client& own = clients_[client];
  const RequestPtr request = own.waiting.front();
  take_out_locked(request);
  request->client = client;
  const bool waits_on = !own.waiting.empty();
  if (waits_on) in_turn_.erase({own.last_turn, client});
  own.last_turn = ++turns_;
  if (waits_on) in_turn_.emplace(own.last_turn, client);
  if (clients_.size() > in_turn_.size() + kManyIdle) {
    std::erase_if(clients_, [](const auto& each) { return each.second.waiting.empty(); });
  }
  return request;
}

/// Others than the client of the request that is being served.
bool StoredMeshes::others_wait() {
  const std::lock_guard lock(mutex_);
  return in_turn_.size() > 1 || (in_turn_.size() == 1 && in_turn_.begin()->second != current_->client);
}

void StoredMeshes::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    wait_for_request(lock);
    if (over_) return;
    current_ = take_next_locked();
    progress_ = asked_ = Clock::now();
    const RequestPtr request = current_;
    changed_.notify_all();
    lock.unlock();
    run(request);
    lock.lock();
    current_ = nullptr;
    if (!request->answered) wait_locked(request, request->client, /*is_next=*/true);  // It gave way.
  }
}

void StoredMeshes::wait_for_request(std::unique_lock<std::mutex>& lock) {
  const auto is_due = [this] { return over_ || !queue_.empty(); };
  if (options_.check_every.count() == 0) return changed_.wait(lock, is_due);
  while (!is_due()) {
    const auto check_at = std::max(asked_ + options_.check_every, rests_until_);
    if (Clock::now() >= check_at) {
      wait_locked(make_check(), kServer, /*is_next=*/false);
    } else {
      changed_.wait_until(lock, check_at);
    }
  }
}

StoredMeshes::RequestPtr StoredMeshes::make_check() {
  return std::make_shared<Request>(Request{.operation = StoreOperation::kCheck,
                                           .work = [this](const MeshStore::Progress&) -> std::function<void()> {
                                             store_->check();
                                             note(StoreOperation::kCheck, StoreOutcome::kFound);
                                             return [] {};
                                           },
                                           .give_up = [] {}});
}

/// What checks find is told once: they go on for as long as the store is gone.
void StoredMeshes::note_whether_it_is_there(StoreOperation operation, bool is_there, const std::string& why) {
  const bool was_there = is_there_.exchange(is_there);
  if (is_there && !was_there) spdlog::info("the mesh store answers");
  if (!why.empty() && (was_there || operation != StoreOperation::kCheck)) spdlog::warn("{}", why);
}

void StoredMeshes::run(const RequestPtr& request) {
  std::function<void()> tell = request->give_up;
  std::string why;
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
    why = error.what();
  }
  // A store that refuses one thing may take another; where it refuses even to be checked, it takes nothing.
  const bool counts = !refused || request->operation == StoreOperation::kCheck;
  note_whether_it_is_there(request->operation, counts ? why.empty() : is_there(), why);
  {
    const std::lock_guard lock(mutex_);
    if (!tell && !request->answered) return;
    if (failed) {
      given_up = count_failure_locked(request->operation, hangs);
    } else if (!request->answered) {
      failures_ = 0;
    }
    is_late = std::exchange(request->answered, true);
  }
  give_up(given_up);
  if (!is_late) tell();
}

/// One failure is enough where it cost time: the next call would wait as long.
std::vector<StoredMeshes::RequestPtr> StoredMeshes::count_failure_locked(StoreOperation operation, bool hangs) {
  if (++failures_ < kMostFailures && !hangs) return {};
  if (operation != StoreOperation::kCheck) {
    spdlog::warn("the mesh store fails: it is left alone for {} ms", options_.rest.count());
  }
  return rest_locked(Clock::now());
}

std::vector<StoredMeshes::RequestPtr> StoredMeshes::rest_locked(Clock::time_point now) {
  failures_ = 0;
  rests_until_ = now + options_.rest;
  const std::vector<RequestPtr> waiting(queue_.begin(), queue_.end());
  for (const RequestPtr& request : waiting) take_out_locked(request);
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
      is_there_ = false;
      spdlog::warn("the mesh store has made no progress for {} ms", options_.patience.count());
      current_->answered = true;
      overdue.push_back(current_);
    }
    progress_ = now;  // Looked at again after as long.
  }
  while (!queue_.empty() && now - queue_.front()->posted >= options_.patience) {
    overdue.push_back(queue_.front());
    take_out_locked(overdue.back());
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
