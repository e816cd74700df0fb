// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// .gcvf, the archive that GrabCAD Print's voxel printing takes: a zip of layer_0.png, layer_1.png, ... (RGBA, from 0,
// without gaps, not padded) and ConfigFile.xml, which says how large voxels are and what the colours stand for.
//
// The format isn't published. Root and fields are those that public writers and viewers of such archives agree on:
// GCVF with Version, Resolution, SliceDimensions, SliceRange, BitDepth, MaxNumberOfColors, DataSemantics,
// CreationMode, ImageFilePrefix and MaterialList. No printer's software has read a file of ours yet.

#pragma once

#include <cstdint>
#include <filesystem>

#include "client/cli/output/layer_stack.h"

namespace ccslice::cli {

/// Returns the file's size. Materials without a voxel are left out. Throws Error{kFileUnsupported}, which names the
/// remedy, unless the stack has an RGBA plane of materials, at most six materials, all opaque, an opaque black
/// background, and a pitch of whole dots an inch along x and y. Throws Error{kFileUnwritable} and as LayerStack.
std::uint64_t write_gcvf(const LayerStack& stack, const std::filesystem::path& path);

}  // namespace ccslice::cli
