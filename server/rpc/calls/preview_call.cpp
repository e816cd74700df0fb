// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reading goes on while pictures are made: a read is always under way until the client has said its last word. What
// else the call does is one of four things, guarded by its mutex:
//
//   idle        waits for a request. No place among the running calls, no thread; after a while no memory either;
//   admission   waits for a place, or for memory;
//   painting    on a worker. A newer request cancels the full picture, and waits as the only one;
//   writing     the pictures that are done are written. The next request is begun when all are.
//
// A call whose client doesn't read SHEDS when it has painted: it keeps the message that is being sent, and gives back
// its place, its memory and the rest of the pictures. They are painted again when the client reads on.
//
// Whoever takes the call from one of them to the next does what has to be done then, so Finish is called once.

#include "server/rpc/calls/calls.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/rpc/calls/call.h"
#include "server/rpc/calls/preview_painter.h"
#include "server/rpc/calls/preview_parts.h"
#include "server/rpc/calls/preview_requests.h"
#include "server/rpc/calls/preview_session.h"
#include "server/rpc/calls/side_watch.h"
#include "server/rpc/calls/unknown_fields.h"
#include "server/rpc/convert/convert_fields.h"
#include "server/rpc/convert/convert_preview.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"

namespace ccslice::server {
namespace {

using SteadyClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kKeepMemory = 10s;                    // Of an idle call.
constexpr std::size_t kParsedAtOnceBytes = 4 << 10;  // While somebody drags, requests have some 200.
constexpr std::uint64_t kUncountedBytes = 16 << 10;  // Of requests: every open call has them.

const Fields& fields_of(const v1::PreviewRequest& request) {
  return request.plane().has_layer() ? request.plane().layer().job().fields() : request.fields();
}

/// The meshes and volumes that a request names, each once: those of its layer's job, or of its plane.
std::vector<std::string> named_meshes(const v1::PreviewRequest& request) {
  std::vector<std::string> ids;
  if (!request.plane().has_layer()) {
    if (!request.mesh_id().empty()) ids.push_back(request.mesh_id());
    for (const std::string& id : volume_ids_of(request.fields())) ids.push_back(id);
    return ids;
  }
  for (const std::string& id : mesh_ids_of(request.plane().layer().job(), kLayerJobPath)) {
    if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  }
  if (request.mesh_id().empty() || request.mesh_id() == ids.front()) return ids;
  throw ServiceError(ServiceErrorCode::kRequestMalformed,
                     "mesh_id: isn't that of the layer's first part; leave it out, the job's are enough", "mesh_id");
}

class PreviewCall final : public Call<grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PreviewResponse>> {
 public:
  PreviewCall(ServiceState& state, grpc::CallbackServerContext& context)
      : Call(state, context, "Preview"), lane_(make_lane(Pieces::kInteractive)) {}

  /// From here on the call keeps itself alive until gRPC is done with it.
  void begin() {
    if (const auto refused = open_call()) return end(*refused);
    const auto self = std::static_pointer_cast<PreviewCall>(shared_from_this());
    memory_watch_ = std::make_shared<SideWatch>([] {}, while_open(self, &PreviewCall::give_memory_back));
    write_watch_ =
        std::make_shared<SideWatch>(while_open(self, &PreviewCall::stall), while_open(self, &PreviewCall::note_lag),
                                    /*keeps_message=*/true);
    state_.idle_watch.add(memory_watch_);
    state_.idle_watch.add(write_watch_);
    state_.preview_watch.add(shared_from_this());
    const std::lock_guard lock(mutex_);
    wait_idle([this] { this->StartRead(&raw_); });
  }

 private:
  enum class Doing { kIdle, kAdmission, kPainting, kWriting, kOver };

  /// `start` starts what is waited for, unless it is under way already.
  template <typename Start>
  void wait_idle(const Start& start) {
    doing_ = Doing::kIdle;
    idle_since_ = SteadyClock::now();
    memory_watch_->start([] {});
    wait_for_message(start);
  }

  /// Long before the call is ended, and at once where others wait for memory.
  void give_memory_back() {
    std::shared_ptr<PreviewPainter> painter;  // Goes without the lock.
    const std::lock_guard lock(mutex_);
    const bool keeps = !state_.admission.wants_memory() && SteadyClock::now() - idle_since_ <= kKeepMemory;
    if (doing_ == Doing::kIdle && !keeps) painter = std::move(painter_);
  }

