// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one error type of the core. Thrown by cold code only (reading, validating, preparing, planning); hot code returns
// std::optional. A message names the field or the ids at fault and says what to do; `reason` is the stable name that
// machines compare (google.rpc.ErrorInfo.reason on the wire).

#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ccslice {

/// Numbered by segment: 1xx control mesh, 2xx slicing request, 3xx execution, 4xx files. Numbers never change meaning.
enum class ErrorCode : int {
  // 1xx: the control mesh.
  kMeshMalformed = 100,          // Array lengths that don't fit together, bytes that don't parse.
  kMeshEmpty = 101,              // No cells or no vertices.
  kMeshTooLarge = 102,           // More vertices, cells, channels or bytes than the limits allow.
  kMeshNonFinite = 103,          // NaN or infinite position or channel value.
  kMeshIndexOutOfRange = 104,    // A cell, sharp edge or sharp vertex names a vertex that doesn't exist.
  kMeshRepeatedVertex = 105,     // A cell names the same vertex twice.
  kMeshUnsupportedCell = 106,    // Pyramids and other cells that never refine to hexahedra.
  kMeshNonManifoldFace = 107,    // A face in more than two cells.
  kMeshNonManifoldEdge = 108,    // A boundary edge with other than two boundary faces.
  kMeshNonManifoldVertex = 109,  // A vertex whose cells form neither one ball nor one half-ball.
  kMeshSharedFaces = 110,        // Two cells that share more than one face (or an interior edge of valence 2).
  kMeshInvertedCell = 111,       // A corner of non-positive Jacobian, with allow_folds unset.
  kMeshIsolatedVertex = 112,     // A vertex that no cell uses.
  kMeshBadSharpFeature = 113,    // A sharp edge or vertex that isn't on the boundary, or named twice.
  kMeshBadChannel = 114,         // Channel names empty, repeated, or too long; value count mismatch.
  kMeshValenceTooHigh = 115,     // More cells round an edge or a vertex than the limits allow.
  // 2xx: the slicing request.
  kPitchInvalid = 200,           // Zero, negative or non-finite voxel pitch.
  kGridTooLarge = 201,           // More voxels, columns, rows or layers than the limits allow.
  kPlacementSingular = 202,      // Placement not finite, or not invertible.
  kLayerRangeEmpty = 203,        // No layers asked for.
  kLayerRangeOutOfBounds = 204,  // Layers outside [0, layer_count).
  kToleranceInvalid = 205,       // Tolerance not finite, not positive or out of its range.
  kContentInvalid = 206,         // No planes, unknown channel, value range empty or non-finite.
  kEncodingUnsupported = 207,    // A sample type or encoding that can't be combined, or isn't built in.
  kParameterInvalid = 208,       // Unknown limit cell, or (u,v,w) outside [0,1]^3, or a point that isn't finite.
  // 3xx: execution.
  kCancelled = 300,  // The caller cancelled, or its deadline passed.
  kInternal = 301,   // A broken invariant of ours: please report.
  // 4xx: files (client side and tools).
  kFileUnreadable = 400,   // Can't open or read.
  kFileSyntax = 401,       // Line and token named.
  kFileUnsupported = 402,  // A valid file of a kind that isn't read yet.
  kFileUnwritable = 403,   // Can't create or write.
};

/// Upper-case snake-case name, e.g. "MESH_NON_FINITE". Stable.
std::string_view reason(ErrorCode code);

class Error : public std::runtime_error {
 public:
  /// `field`: request or mesh field at fault ("" if none). `ids`: offending ids, at most a handful, in ascending order.
  Error(ErrorCode code, const std::string& message, std::string field = {}, std::vector<std::int64_t> ids = {})
      : std::runtime_error(message), code_(code), field_(std::move(field)), ids_(std::move(ids)) {}

  ErrorCode code() const noexcept { return code_; }
  const std::string& field() const noexcept { return field_; }
  const std::vector<std::int64_t>& ids() const noexcept { return ids_; }

 private:
  ErrorCode code_;
  std::string field_;
  std::vector<std::int64_t> ids_;
};

}  // namespace ccslice
