// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer as messages, one after the other: begin, chunks of the planes, pieces of the contours, end. Pure.

#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "ccslice/v1/slice.pb.h"
#include "core/job/slice_job.h"

namespace ccslice::server {

class LayerMessages {
 public:
  LayerMessages() = default;
  LayerMessages(Layer layer, std::uint32_t max_chunk_bytes)
      : layer_(std::move(layer)), max_chunk_bytes_(max_chunk_bytes), stage_(Stage::kBegin) {}

  /// Without the bytes of planes that were sent.
  const Layer& layer() const { return layer_; }
  /// Whether the last message was written, or there was no layer.
  bool over() const { return stage_ == Stage::kOver; }
  /// Writes the next message; false after the last one.
  [[nodiscard]] bool next(v1::SliceRangeResponse& message);

 private:
  enum class Stage { kBegin, kPlanes, kContours, kEnd, kOver };

  void write_begin(v1::LayerBegin& begin) const;
  [[nodiscard]] bool write_plane_chunk(v1::SliceRangeResponse& message);
  void skip_sent_planes();
  [[nodiscard]] bool write_contour_chunk(v1::SliceRangeResponse& message);
  template <typename Loop>
  [[nodiscard]] bool write_loops(const std::vector<Loop>& loops, v1::SliceRangeResponse& message);
  void write_end(v1::LayerEnd& end) const;

  Layer layer_;
  std::uint32_t max_chunk_bytes_ = 0;
  Stage stage_ = Stage::kOver;
  std::size_t plane_ = 0;  // Next chunk: this plane, from this byte.
  std::size_t offset_ = 0;
  std::size_t loop_ = 0;  // Next piece: this loop, from this point.
  std::size_t point_ = 0;
};

}  // namespace ccslice::server