  /// The client doesn't read. It can't be told why, see call.h.
  void stall() {
    stop();
    std::unique_lock lock(mutex_);
    if (doing_ == Doing::kOver) return;
    reset_stream(context_, stalled_status());
    finish(lock, stalled_status());
  }

  /// The client hasn't read for a while.
  void note_lag() {
    std::unique_lock lock(mutex_);
    lags_ = is_writing_;
    shed_if_lagging(lock);
  }

  /// Once there is something to shed. Ends with the lock given back if it does.
  void shed_if_lagging(std::unique_lock<std::mutex>& lock) {
    if (!lags_ || doing_ != Doing::kWriting || !work_place_) return;
    parts_.drop();
    give_back_place();
    ++state_.metrics.shed;
    const std::shared_ptr<PreviewPainter> painter = std::move(painter_);
    if (painter) painter_bytes_ = painter->reserved_bytes();
    lock.unlock();  // The painter goes without it.
  }

  /// gRPC's threads, which all calls share, parse what doesn't take them long.
  void OnReadDone(bool ok) override {
    if (!ok || raw_.Length() <= kParsedAtOnceBytes) return take_message(ok);
    lane_.post([self = std::static_pointer_cast<PreviewCall>(shared_from_this())] { self->take_message(true); });
  }

  void take_message(bool ok) {
    const auto self = shared_from_this();
    ArrivedPreview request;
    std::exception_ptr error;
    try {
      if (ok) request = parse();
    } catch (...) {
      error = std::current_exception();
    }
    std::unique_lock lock(mutex_);
    if (doing_ == Doing::kOver || stopped_) return end_if_idle(lock);
    if (!ok) {
      reads_done_ = true;
      return end_if_idle(lock);
    }
    try {
      if (error) std::rethrow_exception(error);
      requests_.accept(std::move(request));
      hold_requests();
    } catch (...) {
      failure_ = to_status(std::current_exception());
      full_cancel_.cancel();
      if (doing_ == Doing::kAdmission) return leave_admission(lock, *failure_);
      return end_if_idle(lock);
    }
    if (doing_ == Doing::kIdle) {
      if (!end_wait()) return;
      ask_for_place(lock);
    } else if (doing_ == Doing::kPainting && has_picture_) {
      full_cancel_.cancel();
    }
    if (!lock.owns_lock()) lock.lock();
    if (doing_ != Doing::kOver && !stopped_) this->StartRead(&raw_);
  }

  /// Where reading has ended, and nothing else is under way, the call ends.
  void end_if_idle(std::unique_lock<std::mutex>& lock) {
    if (doing_ != Doing::kIdle || !end_wait()) return;
    finish(lock, stopped_ || cancel_.cancelled() ? status_of_stop() : failure_.value_or(grpc::Status::OK));
  }

  ArrivedPreview parse() {
    ArrivedPreview request{.message = {}, .arrived = SteadyClock::now()};
    parse_request(raw_, request.message);
    raw_.Clear();  // It counts among the bytes that gRPC may hold of all clients.
    require_known_fields(request.message);
    request.mesh_ids = named_meshes(request.message);
    return request;
  }

  void hold_requests() { hold_request_bytes(requests_.bytes() - std::min(requests_.bytes(), kUncountedBytes)); }

  std::int64_t silent_since() const override {
    const std::int64_t idle = waits_since();
    return idle > 0 ? idle : write_watch_->waits_since();
  }
  bool end_silence_begun_before(SteadyClock::time_point time) override {
    return end_wait_begun_before(time) || write_watch_->end_wait_begun_before(time);
  }

  /// Most of the time a preview does nothing.
  bool is_limited() const override { return false; }

