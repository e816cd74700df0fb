// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What GrabCAD's Voxel Print takes: a folder of pictures slice_0.png, slice_1.png, ... without gaps, all of one size,
// the highest y on top, in 8-bit RGBA, where every voxel has exactly the colour of one of up to 6 materials or of the
// background, all opaque. It asks which resin each colour is. Known from its users' programs and from what it was seen
// to refuse; its format isn't published.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "client/cli/options/job.h"
#include "client/cli/options/printing.h"
#include "client/cli/output/layer_files.h"

namespace ccslice::cli {

inline constexpr std::size_t kMostGrabcadMaterials = 6;
/// A colour, besides the background's, that voxels may have in pictures if they are left empty.
inline constexpr std::uint32_t kGrabcadVoid = 0;
inline constexpr std::uint32_t kFewestGrabcadLayers = 30;

/// Sets what of a job's options GrabCAD needs and the user hasn't said. Throws UsageError, naming the option, for what
/// it doesn't take.
void fit_to_grabcad(LayoutOptions& layout, PlaneOptions& planes);
/// Throws UsageError for materials that it doesn't take. `printing`: null if there are none.
void require_grabcad_materials(const v1::Printing* printing);
/// Throws UsageError for a job of a file that isn't made for it.
void require_grabcad_job(const v1::SliceJob& job);
/// A warning for people about names that it doesn't know; empty if there are none.
std::string unknown_resins(const v1::Printing& printing);

/// slice_0.png, slice_1.png, ... `first_layer`: of the job, in its grid.
LayerNames grabcad_names(std::uint32_t first_layer);

}  // namespace ccslice::cli
