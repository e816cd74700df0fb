// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// NumPy's files, .npy [numpy/lib/format.py].
//
// Axes are z, y, x, as a stack of pictures has them, or x, y, z where that is said; a fourth one, the last, holds
// channels. A file of one array of two axes is a volume of one layer.

#pragma once

#include <string>
#include <string_view>

#include "core/volume_files/volume_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kVolumeInvalid, kMeshTooLarge}.
VolumeFile read_npy(std::string_view bytes, bool axes_are_xyz = false);

}  // namespace ccslice
