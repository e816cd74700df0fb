// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/slice_call.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "core/base/engine_version.h"
#include "core/printing/halftone.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/slice_range.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_printing.h"
#include "server/rpc/layer_messages.h"
#include "server/rpc/requests.h"
#include "server/rpc/slice_job.h"
#include "server/service/layer_stream.h"

namespace ccslice::server {
namespace {

/// The slicers of one job: what they share is prepared once, by the worker that needs it first; the others wait for it.
class SlicerFactory {
 public:
  SlicerFactory(std::shared_ptr<const LimitSolid> solid, SliceJob job)
      : solid_(std::move(solid)), job_(std::move(job)) {}

  LayerStream::ComputeLayer make(const CancellationToken& cancel) {
    return [slicer = std::make_shared<LayerSlicer>(prototype(cancel).twin())](
               std::uint32_t layer, const CancellationToken& token) { return slicer->slice(layer, token); };
  }

 private:
  const LayerSlicer& prototype(const CancellationToken& cancel) {
    std::lock_guard lock(mutex_);
    if (!prototype_) prototype_.emplace(solid_, job_, cancel);
    return *prototype_;
  }

  const std::shared_ptr<const LimitSolid> solid_;
  const SliceJob job_;
  std::mutex mutex_;
  std::optional<LayerSlicer> prototype_;
};

class SliceCall final : public StreamCall<v1::SliceRangeResponse> {
 public:
  SliceCall(ServiceState& state, grpc::CallbackServerContext& context, const v1::SliceRangeRequest& request)
      : StreamCall(state, context, "SliceRange"), request_(request) {}

 private:
  enum class Stage { kHeader, kLayers, kSummary, kOver };

  void prepare() override {
    mesh_ = require_mesh(state_, request_.mesh_id());
    max_chunk_bytes_ = chunk_bytes_or_default(request_.max_chunk_bytes());
    const SliceJob job = to_job(request_, *mesh_->solid(), state_.slice_limits, cancel_);
    validate_layer_range(job, request_.first_layer(), request_.layer_count());
    log_.note(request_.mesh_id());
    log_.note("layers " + std::to_string(request_.first_layer()) + "+" + std::to_string(request_.layer_count()));
    write_header(job);
    const std::optional<VoxelShape> mask = mask_of(job);
    if (mask && !has_shared_mask(*mask)) return make_mask_and_start(*mask, job);
    start_stream(job);
  }

  static std::optional<VoxelShape> mask_of(const SliceJob& job) {
    const VoxelPitch& pitch = job.grid.pitch;
    return job.printing ? mask_shape(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm) : std::nullopt;
  }

  /// A mask takes about a second: a long piece of work of its own, so that others' layers go on meanwhile.
  void make_mask_and_start(const VoxelShape& shape, const SliceJob& job) {
    state_.executor.make_lane(Executor::Pieces::kLong).post([this, self = shared_from_this(), shape, job] {
      try {
        (void)shared_mask(shape, cancel_);
        start_stream(job);
      } catch (...) {
        std::lock_guard lock(stream_mutex_);
        start_error_ = std::current_exception();
      }
      wake();
    });
  }

  /// Takes the window from the memory of all streams: what the layers need, one of them at least. How much contours
  /// need isn't known before.
  StreamWindow take_window(const SliceJob& job) {
    const std::uint64_t one = std::max(layer_bytes(job), kMinStreamWindowBytes);
    const std::uint64_t all = one * request_.layer_count();
    const std::uint64_t most = state_.options.stream_window_bytes;
    std::optional<MemoryBudget::Share> share =
        state_.streams.take_between(one, job.contours ? most : std::min(most, all));
    if (!share) throw stream_memory_used_up();
    share_ = std::move(*share);
    return choose_window(layer_bytes(job), share_.bytes(), state_.executor.threads());
  }

  void start_stream(const SliceJob& job) {
    auto factory = std::make_shared<SlicerFactory>(mesh_->solid(), job);
    auto stream = LayerStream::start(
        state_.executor, {.first = request_.first_layer(), .count = request_.layer_count()}, take_window(job),
        [factory](const CancellationToken& cancel) { return factory->make(cancel); },
        [weak = weak_from_this()] {
          if (const auto call = weak.lock()) static_cast<SliceCall&>(*call).wake();
        });
    {
      std::lock_guard lock(stream_mutex_);
      stream_ = stream;
    }
    if (stopped()) stream->cancel();
  }

