// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Puts the messages of a SliceRange stream together to layers. Pure: no calls, so every order of messages can be
// tested. Whatever a server sends, a layer takes no more than twice the memory that its grid's planes can take and that
// of kMostContourPoints, and each message brings something, so that layers end.

#pragma once

#include <cstdint>
#include <optional>

#include "ccslice/v1/slice.pb.h"
#include "client/layer.h"

namespace ccslice::client {

class LayerAssembler {
 public:
  /// A layer may have so many. They take more than 2 GB, and some 4 GB as a file.
  static constexpr std::uint64_t kMostContourPoints = 1 << 26;

  /// `header` of the stream; layers are expected from header.first_layer() on.
  explicit LayerAssembler(const v1::SliceHeader& header, std::uint64_t most_contour_points = kMostContourPoints)
      : header_(header), most_contour_points_(most_contour_points), next_layer_(header.first_layer()) {}

  /// Takes the next message (not the header). Gives the layer when it is complete, decoded and checked. Throws
  /// ClientError{DATA_LOSS, ANSWER_CORRUPT} for anything out of order or out of shape.
  [[nodiscard]] std::optional<Layer> add(v1::SliceRangeResponse&& message);

  /// The summary has come.
  bool complete() const noexcept { return complete_; }
  /// The first layer that hasn't been given out.
  std::uint32_t next_layer() const noexcept { return next_layer_; }

 private:
  void begin(const v1::LayerBegin& begin);
  void add_plane_chunk(v1::PlaneChunk&& chunk);
  void add_contour_chunk(const v1::ContourChunk& chunk);
  void add_piece(const v1::ContourPiece& piece);
  Layer end(v1::LayerEnd&& end);
  void finish(const v1::SliceSummary& summary);
  void require_open_layer() const;

  /// Room for `points` more of the layer's contours.
  void take_room(std::uint64_t points);

  const v1::SliceHeader header_;
  const std::uint64_t most_contour_points_;
  std::uint32_t next_layer_;
  bool complete_ = false;
  std::optional<Layer> open_;
  v1::LayerBegin begun_;
  std::uint64_t complete_loops_ = 0;
  std::uint64_t contour_room_ = 0;  // For so many points more.
};

}  // namespace ccslice::client
