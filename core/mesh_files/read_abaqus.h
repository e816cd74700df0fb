// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Abaqus input files .inp, as Abaqus's keywords guide and CalculiX's manual have them: *NODE and *ELEMENT, in the file
// itself, in files that it includes (*INCLUDE, INPUT=), or in parts (*PART) that an assembly places (*INSTANCE: a
// translation, then a rotation). Instances have nodes of their own where they touch.
//
// Read: solids of 4 to 6 and 8 nodes (C3D4 to C3D8 and their variants, DC3D..., AC3D..., EC3D..., SC6R, SC8R), and
// those of second order (10, 15 to 18, 20 to 27 nodes) by their corners. Left out and reported: all other elements,
// sets, and whatever else describes an analysis. Refused: pyramids of second order, keywords that make nodes or
// elements when Abaqus runs, and coordinates that aren't rectangular.

#pragma once

#include <string>
#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// `path` is where the bytes come from; without it files can't include others. Throws Error{kFileSyntax,
/// kFileUnsupported, kFileUnreadable, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell, kMeshIndexOutOfRange,
/// kMeshEmpty}, which names the line, and the file if it is an included one.
MeshFile read_abaqus(std::string_view bytes, const MeshLimits& limits = {}, const FileOrigin& origin = {});

}  // namespace ccslice
