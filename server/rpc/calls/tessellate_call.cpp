// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/calls.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/base/engine_version.h"
#include "core/base/number_text.h"
#include "core/contour/tessellate.h"
#include "server/rpc/calls/requests.h"
#include "server/rpc/calls/shedding_call.h"
#include "server/rpc/calls/unknown_fields.h"
#include "server/rpc/convert/convert.h"

namespace ccslice::server {
namespace {

/// Largest payload of a message once the client has lagged: it may be slow, and each time that it lags costs all
/// triangles. A message so small has come over 500 kbit/s before a call lags.
constexpr std::size_t kLaggingChunkBytes = 64u << 10;

/// All vertices and triangles.
struct Surface {
  std::vector<double> positions_mm;
  std::vector<float> channel_values;
  std::vector<std::uint32_t> triangles;

  static std::uint64_t bytes_of(const TessellationSummary& size, std::size_t channels) {
    return size.vertices * (3 * sizeof(double) + channels * sizeof(float)) + size.triangles * 3 * sizeof(std::uint32_t);
  }
  void reserve(const TessellationSummary& size, std::size_t channels) {
    positions_mm.reserve(3 * size.vertices);
    channel_values.reserve(channels * size.vertices);
    triangles.reserve(3 * size.triangles);
  }
  void add(const TessellationChunk& chunk) {
    for (const Vec3& position : chunk.positions)
      positions_mm.insert(positions_mm.end(), position.begin(), position.end());
    channel_values.insert(channel_values.end(), chunk.channel_values.begin(), chunk.channel_values.end());
    for (const auto& triangle : chunk.triangles) triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  }
};

/// Tessellates on a worker, whole, then streams: the header says how much will come.
class TessellateCall final : public SheddingCall<v1::TessellateBoundaryResponse> {
 public:
  TessellateCall(ServiceState& state, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request)
      : SheddingCall(state, context, "TessellateBoundary", Pieces::kLong), raw_(request) {}

 private:
  const grpc::ByteBuffer& raw_request() const override { return raw_; }
  const google::protobuf::Descriptor& request_type() const override { return *request_.GetDescriptor(); }

  std::vector<std::string> parse() override {
    parse_request(raw_, request_);
    require_known_fields(request_);
    return {request_.mesh_id()};
  }

  void forget() override { v1::TessellateBoundaryRequest().Swap(&request_); }

  void prepare(const std::vector<MeshPtr>& meshes) override {
    mesh_ = meshes.front();
    log_.note_mesh(request_.mesh_id());
    header_.set_mesh_id(request_.mesh_id());
    max_chunk_bytes_ = chunk_bytes_or_default(request_.max_chunk_bytes());
    const LimitSolid& solid = *mesh_->solid();
    placement_ = to_placement(request_.placement(), solid.summary().bounding_box, state_.slice_limits);
    channels_ = solid.channel_count();
    options_.tolerance_mm = tolerance_mm();
    const std::uint64_t held = state_.options.stream_window_bytes / triangle_memory_bytes(channels_);
    options_.max_triangles = std::min(state_.max_triangles, held);
    options_.cancel = cancel_;
    bound_ = bound_tessellation(solid, placement_, options_);
    require_scratch("finding the triangles", bound_.scratch_bytes, "choose a larger chord_tolerance_mm");
    ask_for_work();
  }

  double tolerance_mm() const {
    const double tolerance =
        request_.has_chord_tolerance_mm() ? request_.chord_tolerance_mm() : kDefaultChordToleranceMm;
    if (tolerance >= kMinChordToleranceMm && tolerance <= kMaxChordToleranceMm) return tolerance;
    throw Error(ErrorCode::kToleranceInvalid,
                "chord_tolerance_mm: " + number_text(tolerance) + " is outside " + number_text(kMinChordToleranceMm) +
                    " to " + number_text(kMaxChordToleranceMm) + "; 0.05 is enough for display",
                "chord_tolerance_mm");
  }

  bool is_short() const override { return false; }

  /// What the triangles take at most, or as much as one call may hold, and what it takes to find them.
  bool reserve() override {
    const std::uint64_t most = std::min(Surface::bytes_of(bound_.most, channels_), state_.options.stream_window_bytes);
    MemoryBudget::Share scratch(state_.scratch), share(state_.streams);
    if (!scratch.resize(bound_.scratch_bytes, bytes_left(bound_.scratch_bytes))) return false;
    if (!share.resize(most)) {
      (void)scratch.resize(0);  // Without telling those who wait, of whom this is one.
      return false;
    }
    scratch_ = std::move(scratch);
    share_ = std::move(share);
    return true;
  }

  void start_work_later() override { start_work_in(Pieces::kLong); }

  void start_work() override {
    MemoryBudget::Share scratch = std::move(scratch_);  // Given back when that which it counts has gone.
    const auto surface = std::make_shared<Surface>();
    const auto add = [&](const TessellationChunk& chunk) {
      if (chunk.first_vertex == 0) make_room(*surface, chunk.whole);
      surface->add(chunk);
    };
    tessellate(*mesh_->solid(), placement_, options_, bound_, add);
    if (!has_header_) write_header(*surface);
    has_header_ = true;
    const std::lock_guard lock(work_mutex_);
    surface_ = surface;
  }

