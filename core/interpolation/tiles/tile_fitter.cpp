// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_fitter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/interpolation/fits/shares.h"
#include "core/limit/cell_bricks.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr double kSmallestPredictedTile = 128;  // Tiles that would have fewer voxels once they fit aren't looked for.

constexpr std::size_t kManyParticles = 40,
                      kSomeParticles = 6;  // With more particles, fewer samples of each are fitted to.

/// Nodes that a fit is made of: every `step`-th along each axis, and the middle.
std::span<const std::size_t> slots_to_fit(std::size_t particles) {
  const auto slots = [](std::size_t step) {
    std::vector<std::size_t> result;
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const std::size_t i = n % kBlockNodes, j = n / kBlockNodes % kBlockNodes, k = n / (kBlockNodes * kBlockNodes);
      const bool middle = i == kBlockNodes / 2 && i == j && j == k;
      if (middle || (i % step == 0 && j % step == 0 && k % step == 0)) result.push_back(block_slot(n));
    }
    return result;
  };
  static const std::vector<std::size_t> kAll = slots(1), kSome = slots(2), kCorners = slots(4);
  return particles > kManyParticles ? kCorners : particles > kSomeParticles ? kSome : kAll;
}

}  // namespace

TileFitter::TileFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                       std::shared_ptr<VoxelBlocks> blocks)
    : solid_(std::move(solid)),
      pitch_mm_(spec.grid.pitch.x_mm, spec.grid.pitch.y_mm, spec.grid.pitch.z_mm),
      outside_mm_(spec.outside_mm),
      proved_(spec.proved),
      channels_(spec.channels),
      particles_(solid_, spec, std::move(blocks)) {}

TileFitter::Outcome TileFitter::fit(const TileParticles::Range& range, const Box3& box, std::uint64_t voxels) {
  if (!range.known) return Outcome::kHalve;
  const std::span<const std::uint32_t> members = particles_.members(range);
  if (members.empty()) return Outcome::kHopeless;
  const auto is_bounded = [this](std::uint32_t m) { return particles_[m].one_patch; };
  if (proved_ && !std::ranges::all_of(members, is_bounded)) return Outcome::kHalve;
  const double error = fit_polynomials(members);
  if (!(error <= 1)) {
    // What a cubic leaves of a smooth function falls with the fourth power of all lengths. Slabs are flat, so a halving
    // is taken to quarter the voxels: those of boxes that fit fall with the root of the error.
    const double predicted = static_cast<double>(voxels) / std::sqrt(error);
    return predicted >= kSmallestPredictedTile ? Outcome::kHalve : Outcome::kHopeless;  // Not a number is hopeless.
  }
  double worst = 0, steepest = 0;
  bool at_boundary = false;
  for (const std::uint32_t m : members) {
    worst = std::max(bound_over(particles_[m], 1), worst);  // Not a number stays that.
    if (!(worst <= 1)) return Outcome::kHalve;
    if (!proved_) steepest = std::max(steepness(particles_[m]), steepest);
    at_boundary = at_boundary || is_at_boundary(particles_[m], box);
  }
  if (proved_ && at_boundary) steepest = bound_of_steepness(members);
  return at_boundary && !(worst * kTileShare + steepest <= 1) ? Outcome::kHalve : Outcome::kFits;
}

/// Returns the largest error at the nodes that are fitted to, as a share of its channel's tolerance: no bound, but it
/// costs little and tells most boxes that are too large.
double TileFitter::fit_polynomials(std::span<const std::uint32_t> particles) {
  Box3 nodes;
  const std::span<const std::size_t> slots = slots_to_fit(particles.size());
  places_.clear();
  for (const std::uint32_t p : particles) {
    for (const std::size_t slot : slots) {
      places_.push_back(at_slot(particles_[p].places, slot));
      nodes.extend(places_.back());
    }
  }
  frame_ = VoxelFrame::of(nodes.min(), nodes.max());
  for (Vec3& place : places_) place = frame_(place);
  fitter_.factorize(places_);
  polynomials_.clear();
  double worst = 0;
  for (std::size_t c = 0; c < channels_.size() && worst <= 1; ++c) {
    values_.clear();
    for (const std::uint32_t p : particles) {
      for (const std::size_t slot : slots) values_.push_back(particles_[p].values[c][slot / kLanes][slot % kLanes]);
    }
    polynomials_.emplace_back();
    worst = std::max(fitter_.fit(values_, polynomials_.back()) / channels_[c].tolerance, worst);
  }
  return worst;
}

