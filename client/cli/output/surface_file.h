// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangulated surfaces as files, in memory.

#pragma once

#include <string>

#include "client/surface.h"

namespace ccslice::cli {

/// Binary STL: an 80-byte header, the number of triangles, and for each of them its normal and its corners as floats.
/// Corners that are the same vertex get the same numbers, and triangles that the rounding to floats makes degenerate
/// are left out with both of their sides, so joining equal corners gives a closed, oriented surface.
std::string to_stl(const client::Surface& surface);

/// Legacy VTK, binary: POLYDATA with every channel as point data. Names are written as VTK does, "%20" for a blank.
std::string to_vtk(const client::Surface& surface);

/// The volume that the surface encloses.
double volume_mm3(const client::Surface& surface);

}  // namespace ccslice::cli