  /// `ask` asks for what is waited for, a place to begin with, with what decided() follows.
  template <typename Ask>
  void wait_for_admission(std::unique_lock<std::mutex>& lock, Awaited awaited, const Ask& ask) {
    doing_ = Doing::kAdmission;
    if (!work_place_) work_place_.emplace(state_.admission, client_);
    lock.unlock();
    ask(noting(awaited, [self = std::static_pointer_cast<PreviewCall>(shared_from_this())](
                            const std::exception_ptr& refusal) { self->decided(refusal); }));
    lock.lock();
    if (stopped_) leave_admission(lock, status_of_stop());  // Stopped before there was anything to leave.
  }
  void ask_for_place(std::unique_lock<std::mutex>& lock) {
    wait_for_admission(lock, Awaited::kPlace,
                       [this](Admission::Decision then) { state_.admission.request(*work_place_, std::move(then)); });
  }
  /// For a picture that is to be painted again. Meanwhile the call holds nothing that others could wait for. `resumes`:
  /// it has given its place back.
  void ask_for_memory(std::unique_lock<std::mutex>& lock, std::uint64_t bytes, bool resumes) {
    again_ = true;
    std::shared_ptr<PreviewPainter> without = std::exchange(painter_, new_painter());
    wait_for_admission(lock, Awaited::kMemory,
                       [this, bytes, resumes, &without, painter = painter_](Admission::Decision then) {
                         without = nullptr;
                         Admission::Memory memory{.reserve = [painter, bytes] { return painter->reserve(bytes); },
                                                  .is_short = painter->is_short(bytes)};
                         if (resumes) return state_.admission.resume(*work_place_, std::move(memory), std::move(then));
                         state_.admission.request_memory(*work_place_, std::move(memory), std::move(then));
                       });
  }

  /// Ends the call where it waits for a place or memory.
  void leave_admission(std::unique_lock<std::mutex>& lock, const grpc::Status& status) {
    if (doing_ != Doing::kAdmission) return;
    if (state_.admission.leave_queue(*work_place_) || state_.admission.leave_memory_queue(*work_place_)) {
      finish(lock, status);
    }
  }

  void decided(const std::exception_ptr& refusal) {
    std::unique_lock lock(mutex_);
    if (refusal) return finish(lock, to_status(refusal));
    start_painting();
  }

  void start_painting() {
    doing_ = Doing::kPainting;
    has_picture_ = again_ && parts_.has_sent_all(v1::PREVIEW_STAGE_COARSE);
    full_cancel_ = Executor::make_token();
    if (has_picture_ && requests_.waits()) full_cancel_.cancel();
    lane_.post([self = std::static_pointer_cast<PreviewCall>(shared_from_this())] { self->paint_next(); });
  }

  /// On a worker.
  void paint_next() {
    ArrivedPreview request;
    CancellationToken full_cancel;
    {
      const std::lock_guard lock(mutex_);
      const bool is_outrun = requests_.waits() && !parts_.has_sent_any();
      if (again_ && is_outrun) requests_.drop_at_hand();
      if (std::exchange(again_, false) && !is_outrun) {
        parts_.begin_again();
      } else {
        parts_.begin();
        requests_.take_next();
      }
      request = requests_.at_hand();
      full_cancel = full_cancel_;
      if (stopped_) cancel_.cancel();
    }
    const std::vector<std::string> missing = ids_to_load(request);
    if (missing.empty()) return paint_and_go_on(request, full_cancel, nullptr);
    if (!std::ranges::all_of(missing, [this](const std::string& id) { return state_.cache.peek(id).has_value(); })) {
      const std::lock_guard lock(mutex_);
      give_back_place();  // The meshes may take minutes to come.
    }
    with_meshes(lane_, missing,
                [this, request, full_cancel](const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
                  take_meshes(meshes);
                  if (!error && ask_for_place_again()) return;
                  paint_and_go_on(request, full_cancel, error);
                });
    if (cancel_.cancelled()) stop_loading();  // Stopped before there was anything to stop.
  }

  /// For the request at hand, where the meshes took their time to come. False if there is no need to.
  bool ask_for_place_again() {
    std::unique_lock lock(mutex_);
    if (work_place_ || stopped_ || doing_ == Doing::kOver) return false;
    again_ = true;
    ask_for_place(lock);
    return true;
  }

  /// Meshes stay the same for the whole call: another one isn't loaded, as it will be refused. Volumes are those of the
  /// request; the others are let go.
  std::vector<std::string> ids_to_load(const ArrivedPreview& request) {
    if (meshes_.empty()) return request.mesh_ids.empty() ? std::vector<std::string>{""} : request.mesh_ids;
    std::vector<std::string> ids = volume_ids_of(fields_of(request.message));
    std::erase_if(meshes_, [&](const MeshPtr& mesh) {
      return mesh->volume() && std::ranges::find(ids, mesh->id()) == ids.end();
    });
    std::erase_if(
        ids, [&](const std::string& id) { return std::ranges::find(meshes_, id, &CachedMesh::id) != meshes_.end(); });
    return ids;
  }

  /// Later requests may bring volumes.
  void take_meshes(const std::vector<MeshPtr>& meshes) {
    if (meshes.empty()) return;
    const bool is_first = meshes_.empty();
    meshes_.insert(meshes_.end(), meshes.begin(), meshes.end());
    note_meshes(meshes_);
    const std::lock_guard lock(mutex_);
    if (is_first && doing_ != Doing::kOver) log_.note_mesh(meshes.front()->id());
  }

