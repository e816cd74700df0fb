// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels at the pixels of one plane, within a tolerance.
//
// Pieces of cells (interpolation/) pay where many layers share them. Of a single plane most of them paint some dozen
// pixels, and take longer than inverting those. So here the plane is cut into blocks of 8 x 8 pixels. A few of a
// block's pixels are inverted (pixel_inverter.h), and a polynomial is laid through them (pixel_surface.h), which
// paints the rest if it is near enough to what they say:
//
// - Its misfit is at most a share of the tolerance. Through the four corners of a block that is all inside the share
//   is larger: that surface is exact to one order more.
// - One more pixel is inverted to see: the middle, or the one that is farthest from the others.
// - Where few samples leave a bend open, the channel must hardly change from them to any other pixel.
// - No cell there is much smaller than the block, so that none goes unnoticed.
// - Of a solid as meshed, where slopes jump from cell to cell, all the block is in one cell, as its corners tell.
//
// Each part of a block counts as a block of its own, if gaps or cell regions part it. What isn't painted is cut into
// blocks of 4 x 4 and then of 2 x 2 pixels. What isn't then, and what has few pixels, is inverted pixel by pixel. All
// near folds and what the inverter can't tell is left to the inversion of slices (field/material_pass.h), which starts
// from the parameters of the pixels around.
//
// Samples tell of a tolerance that is kept; they don't prove it, as the bounds of pieces mostly do.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_solid.h"
#include "core/preview/pixel_inverter.h"
#include "core/preview/pixel_surface.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

struct SamplingOptions {
  bool rough = false;      // For tolerances of some hundredths, which first-order steps keep.
  bool own_range = false;  // The tolerances are shares of the channels' ranges; take these shares of the picture's.
};

/// One solid, one thread. A plane's samples depend on nothing that was done before.
class PlaneSampler {
 public:
  explicit PlaneSampler(std::shared_ptr<const LimitSolid> solid);

  /// Sets the samples of the spec's channels at all pixels inside. `spans`: as rasterize() yields them for the
  /// target's lattice; `regions`: find_regions() of them, if channels may jump between regions, or else none.
  /// REQUIRES: the target's window is the whole lattice; its planes are of the spec's channels; the field is of the
  /// solid, and of the spec's placement and outside_mm. Throws Error{kCancelled}, and Error{kInternal} if even the last
  /// resort finds nothing.
  void paint(const LayerTarget& target, const InterpolationSpec& spec, MaterialField& field,
             std::span<const VoxelRun> spans, std::span<const RegionRun> regions, const SamplingOptions& options = {});

 private:
  using Mask = std::uint64_t;  // Bit 8 * row + column of 8 x 8 pixels.

  enum class Surroundings : std::uint8_t {
    kSmooth,
    kThin,       // A cell could go unnoticed.
    kAmbiguous,  // A point may have several parameters.
  };
  /// What inverts a pixel that isn't painted.
  enum class Left : std::uint8_t { kNothing, kToInverter, kToPass };

  /// A part of a block: pixels side by side, of one region.
  struct Part {
    std::uint32_t column, row, side;  // The block's first pixel, and how many it has each way: 8, 4 or 2.
    Mask pixels;                      // Counted from there.
    std::uint8_t number;              // Of the region.
  };
  /// Pixels of a part, counted from its block's first one; the corner after the last may lie beyond the block.
  struct Places {
    std::array<std::array<std::uint32_t, 2>, QuadraticFitter::kMostPlaces> at;
    std::size_t count = 0;
    bool corners = true;  // They are the block's four.

    void add(std::uint32_t column, std::uint32_t row);
  };

  void number_pixels(std::span<const VoxelRun> spans, std::span<const RegionRun> regions);
  std::uint8_t number_at(std::uint32_t column, std::uint32_t row) const;
  void narrow_tolerances();
  /// What cells there are around a block, the first pixels of the next ones included.
  Surroundings surroundings_of(std::uint32_t column, std::uint32_t row, std::uint32_t side) const;
  void paint_block(std::uint32_t column, std::uint32_t row);
  void paint_quarters(const Part& part);
  [[nodiscard]] bool paint_part(const Part& part);
  bool has_corner(const Part& part, unsigned corner) const;
  Places places_of(const Part& part) const;
  std::array<std::uint32_t, 2> nearest_pixel(const Part& part, std::uint32_t column, std::uint32_t row) const;
  [[nodiscard]] bool paint_by(const Part& part, const Places& places, std::optional<std::uint32_t> check);
  SurfaceSample sample_of(const Part& part, std::uint32_t number, std::size_t channel) const;
  bool is_flat(const Part& part, const Places& places, double reach) const;
  void fill(const Part& part, const PixelSurface& surface, std::uint32_t channel);
  void leave(const Part& part, Left how);
  void solve_rest(std::span<const VoxelRun> spans, MaterialField& field);
  [[nodiscard]] bool set_pixel(std::uint32_t column, std::uint32_t row);
  std::optional<CellParam> hint_at(std::uint32_t column, std::uint32_t row) const;

  std::shared_ptr<const LimitSolid> solid_;
  PixelInverter inverter_;
  // Of the plane at hand:
  const LayerTarget* target_ = nullptr;
  std::vector<ChannelTolerance> channels_;
  std::uint32_t columns_ = 0, rows_ = 0;
  std::vector<std::uint8_t> numbers_;  // By pixel: 1 + its region, 0 outside.
  std::vector<Left> left_;             // By pixel.
};

}  // namespace ccslice
