// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Stacks of PNG pictures as volumes. Pictures are layers k in their order. Row 0, on top, is j = 0, as in the layers
// that ccslice writes. Samples of up to 8 bits become 8 bits, those of 16 stay; palettes become colours.

#pragma once

#include <string>
#include <vector>

#include "core/volume_files/volume_file.h"

namespace ccslice::cli {

/// `paths`: in the order of layers; all of one size and number of channels. Throws Error{kFileUnreadable, kFileSyntax,
/// kVolumeInvalid, kMeshTooLarge}, which begins with the path.
VolumeFile read_image_stack(const std::vector<std::string>& paths);

}  // namespace ccslice::cli
