// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of a slab by interpolation with a checked error: the voxel loop evaluates polynomials, and exact inversion
// is the exception.
//
// A slab is cut into tiles of voxels at multiples of absolute voxel indices. In each tile some three dozen voxels
// inside the contours are inverted exactly: those nearest to the tile's corners, and others spread evenly over the
// voxels that are inside. A cubic polynomial (material/tile_polynomial.h) is fitted to their materials. The tile is
// accepted if every sample's leave-one-out error is at most an eighth of the tolerance, and the error at the middle of
// every cell there a tenth; otherwise it is halved along its longest axes, and so on; in the smallest tiles, and where
// the solid folds, every voxel is inverted; where materials are steep, so are the ends of rows, which may lie off the
// solid. A tile that the boundary cuts needs nothing outside: its samples lie inside like its voxels.
//
// The tiles follow from the solid and the slab's occupancy alone, which follows from its absolute layers: same bytes
// for any split. Those of a row of tiles follow from its own voxels alone.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/material/contone.h"
#include "core/material/tile_polynomial.h"
#include "core/raster/connected_runs.h"
#include "core/raster/occupancy.h"
#include "core/slicer/cubic_painter.h"
#include "core/slicer/grid.h"
#include "core/slicer/interpolation_spec.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"

namespace ccslice {

class MaterialTiles {
 public:
  /// REQUIRES: field outlives the tiles and is of the spec's placement and outside_mm; all tolerances positive.
  MaterialTiles(MaterialField& field, const InterpolationSpec& spec);

  /// Fits the slab of layers [first_layer, first_layer + layers.size()), whose spans rasterize() yielded.
  /// Throws Error{kCancelled}.
  void solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers, const CancellationToken& cancel);

