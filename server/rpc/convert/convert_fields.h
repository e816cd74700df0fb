// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields of a job: messages -> sources of channels.

#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <memory>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

inline constexpr int kMaxFields = 16;

using Fields = google::protobuf::RepeatedPtrField<v1::Field>;

/// The ids of volumes that fields name, each once; `path` is before "fields[i]" in messages. Throws
/// Error{kFieldInvalid} if there are too many fields, ServiceError{kMeshIdInvalid}.
std::vector<std::string> volume_ids_of(const Fields& messages, const std::string& path = {});

/// The sources of a part. `volumes`: of volume_ids_of(). `placed` turns and sizes it, and its voxels lie in
/// `world_box`, mm. Throws Error{kFieldInvalid, kEnumValueUnknown, kValueRangeInvalid, kChannelRepeated,
/// kTooManyTriangles} of fields "fields[i]...".
ChannelSources to_sources(const Fields& messages, const Volumes& volumes,
                          const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed, const Box3& world_box);
/// Whether how a part is turned and sized makes a difference to them.
bool depend_on_placement(const Fields& messages);

}  // namespace ccslice::server
