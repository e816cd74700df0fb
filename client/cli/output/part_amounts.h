// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How much there is of each part of a job, and where parts overlap.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/client.h"

namespace ccslice::cli {

/// The name that messages have for a part or copy. `placed`: counted over the placements of all parts.
std::string name_of_placed(const v1::SliceJob& job, std::uint32_t placed);

/// The amounts of parts in the job's order; none if nothing counts them. `materials`: the names and colours of those
/// that are pictured.
std::vector<v1::PartAmount> part_amounts(const v1::SliceJob& job, const client::SliceOutcome& counts, double voxel_cm3,
                                         const std::vector<v1::MaterialVoxels>& materials);
/// Pairs of parts or copies that share voxels.
std::vector<v1::PartPair> part_pairs(const v1::SliceJob& job, const client::SliceOutcome& counts, double voxel_cm3);

/// A line for each part of several, and for those that are too many to read one line; empty for one part.
std::string part_amounts_text(const v1::SliceJob& job, const client::SliceOutcome& outcome,
                              const std::string& indent = "");
/// Which parts overlap, by how much, and where; empty if none do.
std::string part_pairs_text(const v1::SliceJob& job, const client::SliceOutcome& outcome);

}  // namespace ccslice::cli
