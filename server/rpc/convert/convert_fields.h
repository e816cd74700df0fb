// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields of a job: messages -> sources of channels.

#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <memory>

#include "ccslice/v1/job.pb.h"
#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"

namespace ccslice::server {

inline constexpr int kMaxFields = 16;

using Fields = google::protobuf::RepeatedPtrField<v1::Field>;

/// The sources of a part. `placed` turns and sizes it, and its voxels lie in `world_box`, mm. Throws
/// Error{kFieldInvalid, kEnumValueUnknown, kValueRangeInvalid, kChannelRepeated, kTooManyTriangles} of fields
/// "fields[i]...".
ChannelSources to_sources(const Fields& messages, const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed,
                          const Box3& world_box);
/// Whether how a part is turned and sized makes a difference to them.
bool depend_on_placement(const Fields& messages);

}  // namespace ccslice::server
