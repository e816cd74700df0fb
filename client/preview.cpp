// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/preview.h"

#include <atomic>
#include <utility>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client_error.h"

namespace ccslice::client {

void PreviewAssembler::begin(v1::PreviewResponse& message) {
  constexpr std::uint64_t kMostPixels = 2048, kBytesAPixel = 4, kMostFileBytes = 1 << 20;
  require_answer(!open_, "a picture begins inside another one");
  outline_points_ = 0;
  brought_nothing_ = false;
  open_.emplace();
  open_->number = message.number();
  open_->stage = message.stage();
  open_->header = std::move(*message.mutable_header());
  const std::uint64_t width = open_->header.width(), height = open_->header.height();
  require_answer(width >= 1 && width <= kMostPixels && height >= 1 && height <= kMostPixels,
                 "a picture of impossible size");
  // A PNG file may be somewhat larger than what is in it.
  require_answer(open_->header.picture_bytes() <= 2 * kBytesAPixel * width * height + kMostFileBytes,
                 "a picture of impossible length");
}

void PreviewAssembler::add_outlines(v1::PreviewResponse& message) {
  constexpr std::uint64_t kPointsOfAnOutline = 5;  // As many as take its memory without points.
  for (v1::PreviewOutline& outline : *message.mutable_outlines()) {
    outline_points_ += static_cast<std::uint64_t>(outline.points_mm_size()) / 2 + kPointsOfAnOutline;
    require_answer(outline_points_ <= most_outline_points_, "a picture of more outlines than there can be");
    open_->outlines.push_back(std::move(outline));
  }
}

std::optional<PreviewPicture> PreviewAssembler::add(v1::PreviewResponse&& message) {
  if (message.has_header()) begin(message);
  require_answer(open_.has_value(), "a part of no picture");
  require_answer(message.number() == open_->number && message.stage() == open_->stage, "a part of another picture");
  require_answer(message.picture().size() <= open_->header.picture_bytes() - open_->bytes.size(),
                 "a picture longer than announced");
  const bool brings_nothing = message.picture().empty() && message.outlines().empty();
  require_answer(!brings_nothing || !brought_nothing_, "parts of a picture with nothing in them");
  brought_nothing_ = brings_nothing;
  open_->bytes += message.picture();
  add_outlines(message);
  if (!message.last()) return std::nullopt;
  require_answer(open_->bytes.size() == open_->header.picture_bytes(), "a picture shorter than announced");
  return std::exchange(open_, std::nullopt);
}

std::string mesh_id_of(const v1::PreviewRequest& request) {
  return request.plane().has_layer() ? mesh_id_of(request.plane().layer().job()) : request.mesh_id();
}

struct PreviewStream::State {
  State(std::shared_ptr<const Endpoint> at, const std::string& mesh_id, const CallOptions& options)
      : endpoint(std::move(at)),
        call_options(options),
        call(call_options, *endpoint, mesh_id),
        stream(endpoint->stub->Preview(&call.context())) {}

  const std::shared_ptr<const Endpoint> endpoint;
  const CallOptions call_options;
  Call call;
  std::unique_ptr<grpc::ClientReaderWriter<v1::PreviewRequest, v1::PreviewResponse>> stream;
  PreviewAssembler assembler;
  std::atomic<std::uint64_t> number = 0;  // Of the last request. Who asks and who takes pictures may be two threads.
  std::uint64_t pictures = 0;             // That have come.
  bool ended = false;
};

PreviewStream::PreviewStream(Client& client, const std::string& mesh_id, const CallOptions& call)
    : PreviewStream(client.endpoint_of(mesh_id, call), mesh_id, call) {}

PreviewStream::PreviewStream(std::shared_ptr<const Endpoint> endpoint, const std::string& mesh_id,
                             const CallOptions& call)
    : state_(std::make_unique<State>(std::move(endpoint), mesh_id, call)) {}

PreviewStream::~PreviewStream() {
  if (state_->ended) return;
  state_->call.context().TryCancel();
  v1::PreviewResponse left;
  while (state_->stream->Read(&left)) {
  }
  state_->stream->Finish();
}

std::uint64_t PreviewStream::ask(v1::PreviewRequest request) {
  const std::uint64_t number = ++state_->number;
  request.set_number(number);
  state_->stream->Write(request);  // Where it fails the call is over, and next() says why.
  return number;
}

void PreviewStream::done() { state_->stream->WritesDone(); }

std::optional<PreviewPicture> PreviewStream::next() {
  if (state_->ended) return std::nullopt;
  v1::PreviewResponse message;
  while (state_->stream->Read(&message)) {
    auto picture = state_->assembler.add(std::move(message));
    if (!picture) continue;
    // A coarse one and one in full of each request, at most.
    require_answer(picture->number <= state_->number && ++state_->pictures <= 2 * state_->number,
                   "a picture that nobody asked for");
    return picture;
  }
  state_->ended = true;
  state_->call.check(state_->stream->Finish());
  return std::nullopt;
}

PreviewPicture Client::preview(const v1::PreviewRequest& request, const CallOptions& call) {
  const std::string mesh_id = mesh_id_of(request);
  std::vector<std::string> ids = volume_ids_of(request.fields());
  if (request.plane().has_layer()) {
    ids = mesh_ids_of(request.plane().layer().job());
  } else {
    ids.insert(ids.begin(), mesh_id);
  }
  Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, std::move(ids));
  int reuploads = 0;
  return with_retries(call, attempts, reuploads, [&](const Endpoint&) {
    PreviewStream stream(attempts.endpoint(), mesh_id, call);
    stream.ask(request);
    stream.done();
    std::optional<PreviewPicture> last;
    while (auto picture = stream.next()) last = std::move(picture);
    require_answer(last.has_value() && last->stage == v1::PREVIEW_STAGE_FULL, "no picture, and no error");
    return std::move(*last);
  });
}

}  // namespace ccslice::client
