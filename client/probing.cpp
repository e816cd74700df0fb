// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One thread writes batches of points, another one reads their answers: a server that waits until an answer is read
// doesn't read points meanwhile. What has no answer yet is kept, and goes to the next server where a stream breaks.

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client.h"
#include "client/client_error.h"

namespace ccslice::client {
namespace {

/// With 64 channels an answer of so many points stays below the usual message limit of 4 MiB.
constexpr std::size_t kProbeBatchPoints = 4096;
/// Enough to keep a server's threads busy.
constexpr std::size_t kMostUnanswered = 8;

void check_answer(const v1::ProbePointsResponse& answer, int points) {
  const bool fits = answer.locations_size() == points && answer.limit_cells_size() == points &&
                    answer.control_cells_size() == points && answer.residuals_mm_size() == points &&
                    answer.uvw_size() == 3 * points && answer.channel_values_size() % points == 0;
  require_answer(fits, "it doesn't fit the points asked for");
}

class Probing {
 public:
  using Stream = grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>;

  Probing(const v1::ProbePointsRequest& setting, const PointSource& next, const PointAnswers& take)
      : setting_(setting), next_(next), take_(take) {}

  /// Everything that hasn't been answered yet.
  void run(const Endpoint& at, const CallOptions& options, Attempts& attempts) {
    Call call(options, at, setting_.mesh_id());
    const auto stream = at.stub->ProbePoints(&call.context());
    sent_ = 0;
    over_ = false;
    std::thread writer([&] { write(*stream); });
    std::exception_ptr failed;
    try {
      read(*stream, attempts);
    } catch (...) {
      failed = std::current_exception();
      call.context().TryCancel();
    }
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    writer.join();
    const grpc::Status status = stream->Finish();
    if (failed) std::rethrow_exception(failed);
    call.check(status);
    require_answer(unanswered_.empty(), "the server left points unanswered");
    if (no_source_) std::rethrow_exception(no_source_);
  }

 private:
  void write(Stream& stream) {
    v1::ProbePointsRequest batch = setting_;
    while (next_batch(batch)) {
      if (!stream.Write(batch)) return;  // The stream is over, and its status says why.
      batch.clear_placement();
      batch.clear_fields();
    }
    stream.WritesDone();
  }

  /// Waits until another batch may be sent. False if none is to be.
  bool next_batch(v1::ProbePointsRequest& batch) {
    std::unique_lock lock(mutex_);
    if (sent_ == unanswered_.size() && !exhausted_) {
      changed_.wait(lock, [&] { return over_ || unanswered_.size() < kMostUnanswered; });
      if (over_) return false;
      lock.unlock();
      take_from_source();
      lock.lock();
    }
    if (over_ || sent_ == unanswered_.size()) return false;
    const std::vector<double>& points = unanswered_[sent_++];
    batch.mutable_points_mm()->Assign(points.begin(), points.end());
    return true;
  }

  void take_from_source() {
    std::vector<double> points;
    std::exception_ptr failed;
    try {
      points = next_(kProbeBatchPoints);
    } catch (...) {
      failed = std::current_exception();  // What came before is still answered.
    }
    const std::lock_guard lock(mutex_);
    no_source_ = failed;
    exhausted_ = points.empty();
    if (!exhausted_) unanswered_.push_back(std::move(points));
  }

  void read(Stream& stream, Attempts& attempts) {
    v1::ProbePointsResponse answer;
    while (stream.Read(&answer)) {
      const std::vector<double>* points = nullptr;
      {
        const std::lock_guard lock(mutex_);
        require_answer(sent_ > 0, "an answer to nothing");
        points = &unanswered_.front();  // It stays where it is while others are put behind it.
      }
      check_answer(answer, static_cast<int>(points->size() / 3));
      take_(*points, answer);
      attempts.progress();
      {
        const std::lock_guard lock(mutex_);
        unanswered_.pop_front();
        --sent_;
      }
      changed_.notify_all();
    }
  }

  const v1::ProbePointsRequest& setting_;
  const PointSource& next_;
  const PointAnswers& take_;
  std::mutex mutex_;  // Guards what follows.
  std::condition_variable changed_;
  std::deque<std::vector<double>> unanswered_;
  std::size_t sent_ = 0;  // Of them, on this stream.
  bool exhausted_ = false, over_ = false;
  std::exception_ptr no_source_;
};

}  // namespace

void Client::probe(const v1::ProbePointsRequest& setting, const PointSource& next, const PointAnswers& take,
                   const CallOptions& call) {
  Probing probing(setting, next, take);
  std::vector<std::string> ids = volume_ids_of(setting.fields());
  ids.insert(ids.begin(), setting.mesh_id());
  Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, std::move(ids));
  int reuploads = 0;
  with_retries(call, attempts, reuploads, [&](const Endpoint& at) { probing.run(at, call, attempts); });
}

std::vector<v1::ProbePointsResponse> Client::probe(const std::string& mesh_id, const v1::Placement& placement,
                                                   const std::vector<double>& points_mm, const CallOptions& call) {
  std::vector<v1::ProbePointsResponse> answers;
  auto at = points_mm.begin();
  const auto next = [&](std::size_t most_points) {
    const auto begin = at;
    at += std::min(points_mm.end() - begin, static_cast<std::ptrdiff_t>(3 * most_points));
    return std::vector<double>(begin, at);
  };
  const auto take = [&](std::span<const double>, const v1::ProbePointsResponse& answer) { answers.push_back(answer); };
  v1::ProbePointsRequest setting;
  setting.set_mesh_id(mesh_id);
  *setting.mutable_placement() = placement;
  probe(setting, next, take, call);
  return answers;
}

}  // namespace ccslice::client
