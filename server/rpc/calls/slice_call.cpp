// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/calls.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "core/base/engine_version.h"
#include "core/printing/halftone.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/slicer_memory.h"
#include "server/rpc/calls/requests.h"
#include "server/rpc/calls/shedding_call.h"
#include "server/rpc/calls/unknown_fields.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/rpc/convert/layer_messages.h"
#include "server/rpc/convert/slice_job.h"
#include "server/service/scheduling/layer_stream.h"
#include "server/service/scheduling/slicer_source.h"

namespace ccslice::server {
namespace {

/// Ranges of so many bytes of samples are interactive, where rows cross the boundary no more often than this: some tens
/// of milliseconds' work.
constexpr std::uint64_t kInteractiveBytes = 4u << 20, kInteractiveCrossings = 4u << 20;

/// Contours take time too, though no samples: they count like occupancy.
Pieces pieces_of(const SliceJob& job, const SlicerMemory& memory, std::uint32_t layers) {
  const GridExtent extent = region_of(job).extent;
  const std::uint64_t bits = std::uint64_t{extent.columns} * extent.rows;
  const std::uint64_t samples = std::max(layer_bytes(job), bits / 8);
  const bool is_small = samples * layers <= kInteractiveBytes && memory.crossings * layers <= kInteractiveCrossings;
  return is_small ? Pieces::kInteractive : Pieces::kBatch;
}

class SliceCall final : public SheddingCall<v1::SliceRangeResponse> {
 public:
  SliceCall(ServiceState& state, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request)
      : SheddingCall(state, context, "SliceRange"), raw_(request) {}

 private:
  enum class Stage { kHeader, kLayers, kSummary, kOver };

  const grpc::ByteBuffer& raw_request() const override { return raw_; }
  const google::protobuf::Descriptor& request_type() const override { return *request_.GetDescriptor(); }

  std::vector<std::string> parse() override {
    parse_request(raw_, request_);
    require_known_fields(request_);
    return mesh_ids_of(request_.job(), kJobPath);
  }

  void forget() override { v1::SliceRangeRequest().Swap(&request_); }

  void prepare(const std::vector<MeshPtr>& meshes) override {
    meshes_ = meshes;
    max_chunk_bytes_ = chunk_bytes_or_default(request_.max_chunk_bytes());
    parts_ = to_placed_parts(request_.job(), kJobPath, solids_of_parts(meshes_, request_.job().parts_size()),
                             state_.slice_limits, cancel_, nullptr, volumes_of(meshes_));
    const SliceJob& job = this->job();
    range_ = {.first = request_.first_layer(), .count = request_.layer_count()};
    validate_layer_range(job, range_.first, range_.count);
    log_.note_mesh(meshes_.front()->id());
    log_.note_layers(range_.first, range_.count);
    write_header(job);
    memory_ = slicer_memory(parts_, cancel_);
    pieces_ = pieces_of(job, memory_, range_.count);
    require_scratch("slicing a layer", scratch_bytes(), "ask for a region, fewer planes or a coarser pitch");
    ask_for_work();
  }

  /// What all parts have in common.
  const SliceJob& job() const { return parts_.front().job; }

  static std::optional<VoxelShape> mask_of(const SliceJob& job) {
    const VoxelPitch& pitch = job.grid.pitch;
    return job.printing ? mask_shape(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm) : std::nullopt;
  }

  bool is_short() const override {
    return pieces_ == Pieces::kInteractive && scratch_bytes() <= scratch_for_short(state_.scratch.capacity_bytes());
  }
  std::uint64_t scratch_bytes() const { return SlicerSource::least_bytes(memory_); }

  /// What the slicers need, one of them at least, and the window's share of the memory of all streams: what the layers
  /// need, one of them at least. How much contours need isn't known before.
  bool reserve() override {
    const std::uint64_t one = std::max(most_layer_bytes(parts_), kMinStreamWindowBytes);
    const std::uint64_t all = one * range_.count;
    const std::uint64_t most = state_.options.stream_window_bytes;
    MemoryBudget::Share scratch(state_.scratch);
    if (!scratch.resize(scratch_bytes(), bytes_left(scratch_bytes()))) return false;
    std::optional<MemoryBudget::Share> share =
        state_.streams.take_between(one, job().contours ? most : std::min(most, all));
    if (!share) {
      (void)scratch.resize(0);  // Without telling those who wait, of whom this is one.
      return false;
    }
    scratch_ = std::move(scratch);
    share_ = std::move(*share);
    return true;
  }

