// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From a job's message to the parts that the core takes: what all have in common once, and for each part the numbers
// that names of channels and cell regions stand for in its mesh. Pure.

#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "core/base/cancellation.h"
#include "core/job/copies.h"
#include "core/job/placed_part.h"
#include "core/job/slice_limits.h"
#include "core/limit/limit_solid.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

/// The field of a part within its job.
inline std::string path_of_part(int part) { return "parts[" + std::to_string(part) + "]"; }

/// The meshes of the parts of the job at `path` of a request, in the order of its parts, then the volumes that its
/// fields name. Throws Error{kPartsMissing, kTooManyParts, kPartNameInvalid}, ServiceError{kMeshIdInvalid}.
std::vector<std::string> mesh_ids_of(const v1::SliceJob& job, const std::string& path);

/// Does check(part) for each part of the message. Error{kChannelUnknown} of one part names all that lack the channel.
void check_parts(const v1::SliceJob& job, const std::function<void(int part)>& check);

/// Which part of the message, and which of its placements.
struct PartPlace {
  int part = 0, placement = 0;
};

/// By the number of the placed part.
std::vector<PartPlace> part_places(const v1::SliceJob& job);

/// The placed parts of the job at `path` of a request, in the order of part_places(), valid and within the limits.
/// `solids`: of the parts. Throws Error (2xx), ServiceError{kRequestMalformed, kPrinterUnknown, kPrinterInvalid}. Takes
/// a while for large meshes: throws Error{kCancelled}. `snapped`: takes what SliceJob.snap moves. `volumes`:
/// those that fields name. REQUIRES: mesh_ids_of() passes.
PlacedParts to_placed_parts(const v1::SliceJob& message, const std::string& path,
                            std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                            const CancellationToken& cancel, SnappedCopies* snapped = nullptr,
                            const Volumes& volumes = {});

/// What is printed, with defaults filled in, but for what parts have of their own. REQUIRES: to_placed_parts() made
/// `parts` of the message; it has printing.
v1::Printing printing_with_defaults(const v1::SliceJob& message, const PlacedParts& parts);

}  // namespace ccslice::server
