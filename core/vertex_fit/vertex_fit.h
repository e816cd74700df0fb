// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From a mesh that was made as a part to a control mesh whose limit is that part: control points are placed so that the
// limit passes through the mesh's own vertices, in position and in materials (for surfaces: Halstead, Kass, DeRose,
// "Efficient, fair interpolation using Catmull-Clark surfaces", SIGGRAPH 1993).
//
// A mesh from CAD or finite elements has its vertices ON the part. Taken as control points they draw everything convex
// inwards. Fitted, the limit meets every vertex and swells a little between them, as smooth parts do between the
// corners of their facets. Meshes that were designed as control meshes are not to be fitted.
//
// FOLDS. Control points overshoot where small cells lie beside large ones, or along edges that should have been sharp,
// and cells there may fold. Nothing that didn't fold may fold afterwards. Inside, control points may follow those of
// the boundary smoothly instead of meeting their vertices. Where that isn't enough, vertices of the boundary are kept
// back: each has a share of the way from its old limit point to itself, all of it at first. The shares of vertices of
// cells that fold and didn't, and from the fourth round on of ever more vertices around them, are halved, and the
// system is solved again. With no share left anywhere it is the mesh as it came, so this ends; five rounds did for
// every mesh met. Only cells are looked at: a limit that swells across a narrow gap may run into itself.
//
// CHANNELS have no folds that could keep them back, and ring beside steps. The fit tells which ones do, and where
// (channel_ringing.h).
//
// CELL REGIONS are fitted as they are refined, each with vertices of its own on the interfaces (mesh/cell_regions.h),
// which count as boundary. A limit point on an interface depends on the interface's control points alone, so all copies
// of a vertex move alike; they get the mean of their moves, whose rounding differs.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/rounded_edges.h"
#include "core/mesh/validate.h"
#include "core/prepare/preparation_progress.h"
#include "core/vertex_fit/channel_ringing.h"
#include "core/vertex_fit/vertex_system.h"

namespace ccslice {

enum class FittedVertices : std::uint8_t {
  kAll,       // The limit passes through every vertex; where it would fold, through those of the boundary only.
  kBoundary,  // It passes through those of the boundary that can be met without folds; inside, control points follow.
};

/// The limit swells much where it stands off a face by more than this share of the face's edges.
inline constexpr double kMuchSwelling = 0.1;

/// A face of the boundary between whose corners the limit stands off farthest, by the length of its edges.
struct Swelling {
  std::vector<std::uint32_t> vertices;  // The face's, in turn.
  Vec3 place = Vec3::Zero();            // The middle of its limit, mm.
  Vec3 offset = Vec3::Zero();           // From the mean of its corners along its normal, mm.
  double edges = 0;                     // Its length as a multiple of the mean length of its edges.
  std::size_t much = 0;                 // So many faces of the boundary swell by more than kMuchSwelling.
};

struct FitReport {
  std::size_t missed = 0;         // Vertices of the boundary that the limit doesn't pass through.
  VertexLimit farthest;           // The vertex of the boundary that is farthest from its limit point.
  std::size_t inside_missed = 0;  // Vertices inside that the limit doesn't pass through.
  double inside_mm = 0;           // The largest distance of a vertex inside from its limit point.
  Swelling swelling;              // Where the limit swells most.
  RoundedEdges rounded;           // Edges that should have been sharp, by the look of them.
};

struct ChannelFit {
  /// The largest miss of a vertex as a share of its channel's range, which is rounding unless the mesh is singular
  /// (vertex_system.h).
  double miss = 0;
  std::vector<ChannelRinging> ringing;  // The channels that ring, ascending.
};

/// A vertex is met if its limit point is within this share of the diagonal of the mesh's box.
inline constexpr double kMetShare = 1e-7;

/// Who is told how far a fit is, on the thread that fits; nobody where a function is missing.
struct FitProgress {
  /// The mesh is prepared next to look for folds, several times in a fit. Gives where that tells its progress; it has
  /// to last until it is called again, or the fit is done.
  std::function<PreparationProgress*()> preparing = {};
  /// What preparing it takes, as PrepareOptions::reserve is told it.
  std::function<void(std::uint64_t bytes)> reserve = {};
  /// So many cells were sampled for channels that ring.
  std::function<void(std::size_t done, std::size_t total)> sampling = {};
};

struct FitOptions {
  MeshLimits limits = {};
  CancellationToken cancel = {};
  int threads = 1;  // At most.
  FitProgress progress = {};
};

/// The control cells that fold somewhere in the limit, or that can't be told to fold or not; ascending.
std::vector<ControlCellId> folding_control_cells(const LimitSolid& solid);

class VertexFit {
 public:
  /// Throws what validate() does, Error{kCancelled}.
  explicit VertexFit(const ControlMesh& mesh, const FitOptions& options = {});

