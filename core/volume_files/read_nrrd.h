// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// NRRD files, .nrrd and .nhdr [Definition of NRRD File Format, teem.sourceforge.net/nrrd/format.html].
//
// Axes with a direction, or all of three without any, are i, j and k. One axis more, the first or the last one, holds
// channels. Spaces with left or right, posterior or anterior, superior or inferior are turned to LPS.

#pragma once

#include <string>
#include <string_view>

#include "core/volume_files/volume_file.h"

namespace ccslice {

/// `path`: of the file, to find a data file in its folder. Throws Error{kFileSyntax, kFileUnsupported, kFileUnreadable,
/// kVolumeInvalid, kMeshTooLarge}.
VolumeFile read_nrrd(std::string_view bytes, const std::string& path);

}  // namespace ccslice
