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

/// Ranges of so many bytes of samples are interactive.
constexpr std::uint64_t kInteractiveBytes = 4u << 20;

/// Contours take time too, though no samples: they count like occupancy.
Pieces pieces_of(const SliceJob& job, std::uint32_t layers) {
  const GridExtent extent = region_of(job).extent;
  const std::uint64_t bits = std::uint64_t{extent.columns} * extent.rows;
  const std::uint64_t samples = std::max(layer_bytes(job), bits / 8);
  return samples * layers <= kInteractiveBytes ? Pieces::kInteractive : Pieces::kBatch;
}

class SliceCall final : public StreamCall<v1::SliceRangeResponse> {
 public:
  SliceCall(ServiceState& state, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request)
      : StreamCall(state, context, "SliceRange"), raw_(request) {}

 private:
  enum class Stage { kHeader, kLayers, kSummary, kOver };

  const grpc::ByteBuffer& raw_request() const override { return raw_; }
  const google::protobuf::Descriptor& request_type() const override { return *request_.GetDescriptor(); }

  void prepare() override {
    parse_request(raw_, request_);
    mesh_ = require_mesh(state_, request_.mesh_id());
    max_chunk_bytes_ = chunk_bytes_or_default(request_.max_chunk_bytes());
    const SliceJob job = to_job(request_, *mesh_->solid(), state_.slice_limits, cancel_);
    range_ = {.first = request_.first_layer(), .count = request_.layer_count()};
    validate_layer_range(job, range_.first, range_.count);
    log_.note(request_.mesh_id());
    log_.note("layers " + std::to_string(range_.first) + "+" + std::to_string(range_.count));
    write_header(job);
    share_ = take_memory(job);
    const std::optional<VoxelShape> mask = mask_of(job);
    if (mask && !has_shared_mask(*mask)) return start_later(job, Pieces::kLong);
    const Pieces pieces = pieces_of(job, range_.count);
    if (pieces != Pieces::kInteractive) return start_later(job, pieces);
    start_stream(job);  // On a worker for interactive work as it is.
  }

  static std::optional<VoxelShape> mask_of(const SliceJob& job) {
    const VoxelPitch& pitch = job.grid.pitch;
    return job.printing ? mask_shape(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm) : std::nullopt;
  }

  /// As a piece of work of its own: a long one where it makes a mask, which takes about a second.
  void start_later(const SliceJob& job, Pieces pieces) {
    make_lane(pieces).post([this, self = shared_from_this(), job] {
      try {
        start_stream(job);
      } catch (...) {
        std::lock_guard lock(stream_mutex_);
        start_error_ = std::current_exception();
      }
      wake();
    });
  }

  /// The window's share of the memory of all streams: what the layers need, one of them at least. How much contours
  /// need isn't known before.
  MemoryBudget::Share take_memory(const SliceJob& job) {
    const std::uint64_t one = std::max(layer_bytes(job), kMinStreamWindowBytes);
    const std::uint64_t all = one * request_.layer_count();
    const std::uint64_t most = state_.options.stream_window_bytes;
    std::optional<MemoryBudget::Share> share =
        state_.streams.take_between(one, job.contours ? most : std::min(most, all));
    if (!share) throw stream_memory_used_up();
    return std::move(*share);
  }

  /// What all slicers of the job share is prepared here, before any of them, so that no worker waits for another one.
  void start_stream(const SliceJob& job) {
    const auto prototype = std::make_shared<const LayerSlicer>(mesh_->solid(), job, cancel_);
    const auto make = [prototype](const CancellationToken&) {
      return [slicer = std::make_shared<LayerSlicer>(prototype->twin())](
                 std::uint32_t layer, const CancellationToken& token) { return slicer->slice(layer, token); };
    };
    auto stream = LayerStream::start(make_lane(pieces_of(job, range_.count)), range_,
                                     choose_window(layer_bytes(job), share_.bytes(), state_.executor.threads()), make,
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
    if (shows_cell_regions(job) || job.contours_by_region) {
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

  const grpc::ByteBuffer& raw_;
  v1::SliceRangeRequest request_;
  MeshPtr mesh_;  // In use until the call is done.
  LayerRange range_;
  MemoryBudget::Share share_;
  std::uint32_t max_chunk_bytes_ = 0;
  Stage stage_ = Stage::kHeader;
  v1::SliceHeader header_;
  v1::SliceSummary summary_;
  LayerMessages messages_;
  CancellationToken cancel_ = Executor::make_token();  // Cancels the work before the stream.
  std::mutex stream_mutex_;
  std::shared_ptr<LayerStream> stream_;
  std::exception_ptr start_error_;
};

}  // namespace

grpc::ServerWriteReactor<v1::SliceRangeResponse>* begin_slice_call(ServiceState& state,
                                                                   grpc::CallbackServerContext& context,
                                                                   const grpc::ByteBuffer& request) {
  return SliceCall::begin(std::make_shared<SliceCall>(state, context, request));
}

}  // namespace ccslice::server