  /// The mesh with fitted positions: interpolating, with the vertices of the boundary that the limit misses, cells in
  /// the order in which validate() leaves them, the channels untouched. Takes some 10 us a vertex and as long as
  /// preparing the mesh, some times over where it would fold. Throws Error{kMeshNotInterpolable} with the ids if kAll
  /// is asked for and no control points meet the vertices, or only with folds; Error{kCancelled}, and what
  /// prepare_solid() does.
  ControlMesh fit_positions(FittedVertices vertices, FitReport& report) const;

  /// The limit points of the vertices of a mesh of the same cells.
  std::vector<Vec3> limit_points(const ControlMesh& mesh) const;

  /// Fits the channels of control points, so that the limit has the channels of `meant` at each vertex. REQUIRES:
  /// meshes of the same cells as that of the constructor, `fitted` in its positions, which tell where channels ring.
  /// Throws Error{kCancelled}.
  ChannelFit fit_channels(const ControlMesh& meant, ControlMesh& fitted) const;

 private:
  VertexSystem::Values of_copies(const VertexSystem::Values& of_vertices) const;
  VertexSystem::Values of_vertices(const VertexSystem::Values& of_copies) const;
  VertexSystem::Values limits_of(const VertexSystem::Values& of_vertices) const;
  double fit_jumping_channels(const ControlMesh& meant, ControlMesh& fitted) const;
  double fit_even_channels(const ControlMesh& meant, ControlMesh& fitted) const;
  std::vector<ChannelRinging> find_ringing_of(const ControlMesh& meant, const ControlMesh& fitted) const;
  std::uint8_t copy_region(VertexId copy) const;
  VertexSystem::Values jumping_channels_of(const ControlMesh& mesh) const;
  void set_jumping_channels(const VertexSystem::Values& of_copies, ControlMesh& mesh) const;
  ControlMesh moved(const VertexSystem::Values& moves) const;
  ControlMesh fit_all(const VertexSystem::Values& gaps) const;
  void require_none(const std::vector<ControlCellId>& folds) const;
  ControlMesh fit_boundary(const VertexSystem::Values& gaps) const;
  /// Prepares the mesh for it.
  std::vector<ControlCellId> folding_cells(const ControlMesh& mesh) const;
  /// Marks the vertices of these cells and, ring by ring, those of the cells around them; all copies alike.
  std::vector<std::uint8_t> around(const std::vector<ControlCellId>& cells, int rings) const;
  void mark_copies(std::vector<std::uint8_t>& marked) const;
  std::uint32_t origin_of(VertexId copy) const { return origins_.empty() ? std::uint32_t{copy} : origins_[copy]; }
  const Vec3& position_of(VertexId copy) const { return mesh_.positions[origin_of(copy)]; }
  /// Fills the report and missed_vertices.
  void measure(ControlMesh& fitted, FitReport& report) const;
  Swelling measure_swelling(const ControlMesh& fitted) const;

  FitOptions options_;
  ControlMesh mesh_;                    // As validate() leaves it.
  std::vector<std::uint32_t> origins_;  // The vertex of each copy; none where there are no copies.
  RoundedEdges rounded_;                // Of the boundary that the mesh has without regions.
  CellComplex complex_;                 // Of the copies.
  VertexSystem system_;
  double met_mm_;
};

}  // namespace ccslice
