// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cells of a VTK file, as read, turned into those of a control mesh (types: core/mesh_files/vtk_cell_types.h).
// Cells of second order keep their nodes. Those of a higher one are taken by their corners. Pyramids become hexahedra
// whose corners 4 to 7 are one (core/mesh_import/collapsed_cells.h).

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/mesh_files/vtk_cell_types.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/polyhedra.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

/// VTK's attribute of points, or array of that name: weights of rational Bezier cells.
inline constexpr const char* kRationalWeights = "RationalWeights";

/// The faces of polyhedra.
struct VtkFaces {
  std::vector<std::uint64_t> cell_ends;  // n positions in `faces`, ascending.
  std::vector<std::uint32_t> faces;      // Which faces the cells have, one cell after the other.
  std::vector<std::uint64_t> face_ends;  // Positions in `points`, ascending.
  std::vector<std::uint32_t> points;     // Point ids.
};

struct VtkCells {
  std::vector<std::uint64_t> offsets;              // n + 1 positions in `connectivity`, ascending from 0.
  std::vector<std::uint32_t> connectivity;         // Point ids.
  std::vector<std::uint16_t> types;                // n VTK cell types.
  std::vector<std::uint64_t> places, type_places;  // n marks of the scanner each.
  std::vector<bool> ghosts;                        // n: cells to leave out. Or none.
  /// Without them a polyhedron's connectivity is its faces: how many, then each as its number of points and these.
  std::optional<VtkFaces> faces;
  std::uint64_t first_number = 0;  // Of the first cell among all of the file.
  /// Before VTK 9, hexahedra of second degree had the node of edge 3-7 before that of edge 2-6.
  bool old_hexahedra = false;
};

class VtkCellAppender {
 public:
  explicit VtkCellAppender(MeshFile& file);

  /// Appends the volume cells to the mesh. Returns their numbers among `cells`. Throws Error{kMeshUnsupportedCell,
  /// kFileSyntax, kMeshIndexOutOfRange}, which name the place by `scanner`. REQUIRES: one offset more than types, the
  /// last one in range; the mesh has its vertices.
  std::vector<std::uint32_t> append(const VtkCells& cells, const TextScanner& scanner);
  /// Makes nodes of the control points of Bezier cells, once the mesh has its channels. `weights`: of the points, or
  /// none. Throws Error{kMeshUnsupportedCell} that names the cells whose weights differ, since these are rational.
  /// Equal ones change nothing.
  void finish_bezier_cells(std::span<const float> weights);
  /// A sentence on each kind of cells that isn't taken as it is.
  void warn();

 private:
  /// Cells of some kind: how many, and the numbers of the first few.
  struct Tally {
    std::size_t count = 0;
    std::vector<std::int64_t> first_ids;

    void add(std::uint64_t number);
    std::string ids() const;
  };

  /// A cell of the file, and where its points end.
  struct BezierCell {
    std::uint64_t number;
    std::size_t end_point;
  };

  void refuse_rational_cells(std::span<const float> weights) const;
  void append_cell(const VtkCells& cells, std::size_t cell, const VtkCellType& type, const TextScanner& scanner);
  void keep_nodes(const VtkCells& cells, std::size_t cell, const VtkCellType& type, const TextScanner& scanner);
  void leave_out_nodes(const VtkCells& cells, std::size_t cell, const VtkCellType& type, const TextScanner& scanner);
  void append_polyhedron(const VtkCells& cells, std::size_t cell, const TextScanner& scanner);
  std::vector<FaceRing> rings_of(const VtkCells& cells, std::size_t cell, const TextScanner& scanner) const;
  [[noreturn]] void refuse_polyhedron(const VtkCells& cells, std::size_t cell, const std::string& what,
                                      const TextScanner& scanner) const;
  [[noreturn]] void refuse_point(const VtkCells& cells, std::size_t cell, std::uint32_t point,
                                 const TextScanner& scanner) const;

  MeshFile& file_;
  Tally flat_;
  std::size_t higher_order_ = 0, with_other_nodes_ = 0;
  std::vector<std::size_t> bezier_;           // Those of second order: places in second_order.
  std::vector<BezierCell> bezier_cells_;      // Of any order.
  std::vector<std::uint32_t> bezier_points_;  // Of one such cell after the other.
};

}  // namespace ccslice