  /// Sets the samples of those voxels of one layer of the slab that the target's planes hold, and counts. `spans`:
  /// those that solve() saw; `alone`: others, to be inverted one by one, by row, then by column; `inside`: all that
  /// have samples then, from which those that aren't reached take theirs. False if those need more of the layer than
  /// the planes hold. Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  bool paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans,
             std::span<const HintedRun> alone, std::span<const Span> inside);

 private:
  using Voxel = std::array<std::uint32_t, 3>;  // Column, row, layer.
  static Vec3 to_vec3(const Voxel& voxel) {
    return {static_cast<double>(voxel[0]), static_cast<double>(voxel[1]), static_cast<double>(voxel[2])};
  }

  /// Voxels [low, high).
  struct VoxelBox {
    Voxel low, high;
    bool holds(const Voxel& voxel) const {
      const auto within = [&](std::size_t a) { return voxel[a] >= low[a] && voxel[a] < high[a]; };
      return within(0) && within(1) && within(2);
    }
  };
  using Run = VoxelRun;
  struct PartEnds {
    Voxel first{}, middle{}, last{};
    std::uint32_t longest = 0;
    std::uint64_t voxels = 0;
  };
  struct Sample {
    Voxel voxel;
    CellParam at;
  };
  struct Node {
    enum class Kind : std::uint8_t { kEmpty, kPolynomial, kExact, kSplit };
    Kind kind = Kind::kEmpty;
    std::uint8_t split_axes = 0;  // kSplit: bit a if halved along axis a.
    std::uint32_t index = 0;      // kSplit: first child; kPolynomial, kExact: index of what it holds.
  };
  struct Fit {
    TileFrame frame;
    std::size_t first_polynomial;  // One a channel.
    bool steep;                    // Just off the solid they would say something else than its boundary has.
  };
  struct PaintJob;

  VoxelBox tile_box(std::uint32_t column, std::uint32_t row) const;
  void bucket_row(std::uint32_t tile_row, std::span<const std::span<const Span>> layers);
  /// From runs_ and members_ from these on.
  Node build(const VoxelBox& box, std::size_t first_run, std::size_t first_member);
  Node build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run);
  std::uint8_t axes_to_halve(const VoxelBox& box) const;
  /// False if there are too few, or the node has too many parts.
  bool choose_samples(const VoxelBox& box, std::size_t first_run, std::uint64_t voxels);
  void collect_features();
  void load_features();
  std::optional<Voxel> nearest_inside(const Vec3& world) const;
  bool is_inside(const Voxel& voxel) const;
  void clear_candidates();
  void add_feature_candidates(const VoxelBox& box);
  void choose_farthest(std::size_t wanted);
  void add_corner_candidates(std::size_t first_run);
  void add_spread_candidates(std::size_t first_run, std::uint64_t voxels);
  void add_end_candidates(std::size_t first_run);
  bool add_part_candidates(std::size_t first_run);
  void add_candidate(const Voxel& voxel);
  void move_away_from(const Voxel& voxel);
  void add_sample(const Voxel& voxel);
  std::optional<Node> fit();
  bool extrapolates();
  bool is_steep(std::size_t first_polynomial) const;
  bool agrees_with_cells(std::size_t first_polynomial) const;
  TileFrame frame_of(std::size_t first_run) const;
  std::optional<CellParam> hint_for(const Voxel& voxel) const;
  Vec3 centre(const Voxel& voxel) const;
  Box3 world_box(const VoxelBox& box) const;

  void paint_fit(PaintJob& job, std::uint32_t fit, Span run);
  void paint_piece(PaintJob& job, const Node& node, const VoxelBox& box, std::uint32_t row, std::uint32_t begin,
                   std::uint32_t end);
  void paint_tiles(PaintJob& job, const Span& span);
  void paint_alone(PaintJob& job, const HintedRun& alone);
  void paint_exactly(PaintJob& job, const std::optional<CellParam>& hint, const Span& run);
  void finish_exact_run(PaintJob& job);

  MaterialField* field_;
  const Grid grid_;
  const std::vector<ChannelTolerance> channels_;
  const double outside_mm_;
  Voxel tile_size_;
  std::uint32_t tile_columns_, tile_rows_;

  // Of the slab at hand.
  CancellationToken cancel_;
  std::uint32_t first_layer_ = 0, end_layer_ = 0;
  std::vector<Node> tiles_;  // By row, then by column.
  std::vector<Node> children_;
  std::vector<Fit> fits_;
  std::vector<CubicPolynomial> polynomials_;
  LayerCubics cubics_;                           // Of the fits.
  std::vector<std::optional<CellParam>> hints_;  // Of exact tiles.
  double max_residual_mm_ = 0;                   // Over the samples.

  // Scratch memory.
  std::vector<Vec3> irregular_points_;
  std::vector<std::pair<std::size_t, Vec3>> features_;  // Points of irregular lines, by tile.
  bool features_collected_ = false;                     // Of the slab,
  bool features_loaded_ = false;                        // of the tile at hand.
  std::size_t tile_ = 0;                                // The tile at hand,
  std::size_t tile_runs_ = 0;                           // and how many of runs_ are its own.
  std::vector<Voxel> tile_features_;                    // The voxels inside that are nearest to the tile's.
  std::vector<std::size_t> cursors_;                    // Next span by layer.
  std::vector<std::vector<Run>> buckets_;               // Of one row of tiles, by column.
  std::vector<Run> runs_;                               // Of the tile at hand and of the nodes on the way down.
  std::vector<Sample> pool_;                            // Solved samples of the tile at hand,
  std::vector<double> pool_values_;                     // their channels,
  std::vector<std::size_t> members_;                    // those of the nodes on the way down,
  std::vector<std::size_t> chosen_;                     // and of the node at hand.
  TileFrame frame_;                                     // Of the node at hand.
  std::vector<Voxel> candidates_;                       // Of its samples,
  std::array<std::vector<float>, 3> candidate_places_;  // in the frame,
  ConnectedRuns parts_;
  std::vector<PartEnds> part_ends_;
  std::vector<float> candidate_distances_;  // squared, to the nearest chosen one.
  std::optional<CellParam> first_hint_;
  std::vector<Vec3> places_;
  std::vector<double> fit_values_, values_;
  CubicFitter fitter_;
  MaterialPass exact_;
};

}  // namespace ccslice
