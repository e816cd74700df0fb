// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Serialized Volume -> Volume, straight from the wire: samples are unpacked as they are read, so that they are in
// memory once.

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/volume/volume.h"

namespace ccslice::server {

/// Memory that reading takes at most besides the samples: zstd's window, and its tables.
inline constexpr std::uint64_t kVolumeReadingBytes = 12 << 20;

/// Whether the bytes are a Volume's, rather than a ControlMesh's: their first field says so.
bool holds_volume(const std::vector<std::string>& blocks);

/// `blocks`: the bytes, cut anywhere. `reserve(bytes)` is called before memory for the samples is taken, and may throw.
/// REQUIRES: less than 2 GiB. Throws Error{kVolumeInvalid, kCancelled}.
Volume read_volume(const std::vector<std::string>& blocks, const std::function<void(std::uint64_t bytes)>& reserve,
                   const CancellationToken& cancel = {});

}  // namespace ccslice::server
