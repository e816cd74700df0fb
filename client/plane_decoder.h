// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the bytes of an encoded plane to its samples.

#pragma once

#include <cstdint>

#include "ccslice/v1/job.pb.h"
#include "client/layer.h"

namespace ccslice::client {

/// Throws ClientError{DATA_LOSS, ANSWER_CORRUPT} if no encoder makes so many bytes of such a plane. There is room for
/// twice what is in them.
void require_possible_size(const v1::PlaneSpec& spec, const v1::GridExtent& extent, std::uint64_t encoded_bytes);

/// Fills plane.samples from plane.encoded and checks size and checksum. The size follows from the grid, so what a
/// server claims is never allocated unseen. Throws ClientError{DATA_LOSS, ANSWER_CORRUPT}.
void decode_plane(const v1::GridExtent& extent, Plane& plane);

}  // namespace ccslice::client
