// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/tessellate_call.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/engine_version.h"
#include "core/base/number_text.h"
#include "core/contour/tessellate.h"
#include "server/rpc/convert.h"
#include "server/rpc/requests.h"
#include "server/rpc/unknown_fields.h"

namespace ccslice::server {
namespace {

/// Tessellates on a worker, whole, then streams: the header says how much will come.
class TessellateCall final : public StreamCall<v1::TessellateBoundaryResponse> {
 public:
  TessellateCall(ServiceState& state, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request)
      : StreamCall(state, context, "TessellateBoundary", Pieces::kLong), raw_(request), share_(state.streams) {}

 private:
  const grpc::ByteBuffer& raw_request() const override { return raw_; }
  const google::protobuf::Descriptor& request_type() const override { return *request_.GetDescriptor(); }

  std::string parse() override {
    parse_request(raw_, request_);
    require_known_fields(request_);
    return request_.mesh_id();
  }

  void prepare(const MeshPtr& mesh) override {
    log_.note_mesh(request_.mesh_id());
    max_chunk_bytes_ = chunk_bytes_or_default(request_.max_chunk_bytes());
    const Placement placement =
        to_placement(request_.placement(), mesh->solid()->summary().bounding_box, state_.slice_limits);
    channels_ = mesh->solid()->channel_count();
    TessellationOptions options;
    options.tolerance_mm = tolerance_mm();
    options.max_triangles = state_.max_triangles;
    options.cancel = cancel_;
    tessellate(*mesh->solid(), placement, options, [this](const TessellationChunk& chunk) { collect(chunk); });
    write_header(mesh->solid()->summary());
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

  void collect(const TessellationChunk& chunk) {
    for (const Vec3& position : chunk.positions)
      positions_mm_.insert(positions_mm_.end(), position.begin(), position.end());
    materials_.insert(materials_.end(), chunk.channel_values.begin(), chunk.channel_values.end());
    for (const auto& triangle : chunk.triangles) triangles_.insert(triangles_.end(), triangle.begin(), triangle.end());
    if (!share_.resize(held_bytes())) throw stream_memory_used_up();
  }

  std::uint64_t held_bytes() const {
    return positions_mm_.capacity() * sizeof(double) + materials_.capacity() * sizeof(float) +
           triangles_.capacity() * sizeof(std::uint32_t);
  }

  void write_header(const SolidSummary& solid) {
    header_.set_engine_version(std::string(kEngineVersion));
    header_.set_mesh_id(request_.mesh_id());
    header_.set_vertex_count(positions_mm_.size() / 3);
    header_.set_triangle_count(triangles_.size() / 3);
    for (const ChannelRange& channel : solid.channels) *header_.add_channels() = to_message(channel);
  }

  void stop() override { cancel_.cancel(); }

  Next next(v1::TessellateBoundaryResponse& message) override {
    if (!header_sent_) {
      *message.mutable_header() = header_;
      header_sent_ = true;
      return Next::kMessage;
    }
    if (next_vertex_ < positions_mm_.size() / 3) {
      write_vertices(*message.mutable_vertex_chunk());
      return Next::kMessage;
    }
    if (next_triangle_ < triangles_.size() / 3) {
      write_triangles(*message.mutable_triangle_chunk());
      return Next::kMessage;
    }
    return Next::kEnd;
  }

  void write_vertices(v1::VertexChunk& chunk) {
    const std::size_t vertex_bytes = 3 * sizeof(double) + channels_ * sizeof(float);
    const std::size_t count = std::min(max_chunk_bytes_ / vertex_bytes, positions_mm_.size() / 3 - next_vertex_);
    chunk.Clear();
    chunk.set_first_vertex(next_vertex_);
    const auto position = positions_mm_.begin() + static_cast<std::ptrdiff_t>(3 * next_vertex_);
    chunk.mutable_positions_mm()->Add(position, position + static_cast<std::ptrdiff_t>(3 * count));
    const auto material = materials_.begin() + static_cast<std::ptrdiff_t>(channels_ * next_vertex_);
    chunk.mutable_materials()->Add(material, material + static_cast<std::ptrdiff_t>(channels_ * count));
    next_vertex_ += count;
  }

  void write_triangles(v1::TriangleChunk& chunk) {
    constexpr std::size_t kTriangleBytes = 3 * 5;  // Varints, at most.
    const std::size_t count = std::min(max_chunk_bytes_ / kTriangleBytes, triangles_.size() / 3 - next_triangle_);
    chunk.Clear();
    chunk.set_first_triangle(next_triangle_);
    const auto vertex = triangles_.begin() + static_cast<std::ptrdiff_t>(3 * next_triangle_);
    chunk.mutable_vertices()->Add(vertex, vertex + static_cast<std::ptrdiff_t>(3 * count));
    next_triangle_ += count;
  }

  const grpc::ByteBuffer& raw_;
  v1::TessellateBoundaryRequest request_;
  const CancellationToken cancel_ = Executor::make_token();
  std::size_t max_chunk_bytes_ = 0;
  std::size_t channels_ = 0;
  MemoryBudget::Share share_;  // What the arrays take of the memory of all streams.
  std::vector<double> positions_mm_;
  std::vector<float> materials_;
  std::vector<std::uint32_t> triangles_;
  v1::TessellationHeader header_;
  bool header_sent_ = false;
  std::size_t next_vertex_ = 0;
  std::size_t next_triangle_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::TessellateBoundaryResponse>* begin_tessellate_call(ServiceState& state,
                                                                                grpc::CallbackServerContext& context,
                                                                                const grpc::ByteBuffer& request) {
  return TessellateCall::begin(std::make_shared<TessellateCall>(state, context, request));
}

}  // namespace ccslice::server