  /// A long piece of work where it makes a mask, which takes about a second.
  void start_work_later() override {
    const std::optional<VoxelShape> mask = mask_of(job());
    start_work_in(mask && !has_shared_mask(*mask) ? Pieces::kLong : pieces_);
  }

  /// What all slicers of the job share is prepared here, before any of them, so that no worker waits for another one.
  void start_work() override {
    LayerSlicer prototype(parts_, cancel_, memory_.tiles_fit);
    const auto source = std::make_shared<SlicerSource>(
        std::move(prototype), memory_, std::move(scratch_),
        SlicerSource::Limits{.left_bytes = bytes_left(scratch_bytes()),
                             .is_crowded = [&admission = state_.admission] { return admission.wants_memory(); }});
    StreamWindow window = choose_window(most_layer_bytes(parts_), share_.bytes(), state_.executor.threads());
    const std::uint32_t all_slabs = window.window_slabs;
    if (summary_.layers() > 0) window.window_slabs = 1;  // Its client may stop again soon.
    auto stream = LayerStream::start(
        make_lane(pieces_), range_, window, source->make(),
        [weak = weak_from_this()] {
          if (const auto call = weak.lock()) static_cast<SliceCall&>(*call).wake();
        },
        source->limit());
    {
      const std::lock_guard lock(work_mutex_);
      stream_ = stream;
      all_slabs_ = all_slabs;
      layers_of_stream_ = 0;
    }
    if (cancel_.cancelled()) stream->cancel();
  }

  /// Keeps the message that is being sent. A layer of which more is to come will be computed anew, too.
  bool give_work_back() override {
    std::shared_ptr<LayerStream> dropped;
    MemoryBudget::Share given_back;
    {
      const std::lock_guard lock(work_mutex_);
      if (!stream_) return false;
      dropped = std::exchange(stream_, nullptr);
      given_back = share_.split_off_beyond(0);
      if (!messages_.over()) {
        --range_.first;
        ++range_.count;
        skipped_messages_ = sent_messages_;
      }
      messages_ = {};
    }
    dropped->cancel();
    dropped = nullptr;
    given_back.give_back();
    return true;
  }
  bool goes_on() const override { return true; }
  bool has_got_on() override {
    const std::lock_guard lock(work_mutex_);
    return stream_ && layers_of_stream_ > 0;
  }

  void stop() override {
    SheddingCall::stop();
    if (const auto stream = this->stream()) stream->cancel();
  }

  std::shared_ptr<LayerStream> stream() {
    std::lock_guard lock(work_mutex_);
    return stream_;
  }

