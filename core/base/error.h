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

/// Numbered by segment: 1xx control mesh or volume, 2xx slicing request, 3xx execution, 4xx files. Numbers never change
/// meaning.
enum class ErrorCode : int {
  // 1xx: the control mesh, or the volume.
  kMeshMalformed = 100,             // Bytes that don't parse.
  kMeshEmpty = 101,                 // No cells or no vertices.
  kMeshTooLarge = 102,              // More vertices, cells, channels, cell regions or bytes than the limits allow.
  kMeshNonFinite = 103,             // NaN or infinite position or channel value.
  kMeshIndexOutOfRange = 104,       // A cell, sharp edge, sharp or missed vertex names a vertex that doesn't exist.
  kMeshRepeatedVertex = 105,        // A cell names the same vertex twice, or missed vertices don't ascend.
  kMeshUnsupportedCell = 106,       // Pyramids and other cells that never refine to hexahedra.
  kMeshNonManifoldFace = 107,       // A face in more than two cells.
  kMeshNonManifoldEdge = 108,       // A boundary edge with other than two boundary faces.
  kMeshNonManifoldVertex = 109,     // A vertex whose cells form neither one ball nor one half-ball.
  kMeshSharedFaces = 110,           // Two cells that share more than one face (or an interior edge of valence 2).
  kMeshInvertedCell = 111,          // A corner of non-positive Jacobian, with allow_folds unset.
  kMeshIsolatedVertex = 112,        // A vertex that no cell uses.
  kMeshBadSharpFeature = 113,       // A sharp edge or vertex inside the solid or a region, or named twice.
  kMeshBadChannel = 114,            // Channel names empty, repeated, or too long.
  kMeshValenceTooHigh = 115,        // More cells round an edge or a vertex than the limits allow.
  kMeshUnknownField = 116,          // A field that this version doesn't know.
  kMeshArrayMismatch = 117,         // Array lengths that don't fit together.
  kMeshUnknownCellKind = 118,       // A number that is no cell kind.
  kMeshCoordinateOutOfRange = 119,  // A position farther from the origin than the limits allow.
  kMeshTooComplex = 120,            // More entries than 32-bit numbers can count.
  kMeshNotInterpolable = 121,       // No control points take the limit through all vertices, or only with folds.
  kMeshBadCellRegion = 122,         // Names of cell regions empty, repeated or too long; a number that is none of them.
  kMeshNonManifoldRegion = 123,     // A vertex where the cells of one region form neither balls nor half-balls.
  kMeshBadMidNode = 124,            // A mid-node of no edge, quadrilateral or hexahedron, or one too many.
  kVolumeInvalid = 125,             // A volume that can't be read, or without the samples that it promises.
  // 2xx: the slicing request.
  kPitchInvalid = 200,            // Zero, negative or non-finite voxel pitch.
  kGridTooLarge = 201,            // More columns or rows than the limits allow.
  kPlacementSingular = 202,       // Placement not invertible.
  kLayerRangeEmpty = 203,         // No layers asked for.
  kLayerRangeOutOfBounds = 204,   // Layers outside [0, layer_count).
  kToleranceInvalid = 205,        // Tolerance not finite, not positive or out of its range.
  kContentInvalid = 206,          // A plane without content.
  kEncodingUnsupported = 207,     // A sample type and an encoding or content that can't be combined, or isn't built in.
  kParameterInvalid = 208,        // (u,v,w) outside [0,1]^3.
  kPitchMissing = 209,            // No voxel pitch.
  kPitchOutOfRange = 210,         // Voxel pitch outside the limits.
  kGridTooManyLayers = 211,       // More layers than the limits allow.
  kGridLayerTooLarge = 212,       // More voxels in a layer than the limits allow.
  kLayerBytesTooLarge = 213,      // More bytes of samples in a layer than the limits allow.
  kGridExtentZero = 214,          // No columns, rows or layers.
  kGridOriginNonFinite = 215,     // NaN or infinite origin of the grid.
  kGridOriginOutOfRange = 216,    // Origin of the grid farther from the world's than the limits allow.
  kPlacementNonFinite = 217,      // NaN or infinite entry of a placement.
  kPlacementOutOfRange = 218,     // A scale, a translation or the placed part outside the limits.
  kNothingRequested = 219,        // Neither planes nor contours.
  kTooManyPlanes = 220,           // More planes than the limits allow.
  kChannelUnknown = 221,          // A channel that the mesh doesn't have.
  kValueRangeInvalid = 222,       // Value range empty or not finite.
  kValueRangeUnexpected = 223,    // Value range for samples that have none.
  kEnumValueUnknown = 224,        // A number that is no value of the field's enumeration.
  kTooManyTriangles = 225,        // More triangles than the limits allow at this tolerance.
  kLimitCellUnknown = 226,        // A limit cell that the solid doesn't have.
  kPointNonFinite = 227,          // NaN or infinite point.
  kChannelRepeated = 228,         // A plane that names a channel twice, or two channels of one name.
  kMaterialsMissing = 229,        // Materials to show, but none that the printer holds.
  kTooManyMaterials = 230,        // More than 8 of them.
  kMaterialNameInvalid = 231,     // A name that is empty or too long.
  kMaterialNameRepeated = 232,    // Two of one name.
  kMaterialColourRepeated = 233,  // Two of one colour, or one of the background's.
  kMaterialUnknown = 234,         // A map or mask names a material that isn't there.
  kMaterialMapMissing = 235,      // Several materials and no map.
  kMaterialMapInvalid = 236,      // A map without kind, or with entries that can't be.
  kMaterialMapNonFinite = 237,    // NaN or infinity in a map.
  kFractionsOutOfRange = 238,     // Strict maps: values that give no fractions.
  kPartsMissing = 239,            // A job without parts.
  kRegionNonFinite = 240,         // NaN or infinite corner of a region.
  kRegionEmpty = 241,             // A region without voxels.
  kRegionOutOfGrid = 242,         // A region outside of the grid.
  kCellRegionsMissing = 243,      // A plane of cell regions of a mesh that has none.
  kCellRegionUnknown = 244,       // A map for a cell region that the mesh doesn't have.
  kOutsideSampleInvalid = 245,    // What is to be outside is no sample of the plane.
  kPlaneInvalid = 246,            // Axes that aren't orthonormal, or a plane that isn't finite.
  kPictureTooLarge = 247,         // A picture of no pixels, or of too many.
  kTooManyParts = 248,            // More placed parts in a job than can be sliced together.
  kPartNameInvalid = 249,         // A name of a part that is empty, too long, or another one's.
  kPartsOverlap = 250,            // A voxel in several parts, where that is refused.
  kFieldInvalid = 251,            // A field without name, kind or bounds, or a formula that can't be read.
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
  /// `field`: the field at fault, such as "cell_vertices[17]" of a mesh or "planes[2].value_range" of a job ("" if
  /// none).
  /// `ids`: offending ids, at most a handful, in ascending order.
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