  void paint_and_go_on(const ArrivedPreview& request, const CancellationToken& full_cancel,
                       const std::exception_ptr& error) {
    std::exception_ptr failed;
    std::uint64_t missing_bytes = 0;
    try {
      if (error) std::rethrow_exception(error);
      paint(request, full_cancel);
    } catch (const PreviewMemoryMissing& missing) {
      missing_bytes = missing.bytes;
    } catch (...) {
      failed = std::current_exception();
    }
    std::unique_lock lock(mutex_);
    if (doing_ == Doing::kOver) return;
    if (missing_bytes > 0 && !stopped_) {
      const bool is_begun = parts_.has_sent_any();
      if (is_begun) give_back_place();
      return ask_for_memory(lock, missing_bytes, /*resumes=*/is_begun);
    }
    if (failed && !cancel_.cancelled()) {
      if (full_cancel.cancelled() && !parts_.has_sent_any(v1::PREVIEW_STAGE_FULL)) {
        ++stopped_pictures_;
      } else if (!failure_) {
        failure_ = to_status(failed);
      }
    }
    doing_ = Doing::kWriting;
    if (!is_writing_) return go_on(lock);
    shed_if_lagging(lock);
  }

  void paint(const ArrivedPreview& request, const CancellationToken& full_cancel) {
    const auto begun = SteadyClock::now();
    cancel_.throw_if_cancelled();
    session_.begin(meshes_, request.message, state_.slice_limits);
    const PreviewWork work = session_.work(request.message, state_.slice_limits, cancel_);
    const std::shared_ptr<PreviewPainter> painter = painter_of_meshes();
    const auto deliver = [&](v1::PreviewStage stage, const PreviewColours& show, const PreviewPicture& picture,
                             SteadyClock::time_point from) {
      send(request, stage, show, picture, {request.arrived, begun, from});
    };
    if (const auto* layer = std::get_if<LayerPreview>(&work)) {
      const PreviewPicture picture = painter->paint(*layer, session_.layers_key(request.message), cancel_);
      return deliver(v1::PREVIEW_STAGE_FULL, layer->show, picture, begun);
    }
    const auto& job = std::get<PreviewJob>(work);
    bool is_coarse_there = false, is_full_begun = false;  // At the client.
    {
      const std::lock_guard lock(mutex_);
      is_full_begun = parts_.has_sent_any(v1::PREVIEW_STAGE_FULL);
      is_coarse_there = is_full_begun || parts_.has_sent_all(v1::PREVIEW_STAGE_COARSE);
    }
    if (request.message.coarse() && !is_coarse_there) {
      deliver(v1::PREVIEW_STAGE_COARSE, job.show, painter->paint(job, PreviewStage::kCoarse, cancel_), begun);
    }
    if (request.message.coarse() && !is_full_begun) full_cancel.throw_if_cancelled();
    const auto from = SteadyClock::now();
    const CancellationToken& cancel = request.message.coarse() && !is_full_begun ? full_cancel : cancel_;
    deliver(v1::PREVIEW_STAGE_FULL, job.show, painter->paint(job, PreviewStage::kFull, cancel), from);
  }

  /// A call that is ended in the middle of a picture leaves its painter to whoever paints.
  std::shared_ptr<PreviewPainter> painter_of_meshes() {
    const std::lock_guard lock(mutex_);
    if (!painter_) painter_ = new_painter();
    return painter_;
  }
  std::shared_ptr<PreviewPainter> new_painter() const {
    std::vector<MeshPtr> solids;
    std::ranges::copy_if(meshes_, std::back_inserter(solids), [](const MeshPtr& mesh) { return !mesh->volume(); });
    return std::make_shared<PreviewPainter>(std::move(solids), state_.scratch,
                                            [&admission = state_.admission] { return admission.wants_memory(); });
  }

  void send(const ArrivedPreview& request, v1::PreviewStage stage, const PreviewColours& show,
            const PreviewPicture& picture, const PreviewTimes& times) {
    std::vector<v1::PreviewResponse> parts = session_.answer(request.message, stage, show, picture, times, cancel_);
    const std::lock_guard lock(mutex_);
    if (parts_.add(stage, std::move(parts))) {
      ++(stage == v1::PREVIEW_STAGE_FULL ? full_pictures_ : coarse_pictures_);
      oldest_ms_ = std::max(oldest_ms_, milliseconds_between(request.arrived, SteadyClock::now()));
      ++state_.metrics.preview_pictures;
    }
    has_picture_ = true;
    if (requests_.waits()) full_cancel_.cancel();
    write_next();
  }

