// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/error.h"

namespace ccslice {

// NOLINTNEXTLINE(readability-function-size): a line for each code.
std::string_view reason(ErrorCode code) {
  switch (code) {
    case ErrorCode::kMeshMalformed: return "MESH_MALFORMED";
    case ErrorCode::kMeshEmpty: return "MESH_EMPTY";
    case ErrorCode::kMeshTooLarge: return "MESH_TOO_LARGE";
    case ErrorCode::kMeshNonFinite: return "MESH_NON_FINITE";
    case ErrorCode::kMeshIndexOutOfRange: return "MESH_INDEX_OUT_OF_RANGE";
    case ErrorCode::kMeshRepeatedVertex: return "MESH_REPEATED_VERTEX";
    case ErrorCode::kMeshUnsupportedCell: return "MESH_UNSUPPORTED_CELL";
    case ErrorCode::kMeshNonManifoldFace: return "MESH_NON_MANIFOLD_FACE";
    case ErrorCode::kMeshNonManifoldEdge: return "MESH_NON_MANIFOLD_EDGE";
    case ErrorCode::kMeshNonManifoldVertex: return "MESH_NON_MANIFOLD_VERTEX";
    case ErrorCode::kMeshSharedFaces: return "MESH_SHARED_FACES";
    case ErrorCode::kMeshInvertedCell: return "MESH_INVERTED_CELL";
    case ErrorCode::kMeshIsolatedVertex: return "MESH_ISOLATED_VERTEX";
    case ErrorCode::kMeshBadSharpFeature: return "MESH_BAD_SHARP_FEATURE";
    case ErrorCode::kMeshBadChannel: return "MESH_BAD_CHANNEL";
    case ErrorCode::kMeshValenceTooHigh: return "MESH_VALENCE_TOO_HIGH";
    case ErrorCode::kMeshUnknownField: return "MESH_UNKNOWN_FIELD";
    case ErrorCode::kMeshArrayMismatch: return "MESH_ARRAY_MISMATCH";
    case ErrorCode::kMeshUnknownCellKind: return "MESH_UNKNOWN_CELL_KIND";
    case ErrorCode::kMeshCoordinateOutOfRange: return "MESH_COORDINATE_OUT_OF_RANGE";
    case ErrorCode::kMeshTooComplex: return "MESH_TOO_COMPLEX";
    case ErrorCode::kMeshNotInterpolable: return "MESH_NOT_INTERPOLABLE";
    case ErrorCode::kMeshBadCellRegion: return "MESH_BAD_CELL_REGION";
    case ErrorCode::kMeshNonManifoldRegion: return "MESH_NON_MANIFOLD_REGION";
    case ErrorCode::kMeshBadMidNode: return "MESH_BAD_MID_NODE";
    case ErrorCode::kVolumeInvalid: return "VOLUME_INVALID";
    case ErrorCode::kPitchInvalid: return "PITCH_INVALID";
    case ErrorCode::kGridTooLarge: return "GRID_TOO_LARGE";
    case ErrorCode::kPlacementSingular: return "PLACEMENT_SINGULAR";
    case ErrorCode::kLayerRangeEmpty: return "LAYER_RANGE_EMPTY";
    case ErrorCode::kLayerRangeOutOfBounds: return "LAYER_RANGE_OUT_OF_BOUNDS";
    case ErrorCode::kToleranceInvalid: return "TOLERANCE_INVALID";
    case ErrorCode::kContentInvalid: return "CONTENT_INVALID";
    case ErrorCode::kEncodingUnsupported: return "ENCODING_UNSUPPORTED";
    case ErrorCode::kParameterInvalid: return "PARAMETER_INVALID";
    case ErrorCode::kPitchMissing: return "PITCH_MISSING";
    case ErrorCode::kPitchOutOfRange: return "PITCH_OUT_OF_RANGE";
    case ErrorCode::kGridTooManyLayers: return "GRID_TOO_MANY_LAYERS";
    case ErrorCode::kGridLayerTooLarge: return "GRID_LAYER_TOO_LARGE";
    case ErrorCode::kLayerBytesTooLarge: return "LAYER_BYTES_TOO_LARGE";
    case ErrorCode::kGridExtentZero: return "GRID_EXTENT_ZERO";
    case ErrorCode::kGridOriginNonFinite: return "GRID_ORIGIN_NON_FINITE";
    case ErrorCode::kGridOriginOutOfRange: return "GRID_ORIGIN_OUT_OF_RANGE";
    case ErrorCode::kPlacementNonFinite: return "PLACEMENT_NON_FINITE";
    case ErrorCode::kPlacementOutOfRange: return "PLACEMENT_OUT_OF_RANGE";
    case ErrorCode::kNothingRequested: return "NOTHING_REQUESTED";
    case ErrorCode::kTooManyPlanes: return "TOO_MANY_PLANES";
    case ErrorCode::kChannelUnknown: return "CHANNEL_UNKNOWN";
    case ErrorCode::kValueRangeInvalid: return "VALUE_RANGE_INVALID";
    case ErrorCode::kValueRangeUnexpected: return "VALUE_RANGE_UNEXPECTED";
    case ErrorCode::kEnumValueUnknown: return "ENUM_VALUE_UNKNOWN";
    case ErrorCode::kTooManyTriangles: return "TOO_MANY_TRIANGLES";
    case ErrorCode::kLimitCellUnknown: return "LIMIT_CELL_UNKNOWN";
    case ErrorCode::kPointNonFinite: return "POINT_NON_FINITE";
    case ErrorCode::kChannelRepeated: return "CHANNEL_REPEATED";
    case ErrorCode::kMaterialsMissing: return "MATERIALS_MISSING";
    case ErrorCode::kTooManyMaterials: return "TOO_MANY_MATERIALS";
    case ErrorCode::kMaterialNameInvalid: return "MATERIAL_NAME_INVALID";
    case ErrorCode::kMaterialNameRepeated: return "MATERIAL_NAME_REPEATED";
    case ErrorCode::kMaterialColourRepeated: return "MATERIAL_COLOUR_REPEATED";
    case ErrorCode::kMaterialUnknown: return "MATERIAL_UNKNOWN";
    case ErrorCode::kMaterialMapMissing: return "MATERIAL_MAP_MISSING";
    case ErrorCode::kMaterialMapInvalid: return "MATERIAL_MAP_INVALID";
    case ErrorCode::kMaterialMapNonFinite: return "MATERIAL_MAP_NON_FINITE";
    case ErrorCode::kFractionsOutOfRange: return "FRACTIONS_OUT_OF_RANGE";
    case ErrorCode::kPartsMissing: return "PARTS_MISSING";
    case ErrorCode::kRegionNonFinite: return "REGION_NON_FINITE";
    case ErrorCode::kRegionEmpty: return "REGION_EMPTY";
    case ErrorCode::kRegionOutOfGrid: return "REGION_OUT_OF_GRID";
    case ErrorCode::kCellRegionsMissing: return "CELL_REGIONS_MISSING";
    case ErrorCode::kCellRegionUnknown: return "CELL_REGION_UNKNOWN";
    case ErrorCode::kOutsideSampleInvalid: return "OUTSIDE_SAMPLE_INVALID";
    case ErrorCode::kPlaneInvalid: return "PLANE_INVALID";
    case ErrorCode::kPictureTooLarge: return "PICTURE_TOO_LARGE";
    case ErrorCode::kTooManyParts: return "TOO_MANY_PARTS";
    case ErrorCode::kPartNameInvalid: return "PART_NAME_INVALID";
    case ErrorCode::kPartsOverlap: return "PARTS_OVERLAP";
    case ErrorCode::kFieldInvalid: return "FIELD_INVALID";
    case ErrorCode::kCancelled: return "CANCELLED";
    case ErrorCode::kInternal: return "INTERNAL";
    case ErrorCode::kFileUnreadable: return "FILE_UNREADABLE";
    case ErrorCode::kFileSyntax: return "FILE_SYNTAX";
    case ErrorCode::kFileUnsupported: return "FILE_UNSUPPORTED";
    case ErrorCode::kFileUnwritable: return "FILE_UNWRITABLE";
  }
  return "INTERNAL";
}

}  // namespace ccslice
