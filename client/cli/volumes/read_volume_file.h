// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Volumes from files. The kind of a file is told from its first bytes, never from its name.

#pragma once

#include <string>

#include "core/volume_files/volume_file.h"

namespace ccslice::cli {

struct VolumeFileOptions {
  bool axes_are_xyz = false;  // Files of other kinds are refused then.
};

/// Reads NRRD, MetaImage, NIfTI-1 and .npy files, PNG pictures, folders of them, and those whose names match a pattern
/// such as "layers/slice_*.png". Throws Error{4xx, kVolumeInvalid,
/// kMeshTooLarge}, which begins with the path.
VolumeFile read_volume_file(const std::string& path, const VolumeFileOptions& options = {});

}  // namespace ccslice::cli
