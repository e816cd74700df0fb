// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// 3MF with the Volumetric Extension 1.0 (3MF Consortium): the boundary as a mesh, and in it continuous mixing ratios,
// each an image3d of grey (Y) PNG sheets. No palette and no halftone: the printer's software mixes.
//
//   [Content_Types].xml, _rels/.rels
//   3D/3dmodel.model                       mesh, base materials, mixing ratios
//   3D/_rels/3dmodel.model.rels            a relationship for every sheet
//   3D/volumetric/ratio0/sheet00000.png    the pictures as they were sliced
//   3D/volumetric/colour/sheet00000.png    the colours that the mixed materials have, in linear light
//
// Besides the mixing ratios (v:composite), which few programs read, the file says the same in other ways: v:color is
// the colour of the mixture, and each v:property a channel in its own unit.
//
// Every 8-bit grey picture of a channel is the ratio of a material of the channel's name, 0 to 1. With one channel
// there is a second material, `rest`, which takes what is left of 1.
//
// The first row of a picture has the lowest y, unless the job's layout says otherwise, while V = 1 is the first row of
// a 3MF sheet: the transform turns V round, and U where columns descend.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "client/cli/base/xml.h"
#include "client/cli/output/layer_stack.h"
#include "client/cli/output/zip_file.h"
#include "client/surface.h"

namespace ccslice::cli {

inline constexpr const char* kThreeMfCore = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";

/// Adds the mesh of an object that was begun.
void add_three_mf_mesh(const client::Surface& surface, XmlWriter& xml);

/// Adds what every package begins with, and its model.
void add_three_mf_start(ZipFile& zip, const std::string& model);

/// `boundary`: placed as the stack is. Returns the file's size. Throws Error{kFileUnwritable, kFileUnsupported, as
/// LayerStack}.
std::uint64_t write_three_mf(const LayerStack& stack, const client::Surface& boundary,
                             const std::filesystem::path& path);

/// Throws Error{kFileUnsupported} if the stack has no pictures for it, or is a part of the grid.
void require_three_mf_stack(const LayerStack& stack);

}  // namespace ccslice::cli
