// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Gives limit-ready cells what a prepared solid keeps of them: rings, operators, boundary faces. Some at a time, cells
// are walked and the operators that they lack are made, on several threads; then they are put, one by one.
//
// Private to core/limit.

#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <variant>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/mesh/control_mesh.h"
#include "core/prepare/build_levels.h"
#include "core/prepare/curved_cells.h"
#include "core/prepare/level.h"
#include "core/prepare/prepare_options.h"
#include "core/prepare/ring_store.h"
#include "core/subdivision/canonical_rings.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

/// REQUIRES: where there are several threads, its caller is in an arena of as many.
class CellAdder {
 public:
  /// `levels`: how many there are, cut-outs of one counting as one. REQUIRES: data.cells know their control cells; the
  /// arguments outlive it.
  CellAdder(const ControlMesh& mesh, const CurvedCells& curved, const PrepareOptions& options, BuildingMemory& memory,
            std::size_t levels, RingStore rings, std::size_t faces, LimitSolid::Data& data);

  /// What follows is of this level, or of this cut-out of it. REQUIRES: it outlives what is added of it.
  void enter(const Level& level, std::size_t number);
  void add(CellId cell, LimitCellId id, const Classification& found, bool begins_family);
  /// Of all that has been entered so far. Throws Error{kMeshTooComplex}, Error{kCancelled}, and what memory does, as
  /// add() does.
  void finish_level();
  /// Puts all faces of the boundary in the order of their cells, then interfaces, and finds the hulls of both.
  void put_faces();

 private:
  /// The star of a vertex: its operator, and where its points stand in LimitSolid::Data::rings.
  struct Star {
    std::uint32_t op = kNone;
    std::uint32_t ring_begin = 0;
  };

  /// What walks a level's cells and faces, on one thread.
  struct Walkers {
    Walkers(const CellComplex& complex, KnownStarts& starts)
        : rings(complex), surfaces(complex), known_starts(&starts) {}

    RingWalker rings;
    SurfaceWalker surfaces;
    KnownStarts* known_starts;
  };

  struct WalkedSurface {
    SurfaceRing ring;
    std::uint32_t op = kNone;  // Irregular ones: kNone if new.
  };

  /// A limit-ready cell whose turn has come, and what it was walked to.
  struct PendingCell {
    CellId cell;
    LimitCellId id;
    Classification found;
    bool begins_family;
    std::variant<RegularRing, FramedLineRing, FramedVertexRing> ring{};
    std::uint32_t op = kNone;               // Of a line cell; of a vertex cell the corner's. kNone if new.
    std::vector<WalkedSurface> surfaces{};  // Of the sides that become faces.
  };

  /// A face of the boundary or an interface.
  struct WalkedFace {
    BoundaryFace face;
    SurfaceFaceRing ring;

    auto place() const { return std::tuple(face.beyond != kNoCellRegion, std::uint32_t{face.cell}, face.cell_side); }
  };

  template <typename Work>
  void for_each_walked(std::size_t count, std::size_t in_turn, Work work);
  void add_pending();
  void walk_stars();
  void make_operators();
  void reserve_operators();
  void walk(Walkers& walkers, PendingCell& pending) const;
  bool becomes_face(const PendingCell& pending, FaceId face) const;
  ControlCellId control_cell(const PendingCell& pending) const { return data_.cells[pending.id].control_cell; }
  VertexId irregular_vertex(const PendingCell& pending) const {
    return level_->complex.cell_vertices(pending.cell)[pending.found.anchor];
  }
  Star& star_at(VertexId vertex);
  const Star& star_of(VertexId vertex);
  std::vector<VertexId> star_points(const Star& star) const;
  void put_cell(const PendingCell& pending);
  std::size_t child_number(LimitCellId cell) const;
  void put_curved_cell(const PendingCell& pending);
  std::uint32_t add_points(std::span<const double> points);
  SurfaceFaceRing put_face_ring(const WalkedSurface& surface, const BoundaryFace& face);
  void put_boundary_faces(const PendingCell& pending);
  void put_boundary_edges(const PendingCell& pending);
  void put_vertex_ring(const PendingCell& pending, LimitCell& record);

  const ControlMesh& mesh_;
  const CurvedCells& curved_;
  const PrepareOptions& options_;
  const CancellationToken& cancel_;
  BuildingMemory& memory_;
  LimitSolid::Data& data_;
  RingStore rings_;
  std::vector<double> patch_;             // Of the curved cell that was put last.
  std::vector<std::vector<Star>> stars_;  // By level and number of the vertex there.
  std::vector<WalkedFace> faces_;
  KnownStarts own_starts_;
  tbb::enumerable_thread_specific<KnownStarts> others_starts_;
  // Of the level that was entered last:
  const Level* level_ = nullptr;
  std::size_t level_number_ = 0;
  std::optional<Walkers> own_walkers_;
  std::optional<tbb::enumerable_thread_specific<Walkers>> others_walkers_;
  std::vector<PendingCell> pending_;
  std::map<VertexId, VertexStar> walked_stars_;             // Not yet in its Star.
  std::map<VertexId, std::vector<VertexId>> stars_points_;  // Of the stars of cells that were pending.
};

}  // namespace ccslice
