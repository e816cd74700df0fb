// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
//     read start -> cached already? answer
//                 : read and hash chunks -> check the digest -> wait for a place -> prepare, or join -> answer
//
// One of these is under way at any time and decides what comes next; a cancel only makes it end sooner. Hashing a chunk
// costs about as much as receiving it, so it needs no worker, but a client that sends tiny ones waits for its turn.

#include "server/rpc/calls/calls.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/calls/answered_call.h"
#include "server/rpc/calls/prepare_mesh.h"
#include "server/rpc/calls/side_watch.h"
#include "server/rpc/convert/summary.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

class UploadCall final : public AnsweredCall<grpc::ServerReadReactor<grpc::ByteBuffer>> {
 public:
  UploadCall(ServiceState& state, grpc::CallbackServerContext& context, v1::UploadMeshResponse& response)
      : AnsweredCall(state, context, "UploadMesh"),
        response_(response),
        upload_(std::make_shared<Upload>(state.uploads, state.options.max_mesh_bytes, client_)),
        pace_(state.options.min_upload_rate) {}

  void begin() {
    if (const auto refused = open_call()) return end(*refused);
    watch();
    read();
  }

 private:
  void read() {
    wait_for_message([this] { StartRead(&raw_); });
  }

  void OnReadDone(bool ok) override {
    if (!end_wait()) return;
    if (stopped_) return end(status_of_stop());
    try {
      if (!ok) return finish_reading();
      tiny_in_row_ = raw_.Length() < kTinyBytes ? tiny_in_row_ + 1 : 0;
      if (accept()) tiny_in_row_ < kTinyAtOnce ? read() : read_in_turn();
    } catch (...) {
      end(to_status(std::current_exception()));
    }
  }

  /// Messages of a few bytes each, one right after the other, would keep gRPC's threads from all other calls.
  void read_in_turn() {
    tiny_in_row_ = 0;
    if (!lane_) lane_ = make_lane(Pieces::kInteractive);
    lane_->post([this, self = shared_from_this()] { read(); });
  }

  void OnCancel() override {
    stopped_ = true;
    stop();
    end_if_waiting();
  }

  void stop() override { ticket().cancel(); }

  /// Takes a message in; false if the call has been answered.
  bool accept() {
    v1::UploadMeshRequest request;
    parse_request(raw_, request);
    raw_.Clear();
    switch (request.part_case()) {
      case v1::UploadMeshRequest::kStart: return start(request.start());
      case v1::UploadMeshRequest::kChunk:
        upload_->append(request.chunk());
        keep_pace(request.chunk().size());
        return true;
      default: break;
    }
    throw ServiceError(ServiceErrorCode::kRequestMalformed, "part: a message with neither start nor chunk", "part");
  }

  void keep_pace(std::size_t bytes) {
    const std::lock_guard lock(pace_mutex_);
    pace_.count(bytes, UploadPace::Clock::now());
  }

  /// Nothing has come for a while: who sends too little ends here, as a chunk that never comes can't tell.
  void shed() override {
    try {
      keep_pace(0);
    } catch (...) {
      if (end_armed_wait()) end(to_status(std::current_exception()));
    }
  }

  bool start(const v1::UploadStart& message) {
    upload_->start(message.mesh_id(), message.size_bytes());
    mesh_id_ = message.mesh_id();
    log_.note_mesh(message.mesh_id());
    log_.note(std::to_string(message.size_bytes()) + " bytes");
    log_.add_bytes(message.size_bytes());
    const MeshPtr mesh = state_.cache.find(message.mesh_id());
    if (!mesh) return true;
    if (state_.store) {
      look_into_store(mesh);
    } else {
      answer_with(mesh, /*already_cached=*/true, /*stored=*/false);
    }
    return false;
  }

  /// Bytes that the store lacks are worth having, although the mesh is cached.
  void look_into_store(const MeshPtr& mesh) {
    state_.store->find({mesh->id()}, client_, [this, self = shared_from_this(), mesh](const std::vector<bool>& held) {
      if (stopped_) return end(status_of_stop());
      if (held == std::vector<bool>{false}) return read();
      answer_with(mesh, /*already_cached=*/true, /*stored=*/!held.empty());
    });
  }

  /// While its bytes arrive, an upload takes no place.
  void finish_reading() {
    upload_->finish();
    const auto self = shared_from_this();
    watch_loan();
    when_admitted([this] { prepare(); }, /*is_long=*/true);
    if (stopped_) end_if_waiting();  // Stopped before it began to wait, when nobody could take it out of the queue.
  }

