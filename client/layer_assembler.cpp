// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/layer_assembler.h"

#include <string>
#include <utility>

#include "client/client_error.h"
#include "client/plane_decoder.h"

namespace ccslice::client {
namespace {

template <typename Message>
v1::VoxelBox region_or_grid(const Message& message) {
  if (message.has_region()) return message.region();
  v1::VoxelBox whole;
  *whole.mutable_extent() = message.grid().extent();
  return whole;
}

}  // namespace

v1::VoxelBox region_of(const v1::SliceHeader& header) { return region_or_grid(header); }
v1::VoxelBox region_of(const v1::PlanSlicesResponse& plan) { return region_or_grid(plan); }

std::optional<Layer> LayerAssembler::add(v1::SliceRangeResponse&& message) {
  require_answer(!complete_, "messages after the summary");
  switch (message.event_case()) {
    case v1::SliceRangeResponse::kLayerBegin: begin(message.layer_begin()); break;
    case v1::SliceRangeResponse::kPlaneChunk: add_plane_chunk(std::move(*message.mutable_plane_chunk())); break;
    case v1::SliceRangeResponse::kContourChunk: add_contour_chunk(message.contour_chunk()); break;
    case v1::SliceRangeResponse::kLayerEnd: return end(std::move(*message.mutable_layer_end()));
    case v1::SliceRangeResponse::kSummary: finish(message.summary()); break;
    case v1::SliceRangeResponse::kHeader: require_answer(false, "a second header"); break;
    case v1::SliceRangeResponse::EVENT_NOT_SET: require_answer(false, "an empty message"); break;
  }
  return std::nullopt;
}

void LayerAssembler::begin(const v1::LayerBegin& begin) {
  require_answer(!open_, "a layer begins inside another one");
  require_answer(begin.layer() == next_layer_,
                 "layer " + std::to_string(begin.layer()) + " where " + std::to_string(next_layer_) + " is due");
  require_answer(begin.encoded_bytes_size() == header_.planes_size(),
                 "a layer with another number of planes than asked for");
  for (int i = 0; i < header_.planes_size(); ++i) {
    require_possible_size(header_.planes(i), region_of(header_).extent(), begin.encoded_bytes(i));
  }
  require_answer(begin.contour_loops() <= most_contour_points_, "a layer of more contours than there can be");
  contour_room_ = most_contour_points_;
  begun_ = begin;
  complete_loops_ = 0;
  open_.emplace();
  open_->index = begin.layer();
  open_->z_mm = begin.z_mm();
  open_->planes.resize(static_cast<std::size_t>(header_.planes_size()));
  for (int i = 0; i < header_.planes_size(); ++i) open_->planes[static_cast<std::size_t>(i)].spec = header_.planes(i);
}

void LayerAssembler::add_plane_chunk(v1::PlaneChunk&& chunk) {
  require_open_layer();
  require_answer(chunk.plane() < open_->planes.size(), "a chunk of a plane that wasn't asked for");
  require_answer(!chunk.data().empty(), "an empty chunk");
  std::string& encoded = open_->planes[chunk.plane()].encoded;
  require_answer(chunk.offset() == encoded.size(), "chunks of a plane with a gap");
  const std::uint64_t announced = begun_.encoded_bytes(static_cast<int>(chunk.plane()));
  require_answer(chunk.data().size() <= announced - encoded.size(), "a plane longer than announced");
  if (encoded.empty()) {
    encoded = std::move(*chunk.mutable_data());
  } else {
    encoded += chunk.data();
  }
}

void LayerAssembler::add_contour_chunk(const v1::ContourChunk& chunk) {
  require_open_layer();
  require_answer(chunk.pieces_size() > 0, "an empty chunk");
  for (const v1::ContourPiece& piece : chunk.pieces()) add_piece(piece);
}

void LayerAssembler::add_piece(const v1::ContourPiece& piece) {
  constexpr std::uint64_t kPointsOfALoop = 5;  // As many as take its memory without points.
  require_answer(piece.loop() == complete_loops_, "contour loops out of order");
  require_answer(complete_loops_ < begun_.contour_loops(), "more contour loops than announced");
  require_answer(piece.points_mm_size() % 2 == 0, "half a contour point");
  require_answer(piece.points_mm_size() > 0, "a piece with no contour points");
  take_room(static_cast<std::uint64_t>(piece.points_mm_size()) / 2);
  std::vector<ContourLoop>& loops = open_->contours;
  if (loops.size() == complete_loops_) {
    take_room(kPointsOfALoop);
    loops.emplace_back();
  }
  ContourLoop& loop = loops.back();
  const auto regions = static_cast<std::uint32_t>(header_.cell_region_names_size());
  if (piece.first_point() == 0) {
    loop.cell_region = piece.cell_region();
    loop.placed_part = piece.placed_part();
  }
  require_answer(piece.placed_part() == loop.placed_part, "a contour of several parts");
  require_answer(piece.cell_region() == loop.cell_region && piece.cell_region() <= regions,
                 "contours of an unknown region");
  require_answer(piece.first_point() == loop.points_mm.size() / 2, "contour points with a gap");
  loop.points_mm.insert(loop.points_mm.end(), piece.points_mm().begin(), piece.points_mm().end());
  loop.faces.insert(loop.faces.end(), piece.faces().begin(), piece.faces().end());
  loop.parameters.insert(loop.parameters.end(), piece.parameters().begin(), piece.parameters().end());
  const std::size_t numbers = loop.cell_region == 0 ? loop.points_mm.size() : 0;  // Two a point.
  require_answer(2 * loop.faces.size() == numbers && loop.parameters.size() == numbers,
                 "contour points without their faces or parameters");
  if (piece.last()) ++complete_loops_;
}

void LayerAssembler::take_room(std::uint64_t points) {
  require_answer(points <= contour_room_, "a layer of more contours than there can be");
  contour_room_ -= points;
}

Layer LayerAssembler::end(v1::LayerEnd&& end) {
  require_open_layer();
  require_answer(end.layer() == open_->index, "the end of another layer");
  require_answer(end.planes_size() == header_.planes_size(), "a layer without a result for each plane");
  require_answer(complete_loops_ == begun_.contour_loops() && open_->contours.size() == complete_loops_,
                 "fewer or more contour loops than announced");
  Layer layer = std::move(*open_);
  open_.reset();
  for (int i = 0; i < header_.planes_size(); ++i) {
    Plane& plane = layer.planes[static_cast<std::size_t>(i)];
    require_answer(plane.encoded.size() == begun_.encoded_bytes(i), "a plane shorter than announced");
    plane.result = end.planes(i);
    decode_plane(region_of(header_).extent(), plane);
  }
  layer.end = std::move(end);
  ++next_layer_;
  return layer;
}

void LayerAssembler::finish(const v1::SliceSummary& summary) {
  require_answer(!open_, "the summary came inside a layer");
  require_answer(
      next_layer_ == header_.first_layer() + header_.layer_count() && summary.layers() == header_.layer_count(),
      "the summary came before all layers");
  complete_ = true;
}

void LayerAssembler::require_open_layer() const { require_answer(open_.has_value(), "a chunk outside of a layer"); }

}  // namespace ccslice::client
