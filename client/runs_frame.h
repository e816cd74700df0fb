// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// PLANE_ENCODING_RUNS_ZSTD: from the spans of a plane and the samples inside them to all of its samples. docs/runs.md
// describes the frame.

#pragma once

#include <cstdint>
#include <string>

#include "ccslice/v1/job.pb.h"

namespace ccslice::client {

/// The samples of a frame's content (after zstd), rows as in PLANE_ENCODING_RAW. `bytes`: as many as the grid's samples
/// have. Takes that, and the memory of some rows. Throws ClientError{DATA_LOSS, ANSWER_CORRUPT}.
std::string expand_runs(const v1::PlaneSpec& spec, const v1::GridExtent& extent, const std::string& content,
                        std::uint64_t bytes);

/// More than the content of any such frame has.
std::uint64_t most_runs_bytes(const v1::GridExtent& extent, std::uint64_t sample_bytes);

}  // namespace ccslice::client