  /// Bytes that have all come ask for no more, and so wouldn't notice that they have been kept for too long.
  void watch_loan() {
    if (!state_.uploads.is_lent(upload_->bytes().size())) return;
    lent_ = upload_;
    const auto self = std::static_pointer_cast<UploadCall>(shared_from_this());
    loan_watch_ =
        std::make_shared<SideWatch>(while_open(self, &UploadCall::watch_on), while_open(self, &UploadCall::end_loan));
    state_.idle_watch.add(loan_watch_);
    watch_on();
  }
  void watch_on() {
    loan_watch_->start([] {});
  }

  /// Who is being prepared keeps the bytes only where the store wants them.
  void end_loan() {
    const std::shared_ptr<Upload> upload = lent_.lock();
    if (!upload || !upload->bytes().is_in_budget() || !state_.uploads.is_overdue(client_)) return;
    const auto preparation = state_.cache.preparation(upload->mesh_id());
    if (preparation && preparation->step != PreparationStep::kWaiting) return;
    loan_is_over_ = true;
    if (leave_queue()) return end(status_of_end());
    ticket().cancel();
  }

  bool is_over() const { return stopped_ || loan_is_over_; }
  grpc::Status status_of_end() const {
    if (stopped_) return status_of_stop();
    return to_status(std::make_exception_ptr(too_many_upload_bytes(mesh_id_)));
  }

  void prepare() {
    if (is_over()) return end(status_of_end());
    // The bytes go with the preparation, unless the store wants them: whoever joins another one drops his.
    const std::shared_ptr<Upload> upload = state_.store ? upload_ : std::move(upload_);
    set_ticket(state_.cache.get_or_prepare(
        mesh_id_, PreparedBytes(state_, upload, /*are_kept=*/state_.store != nullptr),
        [this, self = shared_from_this()](const MeshCache::Outcome& outcome) { done(outcome); }, client_));
  }

  /// On this thread if the mesh came by another way meanwhile, on a worker's or the canceller's otherwise.
  void done(const MeshCache::Outcome& outcome) {
    if (stopped_ || (loan_is_over_ && outcome.error)) return end(status_of_end());
    if (outcome.error) return end(to_status(outcome.error));
    if (!state_.store) return answer_with(outcome.mesh, outcome.already_cached, /*stored=*/false);
    state_.store->keep(std::move(upload_), client_,
                       [this, self = shared_from_this(), outcome](const std::optional<bool>& kept) {
                         if (stopped_) return end(status_of_stop());
                         answer_with(outcome.mesh, outcome.already_cached, kept.value_or(false));
                       });
  }

  void answer_with(const MeshPtr& mesh, bool already_cached, bool stored) {
    *response_.mutable_mesh() = summarize(state_.cache, mesh);
    response_.set_already_cached(already_cached);
    response_.set_stored(stored);
    log_audit("uploaded", mesh->id() + " by " + client_, {{"mesh", mesh->id()}, {"client", client_}});
    answer(grpc::Status::OK, response_.ByteSizeLong());
  }

  void set_ticket(MeshCache::Ticket ticket) {
    {
      std::lock_guard lock(ticket_mutex_);
      ticket_ = ticket;
    }
    if (is_over()) ticket.cancel();
  }

  MeshCache::Ticket ticket() {
    std::lock_guard lock(ticket_mutex_);
    return ticket_;
  }

  static constexpr std::size_t kTinyBytes = 1024, kTinyAtOnce = 8;

  v1::UploadMeshResponse& response_;
  grpc::ByteBuffer raw_;
  std::size_t tiny_in_row_ = 0;
  std::optional<Executor::Lane> lane_;
  std::string mesh_id_;
  std::shared_ptr<Upload> upload_;
  std::weak_ptr<Upload> lent_;  // What takes more of the memory than is ever one client's.
  std::shared_ptr<SideWatch> loan_watch_;
  std::atomic<bool> loan_is_over_{false};
  std::mutex pace_mutex_;
  UploadPace pace_;  // Counted as bytes come, and by the watch where none do.
  std::atomic<bool> stopped_{false};
  std::mutex ticket_mutex_;
  MeshCache::Ticket ticket_;
};

}  // namespace

grpc::ServerReadReactor<grpc::ByteBuffer>* begin_upload_call(ServiceState& state, grpc::CallbackServerContext& context,
                                                             v1::UploadMeshResponse& response) {
  const auto call = std::make_shared<UploadCall>(state, context, response);
  call->begin();
  return call.get();
}

}  // namespace ccslice::server
