// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The levels of refinement from which limit-ready cells are taken: the control mesh, and what is refined of it. The
// last level has nearly all cells, and its complex would take more than all else does. So it is made in cut-outs of
// children that are near to each other, which are left behind one after the other.
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
#include "core/prepare/level.h"
#include "core/prepare/prepare_options.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"

namespace ccslice {

/// A whole level, and what becomes of its cells. Nothing is said of cells that are mere context.
struct WholeLevel {
  ChildOrigins origins;
  LevelNames names;
  Level level;
  std::vector<std::optional<Classification>> classes;  // By cell; nothing for refined ones.
  std::vector<CellId> first_child;                     // By cell of the last but one: in the last one, or kNone.
};

/// Cells that are walked together.
inline constexpr std::size_t kWalkedTogether = 512;

/// What building the cells takes, as options.reserve is told it, from what is known so far. The same for any number of
/// threads, so that whoever asks beforehand needn't know it: cells that wait walked count, and a cut-out that is
/// refined ahead, which is most of the threads' part. Each thread beyond the first holds 1.3 MB more, and 16 bytes for
/// each cell and vertex of a whole level that it walks or refines, which what is told above what is held makes up for.
class BuildingMemory {
 public:
  BuildingMemory(const ControlMesh& mesh, const PrepareOptions& options)
      : mesh_(mesh), options_(options), cells_(mesh.cell_count()) {}

  /// Each throws what options.reserve does, which is never told less than before.
  /// What the kinds of cells tell: tetrahedra and wedges are refined twice, but for a few of their children.
  void reserve_control_cells();
  /// What wide fans take besides, cells round one edge: the ring of each has the points of all.
  void reserve_fans(const CellComplex& control_cells);
  /// What second-order cells that are as meshed, and faces of the boundary of these, keep as points of their own.
  void reserve_own_points(std::size_t cells, std::size_t faces);
  /// `cells` of whole levels, and `children` that are made in cut-outs.
  void reserve_cells(std::size_t cells, std::size_t children);
  void reserve_faces(std::size_t faces);
  /// How many different operators there are shows as they are made: asks for some more each time.
  /// `kept`: of the bytes, what stays when the cells are built.
  void reserve_operators(std::size_t bytes, std::size_t kept);

  /// The most that was told.
  std::uint64_t told_bytes() const { return told_bytes_; }
  /// All of them, once the levels are built.
  std::size_t limit_cells() const { return cells_ + children_; }

 private:
  void reserve();

  const ControlMesh& mesh_;
  const PrepareOptions& options_;
  std::size_t cells_;
  std::size_t children_ = 0;
  std::size_t faces_ = 0;  // Of the boundary.
  std::uint64_t fan_bytes_ = 0, own_points_bytes_ = 0;
  std::size_t operator_bytes_ = 0, kept_operator_bytes_ = 0;
  std::uint64_t told_bytes_ = 0;
};

class Levels {
 public:
  /// Refines the mesh where necessary and classifies. Fills points of all levels. `complex`: the mesh's. Throws
  /// Error{kCancelled}, and what `memory` does.
  Levels(const ControlMesh& mesh, const SplitMesh& split, CellComplex complex, const PrepareOptions& options,
         BuildingMemory& memory, LimitSolid::Data& data);

  /// All but the one that is made in cut-outs.
  const std::deque<WholeLevel>& whole() const { return whole_; }

  /// Cells of the last whole level, ascending, whose children are limit-ready and make one cut-out.
  using Group = std::vector<CellId>;
  const std::vector<Group>& groups() const { return groups_; }
  /// How many children a cell of the last whole level has, if it has any.
  std::uint32_t child_count(CellId cell) const;

  struct RefinedGroup {
    Level level;
    std::vector<CellId> first_child;  // By cell of the group.
  };
  /// On one thread at a time, whatever others do with the levels and with what was refined before. Throws
  /// Error{kCancelled}.
  RefinedGroup refine(const Group& group);

 private:
  void add_whole_level(CellComplex complex, ChildOrigins origins, const LevelNames& names);
  void add_control_level(CellComplex complex);
  void name_copies(Level& level) const;
  std::vector<CellId> classify(const std::vector<CellId>& cells);
  std::size_t child_count(const std::vector<CellId>& cells) const;
  bool are_hexahedra(const std::vector<CellId>& cells) const;
  LevelNames next_names(const ChildOrigins& origins) const;
  void add_points(const ChildOrigins& children);
  std::vector<CellId> add_refined_level(const std::vector<CellId>& cells);
  void number_last_level(const std::vector<CellId>& cells);
  void group_neighbours(std::vector<CellId> cells);

  const ControlMesh& mesh_;
  const SplitMesh& split_;
  const CancellationToken& cancel_;
  int threads_;
  LimitSolid::Data& data_;
  std::deque<WholeLevel> whole_;
  std::optional<ChildVertices> last_vertices_;
  LevelNames last_names_;
  std::optional<CutOutMaker> cut_outs_;
  std::vector<Group> groups_;
};

}  // namespace ccslice
