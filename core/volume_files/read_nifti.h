// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// NIfTI-1 files, .nii and .nii.gz [nifti.nimh.nih.gov, nifti1.h].
//
// The place of samples is that of sform, or else of qform, turned from RAS to LPS. Without both it is pixdim's alone.
// Times and components are channels.

#pragma once

#include <string>
#include <string_view>

#include "core/volume_files/volume_file.h"

namespace ccslice {

/// Whether the bytes, unpacked, are such a file's.
bool is_nifti(std::string_view bytes) noexcept;

/// `bytes`: unpacked, or a gzip file's. Throws Error{kFileSyntax, kFileUnsupported, kVolumeInvalid, kMeshTooLarge}.
VolumeFile read_nifti(std::string_view bytes);

}  // namespace ccslice