  void stop() override {
    cancel_.cancel();
    if (const auto stream = this->stream()) stream->cancel();
  }

  /// Null until it has been started. Throws why it can't be.
  std::shared_ptr<LayerStream> started_stream() {
    std::lock_guard lock(stream_mutex_);
    if (start_error_) std::rethrow_exception(start_error_);
    return stream_;
  }

  std::shared_ptr<LayerStream> stream() {
    std::lock_guard lock(stream_mutex_);
    return stream_;
  }

  Next next(v1::SliceRangeResponse& message) override {
    if (stage_ == Stage::kHeader) {
      *message.mutable_header() = std::move(header_);
      stage_ = Stage::kLayers;
      return Next::kMessage;
    }
    if (stage_ == Stage::kLayers) return next_of_layers(message);
    if (stage_ == Stage::kSummary) {
      *summary_.mutable_elapsed() = to_duration(log_.elapsed());
      *message.mutable_summary() = summary_;
      stage_ = Stage::kOver;
      return Next::kMessage;
    }
    return Next::kEnd;
  }

  Next next_of_layers(v1::SliceRangeResponse& message) {
    if (messages_.next(message)) return Next::kMessage;
    const std::shared_ptr<LayerStream> stream = started_stream();
    if (!stream) return Next::kPending;
    Layer layer;
    switch (stream->pull(layer)) {
      case LayerStream::Pull::kPending: return Next::kPending;
      case LayerStream::Pull::kFailed: std::rethrow_exception(stream->error());
      case LayerStream::Pull::kEnd: stage_ = Stage::kSummary; return next(message);
      case LayerStream::Pull::kLayer: break;
    }
    count(layer);
    messages_ = LayerMessages(std::move(layer), max_chunk_bytes_);
    return next_of_layers(message);
  }

  void write_header(const SliceJob& job) {
    header_.set_engine_version(std::string(kEngineVersion));
    *header_.mutable_grid() = to_message(job.grid);
    *header_.mutable_region() = to_message(region_of(job));
    *header_.mutable_layout() = with_defaults(request_.layout());
    header_.set_mesh_id(request_.mesh_id());
    header_.set_first_layer(request_.first_layer());
    header_.set_layer_count(request_.layer_count());
    for (const PlaneSpec& plane : job.planes) {
      *header_.add_planes() = to_message(plane, mesh_->solid()->summary(), job.printing);
    }
    if (shows_cell_regions(job)) {
      for (const CellRegionSummary& region : mesh_->solid()->summary().cell_regions) {
        header_.add_cell_region_names(region.name);
      }
    }
    if (job.printing) *header_.mutable_printing() = to_message(*job.printing, mesh_->solid()->summary());
  }

  void count(const Layer& layer) {
    summary_.set_layers(summary_.layers() + 1);
    summary_.set_empty_layers(summary_.empty_layers() + (layer.stats.voxels_inside == 0 ? 1 : 0));
    summary_.set_voxel_count(summary_.voxel_count() + layer.stats.voxels_inside);
    summary_.set_voxels_unresolved(summary_.voxels_unresolved() + layer.stats.voxels_unresolved);
    summary_.set_max_residual_mm(std::max(summary_.max_residual_mm(), layer.stats.max_residual_mm));
    for (const EncodedPlane& plane : layer.planes) {
      summary_.set_encoded_bytes(summary_.encoded_bytes() + plane.bytes.size());
    }
  }

  const v1::SliceRangeRequest& request_;
  MeshPtr mesh_;  // In use until the call is done.
  MemoryBudget::Share share_;
  std::uint32_t max_chunk_bytes_ = 0;
  Stage stage_ = Stage::kHeader;
  v1::SliceHeader header_;
  v1::SliceSummary summary_;
  LayerMessages messages_;
  CancellationToken cancel_ = CancellationToken::make();  // Cancels the work before the stream.
  std::mutex stream_mutex_;
  std::shared_ptr<LayerStream> stream_;
  std::exception_ptr start_error_;
};

}  // namespace

grpc::ServerWriteReactor<v1::SliceRangeResponse>* begin_slice_call(ServiceState& state,
                                                                   grpc::CallbackServerContext& context,
                                                                   const v1::SliceRangeRequest& request) {
  return SliceCall::begin(std::make_shared<SliceCall>(state, context, request));
}

}  // namespace ccslice::server
