// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Puts the messages of a TessellateBoundary stream together to a surface. Pure: no calls. What is announced is checked
// against what comes, never allocated unseen, and is no more than a surface may be, whatever comes.

#pragma once

#include "ccslice/v1/surface.pb.h"
#include "client/surface.h"

namespace ccslice::client {

/// All throw ClientError{DATA_LOSS, ANSWER_CORRUPT} for anything out of order or out of shape.
class SurfaceAssembler {
 public:
  /// Takes the next message, the header first.
  void add(const v1::TessellateBoundaryResponse& message);
  /// The whole surface, after the last message.
  [[nodiscard]] Surface finish() &&;

 private:
  void begin(const v1::TessellationHeader& header);
  void add(const v1::VertexChunk& chunk);
  void add(const v1::TriangleChunk& chunk);

  Surface surface_;
  bool begun_ = false;
};

}  // namespace ccslice::client