  /// Writes the next part, unless one is being written.
  void write_next() {
    if (is_writing_ || parts_.empty() || stopped_ || doing_ == Doing::kOver) return;
    is_writing_ = true;
    written_ = parts_.take();
    write_watch_->start([this] { this->StartWrite(&written_); });
  }

  void OnWriteDone(bool ok) override {
    const auto self = shared_from_this();
    std::unique_lock lock(mutex_);
    if (!write_watch_->end() || doing_ == Doing::kOver) return;
    is_writing_ = lags_ = false;
    if (!ok) {
      cancel_.cancel();
      full_cancel_.cancel();
      parts_.drop();
      failure_ = status_of_stop();
    }
    if (!parts_.empty() && !stopped_) return write_next();
    if (doing_ == Doing::kWriting) go_on(lock);
  }

  /// When a request has been answered.
  void go_on(std::unique_lock<std::mutex>& lock) {
    if (!parts_.empty() && !stopped_ && !failure_) return write_next();
    if (stopped_ || cancel_.cancelled()) return finish(lock, status_of_stop());
    if (failure_) return finish(lock, *failure_);
    if (parts_.lacks_any()) return ask_for_memory(lock, painter_bytes_, /*resumes=*/true);
    if (requests_.waits()) return work_place_ ? start_painting() : ask_for_place(lock);
    give_back_place();
    if (reads_done_) return finish(lock, grpc::Status::OK);
    requests_.forget_at_hand();
    hold_requests();  // Less than before.
    wait_idle([] {});
  }

  void give_back_place() {
    if (!work_place_) return;
    state_.admission.give_back(*work_place_);
    work_place_.reset();
  }

  void finish(std::unique_lock<std::mutex>& lock, const grpc::Status& status) {
    doing_ = Doing::kOver;
    const std::shared_ptr<PreviewPainter> painter = std::move(painter_);
    give_back_place();
    log_.note(std::to_string(coarse_pictures_) + " coarse and " + std::to_string(full_pictures_) +
              " full pictures, requests dropped " + std::to_string(requests_.dropped()) + " and stopped " +
              std::to_string(stopped_pictures_) + ", oldest answer " + std::to_string(std::lround(oldest_ms_)) + " ms");
    lock.unlock();
    end(status);
  }

  void OnCancel() override {
    const auto self = shared_from_this();
    stop();
    std::unique_lock lock(mutex_);
    leave_admission(lock, status_of_stop());
  }

  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
      cancel_.cancel();
      full_cancel_.cancel();
    }
    stop_loading();
  }

  Executor::Lane lane_;
  const CancellationToken cancel_ = Executor::make_token();
  std::shared_ptr<SideWatch> memory_watch_, write_watch_;  // Of an idle call; of a write.

  std::mutex mutex_;  // Guards what follows, but for what is marked.
  Doing doing_ = Doing::kIdle;
  grpc::ByteBuffer raw_;  // The read's.
  bool reads_done_ = false, stopped_ = false;
  std::optional<grpc::Status> failure_;
  std::optional<Admission::Place> work_place_;
  CancellationToken full_cancel_ = Executor::make_token();
  bool has_picture_ = false;  // The request at hand has got its first picture.
  bool is_writing_ = false;
  bool lags_ = false;            // The write takes long.
  PreviewRequests requests_;     // The one at hand and the one that waits,
  PreviewParts parts_;           // pictures of the former,
  bool again_ = false;           // to be painted again.
  v1::PreviewResponse written_;  // The write's.
  SteadyClock::time_point idle_since_;
  std::shared_ptr<PreviewPainter> painter_;
  std::uint64_t painter_bytes_ = 0;  // Of the one that was given back.
  // Of the log:
  std::uint64_t coarse_pictures_ = 0, full_pictures_ = 0, stopped_pictures_ = 0;
  double oldest_ms_ = 0;

  // The worker's:
  std::vector<MeshPtr> meshes_;
  PreviewSession session_;
};

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PreviewResponse>* begin_preview_call(
    ServiceState& state, grpc::CallbackServerContext& context) {
  const auto call = std::make_shared<PreviewCall>(state, context);
  call->begin();
  return call.get();
}

}  // namespace ccslice::server
