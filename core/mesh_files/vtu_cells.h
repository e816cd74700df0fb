// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The arrays that make up the cells of a piece of a .vtu file: connectivity, offsets and types, and of polyhedra their
// faces, in either layout [VTK 9.5, IO/XML/vtkXMLUnstructuredDataReader.cxx]:
//
//   up to 2.2  `faces`, of each polyhedron the number of its faces, then each as the number of its points and these;
//              `faceoffsets`, where each cell's end there, -1 for cells that are no polyhedra
//   from 2.3   `face_connectivity` and `face_offsets`, the points of all faces and where each one's end;
//              `polyhedron_to_faces` and `polyhedron_offsets`, the faces of all cells and where each one's end

#pragma once

#include <cstdint>
#include <pugixml.hpp>

#include "core/mesh/validate.h"
#include "core/mesh_files/vtk_cells.h"
#include "core/mesh_files/vtu_document.h"

namespace ccslice {

/// The cell and point data that mark what another piece has too.
inline constexpr const char* kVtkGhosts = "vtkGhostType";

/// `cells` cells over `points` points, at least one. Throws what read_vtu() does.
VtkCells read_vtu_cells(const VtuDocument& document, pugi::xml_node piece, std::uint64_t cells, std::uint64_t points,
                        const MeshLimits& limits);

}  // namespace ccslice