  Next next(v1::SliceRangeResponse& message) override {
    if (stage_ == Stage::kHeader) {
      if (!may_begin()) return Next::kPending;
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
    if (take_message(message)) return Next::kMessage;
    Layer layer;
    switch (pull(layer)) {
      case LayerStream::Pull::kPending: return Next::kPending;
      case LayerStream::Pull::kFailed:  // It throws.
      case LayerStream::Pull::kEnd: stage_ = Stage::kSummary; return next(message);
      case LayerStream::Pull::kLayer: break;
    }
    begin_messages(std::move(layer));
    return next_of_layers(message);
  }

  bool take_message(v1::SliceRangeResponse& message) {
    const std::lock_guard lock(work_mutex_);
    if (!messages_.next(message)) return false;
    ++sent_messages_;
    return true;
  }

  /// Without those that were sent before the call shed.
  void begin_messages(Layer layer) {
    if (pulled_layer_ >= uncounted_layer_) count(layer);
    uncounted_layer_ = pulled_layer_ + 1;
    const std::lock_guard lock(work_mutex_);
    messages_ = LayerMessages(std::move(layer), max_chunk_bytes_);
    sent_messages_ = std::exchange(skipped_messages_, 0);
    v1::SliceRangeResponse sent;
    for (std::uint64_t k = 0; k < sent_messages_; ++k) (void)messages_.next(sent);
  }

  /// A layer of the stream. Where that was shed, asks for another one. Throws why there is none.
  LayerStream::Pull pull(Layer& layer) {
    std::unique_lock lock(work_mutex_);
    throw_error_locked();
    if (!stream_) {
      if (range_.count == 0) return LayerStream::Pull::kEnd;
      const bool asks = take_shed_locked();
      lock.unlock();
      if (asks) ask_again();
      return LayerStream::Pull::kPending;
    }
    const LayerStream::Pull pulled = stream_->pull(layer);
    if (pulled == LayerStream::Pull::kFailed) at_job(kJobPath, [&] { std::rethrow_exception(stream_->error()); });
    if (pulled != LayerStream::Pull::kLayer) return pulled;
    pulled_layer_ = range_.first++;
    --range_.count;
    if (++layers_of_stream_ == kSlabLayers) stream_->set_window_slabs(all_slabs_);
    return pulled;
  }

  void write_header(const SliceJob& job) {
    header_.set_engine_version(std::string(kEngineVersion));
    *header_.mutable_grid() = to_message(job.grid);
    *header_.mutable_region() = to_message(region_of(job));
    *header_.mutable_layout() = with_defaults(request_.job().layout());
    for (const v1::Part& part : request_.job().parts()) header_.add_mesh_ids(part.mesh_id());
    header_.set_first_layer(request_.first_layer());
    header_.set_layer_count(request_.layer_count());
    const ChannelTable channels(parts_.front().solid->summary().channels, job.sources);
    for (const PlaneSpec& plane : job.planes) *header_.add_planes() = to_message(plane, channels, job.printing);
    if (shows_cell_regions(job) || job.contours_by_cell_region) {
      for (const std::string& name : cell_region_names(parts_)) header_.add_cell_region_names(name);
    }
    if (job.printing) *header_.mutable_printing() = printing_with_defaults(request_.job(), parts_);
  }

  void count(const Layer& layer) {
    if (summary_.layers() == 0) state_.metrics.seconds_to_first_layer.add(log_.elapsed());
    summary_.set_layers(summary_.layers() + 1);
    ++state_.metrics.layers;
    state_.metrics.voxels += layer.stats.voxels_inside;
    summary_.set_empty_layers(summary_.empty_layers() + (layer.stats.voxels_inside == 0 ? 1 : 0));
    summary_.set_voxel_count(summary_.voxel_count() + layer.stats.voxels_inside);
    summary_.set_voxels_unresolved(summary_.voxels_unresolved() + layer.stats.voxels_unresolved);
    summary_.set_max_residual_mm(std::max(summary_.max_residual_mm(), layer.stats.max_residual_mm));
    summary_.set_voxels_covered(summary_.voxels_covered() + layer.stats.voxels_covered);
    summary_.set_voxels_cut(summary_.voxels_cut() + layer.stats.voxels_cut);
    summary_.set_voxels_off_map(summary_.voxels_off_map() + layer.stats.voxels_off_map);
    if (layer.stats.voxels_scaled_up > 0) {
      const double least = layer.stats.least_fraction_sum;
      const bool first = summary_.voxels_scaled_up() == 0;
      summary_.set_least_fraction_sum(first ? least : std::min(summary_.least_fraction_sum(), least));
      summary_.set_voxels_scaled_up(summary_.voxels_scaled_up() + layer.stats.voxels_scaled_up);
    }
    for (const EncodedPlane& plane : layer.planes) {
      summary_.set_encoded_bytes(summary_.encoded_bytes() + plane.bytes.size());
      state_.metrics.layer_bytes += plane.bytes.size();
      log_.add_bytes(plane.bytes.size());
    }
  }

  const grpc::ByteBuffer& raw_;
  v1::SliceRangeRequest request_;
  std::vector<MeshPtr> meshes_;  // And volumes. In use until the call is done.
  PlacedParts parts_;
  SlicerMemory memory_;
  Pieces pieces_ = Pieces::kBatch;
  MemoryBudget::Share share_;    // For layers.
  MemoryBudget::Share scratch_;  // For slicers that are about to start.
  std::uint32_t max_chunk_bytes_ = 0;
  Stage stage_ = Stage::kHeader;
  v1::SliceHeader header_;
  v1::SliceSummary summary_;
  std::uint32_t pulled_layer_ = 0, uncounted_layer_ = 0;
  // Guarded by work_mutex_:
  LayerRange range_;                     // What is still to be pulled.
  std::shared_ptr<LayerStream> stream_;  // Null until it has been started, and when it was shed.
  LayerMessages messages_;               // Of the layer that is being sent.
  std::uint64_t sent_messages_ = 0;      // Of it.
  std::uint64_t skipped_messages_ = 0;   // Of the layer to come, which was being sent when the call shed.
  std::uint32_t all_slabs_ = 0;          // In flight, once the stream runs.
  std::uint32_t layers_of_stream_ = 0;   // Pulled.
};

}  // namespace

grpc::ServerWriteReactor<v1::SliceRangeResponse>* begin_slice_call(ServiceState& state,
                                                                   grpc::CallbackServerContext& context,
                                                                   const grpc::ByteBuffer& request) {
  return SliceCall::begin(std::make_shared<SliceCall>(state, context, request));
}

}  // namespace ccslice::server
