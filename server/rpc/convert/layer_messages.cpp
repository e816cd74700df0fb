// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/layer_messages.h"

#include <algorithm>

#include "server/rpc/convert/convert.h"

namespace ccslice::server {
namespace {

/// A contour point on the wire, at most: x, y, s, t and a face number; and what a piece adds.
constexpr std::size_t kPointBytes = 4 * sizeof(double) + 5;
constexpr std::size_t kPieceBytes = 52;

void add_point(const Vec2& point, v1::ContourPiece& piece) {
  piece.add_points_mm(point.x());
  piece.add_points_mm(point.y());
}

void add_point(const ContourPoint& point, v1::ContourPiece& piece) {
  add_point(point.xy, piece);
  piece.add_faces(point.face);
  piece.add_parameters(point.s);
  piece.add_parameters(point.t);
}

std::uint32_t region_number_of(const ContourLoop& /*loop*/) { return 0; }
std::uint32_t region_number_of(const RegionLoop& loop) { return loop.region + 1u; }

}  // namespace

bool LayerMessages::next(v1::SliceRangeResponse& message) {
  switch (stage_) {
    case Stage::kBegin:
      write_begin(*message.mutable_layer_begin());
      stage_ = Stage::kPlanes;
      return true;
    case Stage::kPlanes:
      if (write_plane_chunk(message)) return true;
      stage_ = Stage::kContours;
      [[fallthrough]];
    case Stage::kContours:
      if (write_contour_chunk(message)) return true;
      stage_ = Stage::kEnd;
      [[fallthrough]];
    case Stage::kEnd:
      write_end(*message.mutable_layer_end());
      stage_ = Stage::kOver;
      return true;
    case Stage::kOver: break;
  }
  return false;
}

void LayerMessages::write_begin(v1::LayerBegin& begin) const {
  begin.Clear();
  begin.set_layer(layer_.index);
  begin.set_z_mm(layer_.z_mm);
  for (const EncodedPlane& plane : layer_.planes) begin.add_encoded_bytes(plane.bytes.size());
  begin.set_contour_loops(layer_.contours.loops.size() + layer_.region_loops.size());
}

bool LayerMessages::write_plane_chunk(v1::SliceRangeResponse& message) {
  skip_sent_planes();
  if (plane_ == layer_.planes.size()) return false;
  const std::vector<std::uint8_t>& bytes = layer_.planes[plane_].bytes;
  const std::size_t size = std::min<std::size_t>(max_chunk_bytes_, bytes.size() - offset_);
  v1::PlaneChunk& chunk = *message.mutable_plane_chunk();
  chunk.set_plane(static_cast<std::uint32_t>(plane_));
  chunk.set_offset(offset_);
  chunk.set_data(bytes.data() + offset_, size);
  offset_ += size;
  skip_sent_planes();
  return true;
}

/// Their bytes aren't needed any more: a client may take its time for the last message.
void LayerMessages::skip_sent_planes() {
  while (plane_ < layer_.planes.size() && offset_ == layer_.planes[plane_].bytes.size()) {
    layer_.planes[plane_].bytes = {};
    ++plane_;
    offset_ = 0;
  }
}

/// A layer has loops of one kind only.
bool LayerMessages::write_contour_chunk(v1::SliceRangeResponse& message) {
  return layer_.region_loops.empty() ? write_loops(layer_.contours.loops, message)
                                     : write_loops(layer_.region_loops, message);
}

template <typename Loop>
bool LayerMessages::write_loops(const std::vector<Loop>& loops, v1::SliceRangeResponse& message) {
  if (loop_ == loops.size()) return false;
  v1::ContourChunk& chunk = *message.mutable_contour_chunk();
  chunk.Clear();
  std::size_t room = max_chunk_bytes_;
  while (loop_ < loops.size() && room >= kPieceBytes + kPointBytes) {
    const auto& points = loops[loop_].points;
    const std::size_t count = std::min((room - kPieceBytes) / kPointBytes, points.size() - point_);
    v1::ContourPiece& piece = *chunk.add_pieces();
    piece.set_loop(loop_);
    piece.set_first_point(point_);
    piece.set_cell_region(region_number_of(loops[loop_]));
    piece.set_placed_part(loops[loop_].part);
    for (std::size_t i = 0; i < count; ++i) add_point(points[point_ + i], piece);
    point_ += count;
    room -= kPieceBytes + count * kPointBytes;
    if (point_ < points.size()) continue;
    piece.set_last(true);
    ++loop_;
    point_ = 0;
  }
  return true;
}

void LayerMessages::write_end(v1::LayerEnd& end) const {
  end.Clear();
  end.set_layer(layer_.index);
  end.set_voxel_count(layer_.stats.voxels_inside);
  end.set_empty(layer_.stats.voxels_inside == 0);
  *end.mutable_statistics() = to_message(layer_.stats);
  for (const EncodedPlane& plane : layer_.planes) {
    v1::PlaneResult& result = *end.add_planes();
    result.set_raw_bytes(plane.raw_bytes);
    result.set_crc32(plane.crc32);
  }
}

}  // namespace ccslice::server
