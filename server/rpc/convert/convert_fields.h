// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields of a job: messages -> sources of channels.

#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include "ccslice/v1/job.pb.h"
#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"

namespace ccslice::server {

inline constexpr int kMaxFields = 16;

using Fields = google::protobuf::RepeatedPtrField<v1::Field>;

/// The sources of a part. `world_box`: what its voxels lie in, mm. Throws Error{kFieldInvalid, kEnumValueUnknown,
/// kValueRangeInvalid, kChannelRepeated} of fields "fields[i]...".
ChannelSources to_sources(const Fields& messages, const SolidSummary& solid, const Box3& world_box);

}  // namespace ccslice::server
