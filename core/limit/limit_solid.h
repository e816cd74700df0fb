// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The prepared Catmull-Clark solid: an immutable, shareable value from which the limit volume is evaluated.
//
// Refining the control mesh where necessary yields the LIMIT-READY cells (the mesh M of [Luu19, 3]): hexahedra of three
// classes, regular (one tricubic B-spline patch), line (one irregular line along one edge: a 2-D scheme times a cubic
// B-spline) and vertex (one irregular vertex where all irregular lines of the cell meet). Limit cells are numbered in
// the order of their control cells, children after one another, so numbers depend on the mesh and the engine only.
//
// Cold builder, hot value: prepare_solid() allocates and throws; a prepared solid never changes, and any number
// of LimitEvaluators may read it at the same time.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/base/types.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/rounded_edges.h"
#include "core/subdivision/cell_class.h"

namespace ccslice {

struct ChannelRange {
  std::string name;
  double min = 0;  // Over the control points: bounds the limit's values (convex hull property).
  double max = 0;
};

/// A place where the limit volume folds (det J <= 0).
struct FoldPlace {
  LimitCellId cell;
  ControlCellId control_cell;    // The control cell that it came from.
  Vec3 position = Vec3::Zero();  // mm, mesh frame.
  double determinant = 0;        // Determinant of the Jacobian there, mm^3 per unit parameter volume.
};

/// Where two control cells overlap that share no vertex.
struct OverlapPlace {
  ControlCellId cell, other;     // The first one is the lower.
  Vec3 position = Vec3::Zero();  // mm, mesh frame: where the boundary of one was found deepest in the other.
  double depth_mm = 0;           // How deep that is below the other's boundary, or at least; 0 if both are inside.
};

/// Cells that overlap although they don't touch: the solid holds places twice without folding.
struct Overlaps {
  std::size_t cells = 0;             // Limit cells.
  double volume_mm3 = 0;             // That they have in common, about.
  double depth_mm = 0;               // The deepest place of the boundary in another cell.
  bool at_least = false;             // The search was cut short: there may be more, or some if none was found.
  std::vector<OverlapPlace> places;  // One of two cells, by cells; at most 32 of them.
};

/// A vertex of the control mesh's boundary, or of an interface of cell regions, and its own point of the limit surface.
/// mm.
struct VertexLimit {
  std::uint32_t vertex = 0;
  Vec3 position = Vec3::Zero();
  Vec3 limit = Vec3::Zero();
  bool on_interface = false;  // And not on the boundary.

  double distance_mm() const { return (limit - position).norm(); }
};

/// How far the limit volume is from its control mesh, or from the mesh that it was fitted to (deviation.h has the
/// definitions). mm, mm^3.
struct Deviation {
  double control_volume_mm3 = 0;
  double limit_volume_mm3 = 0;
  Box3 control_box;            // Of the boundary's control points.
  VertexLimit farthest;        // The one that is farthest from its limit point.
  bool interpolating = false;  // ControlMesh::interpolating: for control points read what they are meant to meet.
  bool as_meshed = false;      // ControlMesh::as_meshed: the limit is the mesh, and nothing deviates.
  /// Within the control mesh's boundary faces over the limit points of their vertices, where an interpolating mesh is
  /// flat and its limit isn't. Without missed vertices control_volume_mm3 is the same; 0 unless interpolating.
  double vertex_limits_volume_mm3 = 0;
  RoundedEdges rounded;  // Of interpolating meshes: edges that should have been sharp, by the look of them.
};

/// Cells with a name, and what they hold.
struct CellRegionSummary {
  std::string name;
  std::size_t control_cells = 0;
  double control_volume_mm3 = 0;  // Compared with their limit's as Deviation::control_volume_mm3 is.
  double volume_mm3 = 0;          // Of their limit.
};

/// Counts and warnings of a prepared solid.
struct SolidSummary {
  std::size_t control_vertices = 0;
  std::size_t control_cells = 0;
  std::size_t limit_cells = 0;
  std::size_t regular_cells = 0;
  std::size_t line_cells = 0;
  std::size_t vertex_cells = 0;
  std::size_t extraordinary_edges = 0;     // In the control mesh: interior, valence != 4.
  std::size_t extraordinary_vertices = 0;  // In the control mesh: interior, with EEs that aren't straight.
  std::size_t irregular_boundary_edges =
      0;  // In the control mesh: smooth with other than 2 cells, sharp with other than 1.
  std::size_t sharp_edges = 0;
  std::size_t boundary_faces = 0;  // Boundary faces of the limit-ready cells.
  Box3 bounding_box;               // Box of the limit volume, mesh frame, mm.
  Deviation deviation;             // Mesh frame.
  std::size_t memory_bytes = 0;
  std::vector<std::uint32_t> inverted_control_cells;  // Only with allow_folds.
  std::size_t folding_cells = 0;                      // Limit cells that fold somewhere.
  std::size_t undecided_cells = 0;                    // Limit cells that can't be told to fold or not.
  std::vector<FoldPlace> folds;                       // Worst place of each folding cell, at most 32 of them, by cell.
  Overlaps overlaps;
  std::vector<ChannelRange> channels;
  std::vector<CellRegionSummary> cell_regions;  // As in ControlMesh::cell_region_names.
};

struct CellIndex;
class CellBricks;

class LimitSolid {
 public:
  struct Data;  // solid_data.h, private to core/limit and core/prepare.

  /// For prepare_solid() (prepare/prepare_solid.h).
  explicit LimitSolid(std::unique_ptr<Data> data);
  ~LimitSolid();
  LimitSolid(const LimitSolid&) = delete;
  LimitSolid& operator=(const LimitSolid&) = delete;

  const SolidSummary& summary() const noexcept;
  std::size_t channel_count() const noexcept;
  std::uint32_t cell_count() const noexcept;
  IdRange<LimitCellId> cells() const noexcept { return IdRange<LimitCellId>{cell_count()}; }
  CellClass cell_class(LimitCellId cell) const noexcept;
  ControlCellId control_cell(LimitCellId cell) const noexcept;

  /// The faces of the boundary among a cell's sides: bit s is side s (BoundaryFace::cell_side).
  std::uint8_t boundary_sides(LimitCellId cell) const noexcept;
  /// A cell's sides that are between two cell regions: bits as those of boundary_sides().
  std::uint8_t interface_sides(LimitCellId cell) const noexcept;
  /// A cell's edges on the boundary, those of faces of other cells included, as round a reentrant edge: bit e is edge e
  /// of a hexahedron (mesh/cell_kind.h).
  std::uint16_t boundary_edges(LimitCellId cell) const noexcept;
  /// Their control cells are the same or share a vertex.
  bool touch(LimitCellId a, LimitCellId b) const noexcept;
  /// Cells are taken as meshed (ControlMesh::as_meshed): positions and channels are continuous from one to the next,
  /// and their slopes aren't.
  bool as_meshed() const noexcept;
  /// More than one region has cells.
  bool has_several_regions() const noexcept;
  /// The region of a control cell; 0 in a mesh without named regions.
  std::uint8_t region_of(ControlCellId cell) const noexcept;
  /// Where the cells are.
  const CellIndex& index() const noexcept;
  /// Which regular cells are parts of one B-spline (cell_bricks.h).
  const CellBricks& bricks() const noexcept;

  const Data& data() const noexcept { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace ccslice