  void make_room(Surface& surface, const TessellationSummary& whole) {
    const std::uint64_t bytes = Surface::bytes_of(whole, channels_);
    if (bytes > share_.bytes() && !share_.resize(bytes)) {
      if (bytes > state_.streams.capacity_bytes()) {
        throw job_exceeds_memory("the surface with its channels", bytes, state_.streams.capacity_bytes(),
                                 "choose a larger chord_tolerance_mm", "--stream-budget-bytes");
      }
      throw stream_memory_used_up();
    }
    share_.split_off_beyond(bytes).give_back();
    surface.reserve(whole, channels_);
  }

  void write_header(const Surface& surface) {
    header_.set_engine_version(std::string(kEngineVersion));
    header_.set_vertex_count(surface.positions_mm.size() / 3);
    header_.set_triangle_count(surface.triangles.size() / 3);
    for (const ChannelRange& channel : mesh_->solid()->summary().channels) {
      *header_.add_channels() = to_message(channel);
    }
  }

  /// Keeps the message that is being sent.
  bool give_work_back() override {
    std::shared_ptr<const Surface> dropped;
    MemoryBudget::Share given_back;
    {
      const std::lock_guard lock(work_mutex_);
      if (!surface_) return false;
      dropped = std::exchange(surface_, nullptr);
      given_back = share_.split_off_beyond(0);
      has_lagged_ = true;
    }
    dropped = nullptr;
    given_back.give_back();
    return true;
  }
  bool goes_on() const override { return false; }

  Next next(v1::TessellateBoundaryResponse& message) override {
    if (header_sent_ && all_sent()) return Next::kEnd;
    const std::shared_ptr<const Surface> surface = this->surface();
    if (!surface) return Next::kPending;
    if (!header_sent_) {
      *message.mutable_header() = header_;
      header_sent_ = true;
    } else if (next_vertex_ < header_.vertex_count()) {
      write_vertices(*surface, *message.mutable_vertex_chunk());
    } else {
      write_triangles(*surface, *message.mutable_triangle_chunk());
    }
    return Next::kMessage;
  }

  bool all_sent() const { return next_vertex_ == header_.vertex_count() && next_triangle_ == header_.triangle_count(); }

  /// Null while it is being made. Where it was shed, asks for it again. Throws why there is none.
  std::shared_ptr<const Surface> surface() {
    std::unique_lock lock(work_mutex_);
    throw_error_locked();
    if (has_lagged_) max_chunk_bytes_ = std::min(max_chunk_bytes_, kLaggingChunkBytes);
    if (!take_shed_locked()) return surface_;
    lock.unlock();
    ask_again();
    return nullptr;
  }

  void write_vertices(const Surface& surface, v1::VertexChunk& chunk) {
    const std::size_t vertex_bytes = 3 * sizeof(double) + channels_ * sizeof(float);
    const std::size_t count = std::min(max_chunk_bytes_ / vertex_bytes, surface.positions_mm.size() / 3 - next_vertex_);
    chunk.Clear();
    chunk.set_first_vertex(next_vertex_);
    const auto position = surface.positions_mm.begin() + static_cast<std::ptrdiff_t>(3 * next_vertex_);
    chunk.mutable_positions_mm()->Add(position, position + static_cast<std::ptrdiff_t>(3 * count));
    const auto values = surface.channel_values.begin() + static_cast<std::ptrdiff_t>(channels_ * next_vertex_);
    chunk.mutable_channel_values()->Add(values, values + static_cast<std::ptrdiff_t>(channels_ * count));
    next_vertex_ += count;
  }

  void write_triangles(const Surface& surface, v1::TriangleChunk& chunk) {
    constexpr std::size_t kTriangleBytes = 3 * 5;  // Varints, at most.
    const std::size_t count =
        std::min(max_chunk_bytes_ / kTriangleBytes, surface.triangles.size() / 3 - next_triangle_);
    chunk.Clear();
    chunk.set_first_triangle(next_triangle_);
    const auto vertex = surface.triangles.begin() + static_cast<std::ptrdiff_t>(3 * next_triangle_);
    chunk.mutable_vertices()->Add(vertex, vertex + static_cast<std::ptrdiff_t>(3 * count));
    next_triangle_ += count;
  }

  const grpc::ByteBuffer& raw_;
  v1::TessellateBoundaryRequest request_;
  MeshPtr mesh_;  // In use until the call is done.
  Placement placement_ = Placement::Identity();
  TessellationOptions options_;
  TessellationBound bound_;
  std::size_t max_chunk_bytes_ = 0;
  std::size_t channels_ = 0;
  MemoryBudget::Share share_;    // What the surface takes of the memory of all streams.
  MemoryBudget::Share scratch_;  // For finding it, from now on.
  v1::TessellationHeader header_;
  bool has_header_ = false;
  bool header_sent_ = false;
  std::size_t next_vertex_ = 0;
  std::size_t next_triangle_ = 0;
  // Guarded by work_mutex_:
  std::shared_ptr<const Surface> surface_;  // Null until it has been made, and when it was shed.
  bool has_lagged_ = false;
};

}  // namespace

grpc::ServerWriteReactor<v1::TessellateBoundaryResponse>* begin_tessellate_call(ServiceState& state,
                                                                                grpc::CallbackServerContext& context,
                                                                                const grpc::ByteBuffer& request) {
  return TessellateCall::begin(std::make_shared<TessellateCall>(state, context, request));
}

}  // namespace ccslice::server