/// A bound of the error over a particle, as a share of what it may be. In one patch places and channels are tricubic,
/// as BlockBound requires. In other particles they aren't: there the formula knows of the nodes alone, and a smaller
/// share stands for what it misses.
double TileFitter::bound_over(const TileParticle& particle, double enough) {
  const double share = particle.one_patch ? kTileShare : kSampledTileShare;
  const bool is_brick = particle.brick != kNone;
  in_frame_ = particle.places;
  enter_frame(frame_, kBlockGroups, in_frame_);
  bound_.set_places(in_frame_, 0);
  double worst = 0;
  for (std::size_t c = 0; c < channels_.size() && worst <= enough; ++c) {
    BlockValues errors;
    for (std::size_t g = 0; g < kBlockGroups; ++g) {
      errors[g] = particle.values[c][g] - values_at(polynomials_[c], in_frame_[0][g], in_frame_[1][g], in_frame_[2][g]);
    }
    const double allowed = share * channels_[c].tolerance;
    const double rest = is_brick ? left_by(particle, c) : 0;
    worst = std::max((bound_(polynomials_[c], errors, enough * allowed - rest) + rest) / allowed, worst);
  }
  return worst;
}

/// What residuals add to the error of a channel: |m - p(X)| <= |Q_m - p(Q_X)| + |m - Q_m| + |p(X) - p(Q_X)|.
double TileFitter::left_by(const TileParticle& particle, std::size_t channel) const {
  const Vec3 moved = particle.residuals.position.cwiseProduct(frame_.scale);
  const double farthest = std::max(frame_(particle.bounds.min()).cwiseAbs().maxCoeff(),
                                   frame_(particle.bounds.max()).cwiseAbs().maxCoeff());
  return particle.residuals.values[channel] + bound_of_slopes(polynomials_[channel], farthest).dot(moved);
}

/// How much of a tolerance following a polynomial may take, as far as voxels may lie off the solid. A voxel x off the
/// solid is to have the material m at its foot f, and
///
///   |p(x) - m(f)| <= |p(f) - m(f)| + |p(x) - p(f)|,
///
/// where the first term is within the particle's bound and the second one, to first order, |grad p| * outside_mm at
/// most. Both together may take the tolerance. Gradients are looked at in eight corners and the middle, and not in
/// between.
double TileFitter::steepness(const TileParticle& particle) const {
  double most = 0;
  for (const std::size_t slot : slots_to_fit(kManyParticles + 1)) {
    const Vec3 place = frame_(at_slot(particle.places, slot));
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const Vec3 per_voxel = gradient_at(polynomials_[c], place).cwiseProduct(frame_.scale);
      most = std::max(most, per_voxel.cwiseQuotient(pitch_mm_).norm() * outside_mm_ / channels_[c].tolerance);
    }
  }
  return most;
}

/// The same, and no less than anywhere in or beside the particles.
double TileFitter::bound_of_steepness(std::span<const std::uint32_t> particles) const {
  const Vec3 per_mm = frame_.scale.cwiseQuotient(pitch_mm_);
  double farthest = 0;
  for (const std::uint32_t p : particles) {
    const Box3& bounds = particles_[p].bounds;
    farthest =
        std::max({farthest, frame_(bounds.min()).cwiseAbs().maxCoeff(), frame_(bounds.max()).cwiseAbs().maxCoeff()});
  }
  farthest += per_mm.maxCoeff() * outside_mm_;
  double most = 0;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double slope = bound_of_slopes(polynomials_[c], farthest).cwiseProduct(per_mm).norm();
    most = std::max(most, slope * outside_mm_ / channels_[c].tolerance);
  }
  return most;
}

/// A side of it that is on the boundary may come near some voxel of the box.
bool TileFitter::is_at_boundary(const TileParticle& particle, const Box3& box) const {
  unsigned sides = 0;
  Vec3 end = Vec3::Ones();
  if (particle.brick == kNone) {
    sides = solid_->boundary_sides(particle.cell);
  } else {
    const CellBrick& brick = solid_->bricks()[particle.brick];
    sides = brick.boundary_sides;
    end = Vec3(brick.cells[0], brick.cells[1], brick.cells[2]);
  }
  const Box3 reached = particles_.reached(box);
  for (std::size_t side = 0; side < 6; ++side) {
    const auto axis = static_cast<Eigen::Index>(side / 2);
    const bool high = side % 2 != 0;
    if (!(sides >> side & 1) ||
        (high ? particle.parameters.high[axis] < end[axis] : particle.parameters.low[axis] > 0)) {
      continue;
    }
    Box3 face;
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const std::size_t at = n / kBlockStride[side / 2] % kBlockNodes;
      if (at == (high ? kBlockNodes - 1 : 0)) face.extend(at_slot(particle.places, block_slot(n)));
    }
    if (particle.box_around(face).intersects(reached)) return true;
  }
  return false;
}

}  // namespace ccslice
