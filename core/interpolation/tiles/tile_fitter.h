// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One cubic polynomial of the voxel for each channel in a box of voxels that many cells meet.
//
// All cells that may hold a voxel of the box are sampled forward (interpolation/tiles/tile_particles.h). Polynomials
// are fitted to some of the samples. Over a particle that lies in one patch the error is bounded, whole
// (interpolation/fits/block_bound.h). Over others, beside irregular lines, an error isn't a polynomial: the same
// formula is no bound there, and what it yields may take 0.5 of the tolerance instead of 0.9, a share that was measured
// (interpolation/fits/shares.h). If all is to be proved (InterpolationSpec::proved), such boxes are halved. Every voxel
// inside the solid lies in some particle.
//
// Voxels that the contours' tolerance puts inside, although they lie off the solid, take what the boundary has. Where a
// polynomial is so steep that this may matter, it is refused beside the boundary.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/interpolation/fits/block_bound.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/tiles/tile_particles.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// One thread.
class TileFitter {
 public:
  /// `blocks`: of the solid and the spec, or its own. REQUIRES: all tolerances positive.
  TileFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
             std::shared_ptr<VoxelBlocks> blocks = nullptr);

  TileParticles& particles() { return particles_; }

  enum class Outcome : std::uint8_t { kFits, kHalve, kHopeless };
  /// Fills polynomials() and frame(), if that is its outcome. kHopeless: boxes that would fit are so small that
  /// inverting all voxels takes less than finding them.
  [[nodiscard]] Outcome fit(const TileParticles::Range& range, const Box3& box, std::uint64_t voxels);

  const VoxelFrame& frame() const { return frame_; }
  /// One a channel.
  std::span<const CubicPolynomial> polynomials() const { return polynomials_; }

 private:
  double fit_polynomials(std::span<const std::uint32_t> particles);
  double bound_over(const TileParticle& particle, double enough);
  double left_by(const TileParticle& particle, std::size_t channel) const;
  double steepness(const TileParticle& particle) const;
  double bound_of_steepness(std::span<const std::uint32_t> particles) const;
  bool is_at_boundary(const TileParticle& particle, const Box3& box) const;

  std::shared_ptr<const LimitSolid> solid_;
  const Vec3 pitch_mm_;
  const double outside_mm_;
  const bool proved_;
  const std::vector<ChannelTolerance> channels_;
  TileParticles particles_;

  // The box at hand.
  VoxelFrame frame_;
  std::vector<CubicPolynomial> polynomials_;
  std::vector<Vec3> places_;
  std::vector<double> values_;
  CubicFitter fitter_;
  BlockPlacesInVoxels in_frame_;
  BlockBound bound_;
};

}  // namespace ccslice
