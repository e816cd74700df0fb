// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// .gcvf, the archive that GrabCAD Print's voxel printing takes: layer_0.png, layer_1.png, ... and ConfigFile.xml, which
// says what the colours stand for. EXPERIMENTAL: the format isn't published, and what is known of it is that much; no
// printer's software has read a file of ours.

#pragma once

#include <cstdint>
#include <filesystem>

#include "client/cli/layer_stack.h"

namespace ccslice::cli {

/// Of a stack with an RGBA plane of materials. Returns the file's size. Throws Error{kFileUnwritable, kFileUnsupported,
/// as LayerStack}.
std::uint64_t write_gcvf(const LayerStack& stack, const std::filesystem::path& path);

}  // namespace ccslice::cli
