// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One cubic polynomial of the voxel for each channel in a box of voxels that many cells meet.
//
// All cells that may hold a voxel of the box are sampled forward (interpolation/voxel_blocks.h), those that are large
// beside it in parts: PARTICLES, each a box of a cell's parameters that meets the box of voxels. Polynomials are fitted
// to some of their nodes, and the error is bounded over each particle, whole (interpolation/block_bound.h). As every
// voxel inside the solid lies in some particle, the error of its value is bounded, too: nothing is between samples.
// Particles beside irregular lines, where an error isn't a polynomial, may take a smaller share of the tolerance.
//
// Voxels that the contours' tolerance puts inside, although they lie off the solid, take what the boundary has. Where a
// polynomial is so steep that this may matter, it is refused beside the boundary.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/interpolation/block_bound.h"
#include "core/interpolation/cubic_polynomial.h"
#include "core/interpolation/interpolation_spec.h"
#include "core/interpolation/voxel_blocks.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// One thread.
class TileFitter {
 public:
  /// REQUIRES: all tolerances positive.
  TileFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec);

  /// Particles of a box, or none if they aren't known.
  struct Particles {
    bool known = false;
    std::size_t first = 0, end = 0;
  };

  /// Forgets all particles.
  void clear();
  /// Those that meet a box (between the centres of its outer voxels), which lies in the one that `around` is of. Not
  /// known if there are so many that `voxels` are inverted as quickly.
  Particles enter(const Box3& box, std::uint64_t voxels, const Particles& around);
  /// Forgets what was found since the particles' box was entered.
  void leave(const Particles& particles);

  enum class Outcome : std::uint8_t { kFits, kHalve, kHopeless };
  /// Fills polynomials() and frame(), if that is its outcome. kHopeless: boxes of `least_voxels` won't fit either.
  Outcome fit(const Particles& particles, const Box3& box, std::uint64_t voxels, std::uint64_t least_voxels);

  const VoxelFrame& frame() const { return frame_; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials() const { return polynomials_; }

  /// A parameter near a voxel.
  std::optional<CellParam> near(const Particles& particles, const Vec3& voxel) const;

 private:
  struct Particle {
    std::uint32_t cell;
    std::uint32_t first_child = 0;  // Its halves, if they were needed.
    ParamBox parameters;
    bool one_patch;
    Box3 bounds;  // Voxels.
    BlockPlacesInVoxels places;
    std::vector<BlockValues> values;  // By channel.
  };

  bool collect(const Box3& box, std::size_t most);
  bool add_meeting(std::uint32_t particle, const Box3& box, std::size_t most);
  std::uint32_t sample(std::uint32_t cell, const ParamBox& parameters);
  void halve(std::uint32_t particle, Eigen::Index voxel_axis);
  double fit_polynomials(std::span<const std::uint32_t> particles);
  double bound_over(const Particle& particle, double enough);
  double steepness(const Particle& particle) const;
  bool is_at_boundary(const Particle& particle, const Box3& box) const;

  std::shared_ptr<const LimitSolid> solid_;
  const Placement mesh_of_voxel_;
  const Vec3 pitch_mm_, outside_voxels_;
  const double outside_mm_;
  const std::vector<ChannelTolerance> channels_;
  VoxelBlocks blocks_;

  std::vector<std::unique_ptr<Particle>> pool_;  // The first ones, `used_` of them, are in use.
  std::size_t used_ = 0;
  std::vector<std::uint32_t> members_;  // Of the boxes on the way down.

  // Of the box at hand.
  VoxelFrame frame_;
  std::vector<CubicPolynomial> polynomials_;
  std::vector<Vec3> places_;
  std::vector<double> values_;
  CubicFitter fitter_;
  BlockPlacesInVoxels in_frame_;
  BlockBound bound_;
};

}  // namespace ccslice
