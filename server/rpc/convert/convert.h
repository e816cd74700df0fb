// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages <-> values of the core. Pure. What can't be converted throws Error or ServiceError naming the field; whether
// values make sense is for the core to say.

#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/geometry.pb.h"
#include "ccslice/v1/job.pb.h"
#include "ccslice/v1/mesh.pb.h"
#include "ccslice/v1/slice.pb.h"
#include "core/base/types.h"
#include "core/channel/channel_table.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/cell_kind.h"
#include "core/output/encodings.h"

namespace ccslice::server {

/// The placement of a solid with this box, checked alike for every call. Throws ServiceError{kRequestMalformed} for
/// other than 0 or 12 numbers, and what the core's validate_placement() throws.
Placement to_placement(const v1::Placement& message, const Box3& solid_box, const SliceLimits& limits);
Vec3 to_vec3(const v1::Vector3& message);
/// Throws Error{kPitchMissing}.
GridRequest to_grid_request(const v1::GridSpec& message);
/// The region that is asked for. Throws Error{kRegionNonFinite, kRegionEmpty, kRegionOutOfGrid}.
VoxelBox to_region(const v1::Region& message, const Grid& grid);
/// Throws Error{kEnumValueUnknown}.
PictureOrder to_order(const v1::PictureLayout& message);
/// The layout with defaults filled in.
v1::PictureLayout with_defaults(const v1::PictureLayout& message);
/// The planes with defaults filled in. `printing` is that of the job. Throws Error{kContentInvalid, kMaterialUnknown,
/// kEnumValueUnknown}.
std::vector<PlaneSpec> to_planes(const google::protobuf::RepeatedPtrField<v1::PlaneSpec>& messages,
                                 const SolidSummary& solid, const std::optional<Printing>& printing);

v1::SampleType to_message(SampleType type);
v1::Vector3 to_message(const Vec3& value);
v1::Box3 to_message(const Box3& value);
v1::VoxelPitch to_message(const VoxelPitch& value);
v1::Grid to_message(const Grid& value);
v1::VoxelBox to_message(const VoxelBox& value);
v1::PlaneSpec to_message(const PlaneSpec& value, const ChannelTable& channels, const std::optional<Printing>& printing);
v1::CellKind to_message(const CellKindTraits& value);
v1::PlaneEncoding to_message(const EncodingTraits& value);
v1::Channel to_message(const ChannelRange& value);
v1::CellRegion to_message(const CellRegionSummary& value);
v1::FoldPlace to_message(const FoldPlace& value);
v1::Overlaps to_message(const Overlaps& value);
v1::LimitDeviation to_message(const Deviation& value);
v1::LayerStatistics to_message(const LayerStats& value);
google::protobuf::Duration to_duration(std::chrono::nanoseconds value);
google::protobuf::Timestamp to_timestamp(std::chrono::system_clock::time_point value);

}  // namespace ccslice::server
