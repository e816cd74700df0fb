// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The levels of refinement from which limit-ready cells are taken: the control mesh, and what is refined of it.
//
// Private to core/limit.

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/control_mesh.h"
#include "core/subdivision/classify.h"

namespace ccslice {

/// One refinement level: a complex, where its points start, and what its places are called on the surface.
struct Level {
  CellComplex complex;
  std::uint32_t point_base = 0;
  std::vector<SurfaceKey> vertex_keys;
  std::vector<FaceSide> edge_roots;                    // From the edge's first vertex to its second.
  std::vector<std::optional<Classification>> classes;  // By cell; nothing for refined cells and for mere context.
  std::vector<CellId> first_child;                     // By cell, in the next level; kNone if not refined.
  std::vector<std::uint8_t> beyond;  // By face of the complex: the region beyond an interface. Empty if there is none.
};

/// What building the cells takes, as options.reserve is told it, from what is known so far.
class BuildingMemory {
 public:
  BuildingMemory(const ControlMesh& mesh, const PrepareOptions& options)
      : mesh_(mesh), options_(options), cells_(mesh.cell_count()) {}

  /// Each throws what options.reserve does, which is never told less than before.
  /// What the kinds of cells tell: tetrahedra and wedges are refined twice, but for a few of their children.
  void reserve_control_cells();
  /// Cells: those after one refinement at most, and those after two or more.
  void reserve_cells(std::size_t cells, std::size_t twice_refined_cells);
  void reserve_faces(std::size_t faces);
  /// How many different operators there are shows as they are made: asks for as much again each time.
  void reserve_operators(std::size_t bytes);

  /// All of them, once the levels are built.
  std::size_t limit_cells() const { return cells_ + twice_refined_cells_; }

 private:
  void reserve();

  const ControlMesh& mesh_;
  const PrepareOptions& options_;
  std::size_t cells_;
  std::size_t twice_refined_cells_ = 0;
  std::size_t faces_ = 0;  // Of the boundary.
  std::size_t operator_bytes_ = 0;
  std::uint64_t told_bytes_ = 0;
};

/// Refines the mesh where necessary and classifies: each cell of a level is limit-ready, refined or mere context. Fills
/// points. `complex`: the mesh's. Throws Error{kCancelled}, and what `memory` does.
std::deque<Level> build_levels(const ControlMesh& mesh, const SplitMesh& split, CellComplex complex,
                               const PrepareOptions& options, BuildingMemory& memory, LimitSolid::Data& data);

}  // namespace ccslice
