// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// MetaImage files, .mha and .mhd [Kitware/MetaIO, src/metaImage.cxx; ITK, itkMetaImageIO.cxx].
//
// Row r of TransformMatrix is the direction of axis r, and Offset is the centre of the first sample, both in a
// patient's frame (LPS).

#pragma once

#include <string>
#include <string_view>

#include "core/volume_files/volume_file.h"

namespace ccslice {

/// `path`: of the file, to find a data file in its folder. Throws Error{kFileSyntax, kFileUnsupported, kFileUnreadable,
/// kVolumeInvalid, kMeshTooLarge}.
VolumeFile read_meta_image(std::string_view bytes, const std::string& path);

}  // namespace ccslice
