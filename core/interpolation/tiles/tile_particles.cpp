// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_particles.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/limit/cell_bricks.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kVoxelsAParticle = 48;  // Fewer are inverted as quickly as it is sampled and bounded.
constexpr std::size_t kFewest = 4;              // Boxes of few voxels may have so many.
// A particle may reach so far beyond the box of its samples, as a share of its size.
constexpr double kMargin = 0.06;
// As a share of the box's size: particles that stick out farther are halved. What lies in several cells is that smooth
// that it may stick out farther.
constexpr double kMostOver = 0.6, kMostOverOfBrick = 1.2;
constexpr double kLeastOver = 3;        // unless that is by so few voxels only,
constexpr double kMarginOver = 2.5;     // or by so few along an axis. However small, those that meet a box may by two.
constexpr double kMostResidual = 0.05;  // As a share of a tolerance, about.

}  // namespace

Box3 TileParticle::box_around(const Box3& samples) const {
  const Box3 box = grown(samples, kMargin);
  const Vec3 bulge = (samples.min() - box.min()).cwiseMax(residuals.bulge) + residuals.position;
  return Box3(samples.min() - bulge, samples.max() + bulge);
}

TileParticles::TileParticles(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                             std::shared_ptr<VoxelBlocks> blocks)
    : solid_(std::move(solid)),
      mesh_of_voxel_(voxel_of_mesh(spec.placement, spec.grid).inverse(Eigen::Affine)),
      pitch_mm_(spec.grid.pitch.x_mm, spec.grid.pitch.y_mm, spec.grid.pitch.z_mm),
      outside_voxels_(spec.outside_mm * pitch_mm_.cwiseInverse()),
      channels_(spec.channels),
      blocks_(blocks ? std::move(blocks) : std::make_shared<VoxelBlocks>(*solid_, spec)) {}

Box3 TileParticles::reached(const Box3& box) const {
  return Box3(box.min() - outside_voxels_, box.max() + outside_voxels_);
}

void TileParticles::clear() {
  used_ = 0;
  of_units_.clear();
  members_.clear();
}

TileParticles::Range TileParticles::enter(const Box3& box, std::uint64_t voxels, const Range& around,
                                          std::size_t most) {
  most = std::min<std::size_t>(most, voxels / kVoxelsAParticle + kFewest);
  const Box3 reached = this->reached(box);
  // members_ is a stack: those of a half come after those of the whole, and leave() takes them off again.
  if (!around.known) members_.clear();
  Range found{true, members_.size(), members_.size()};
  if (!around.known) {
    found.known = collect(reached, most);
  } else {
    for (std::size_t m = around.first; m < around.end && found.known; ++m) {
      found.known = add_meeting(members_[m], reached, found.first + most);
    }
  }
  if (!found.known) members_.resize(found.first);
  found.end = members_.size();
  return found;
}

void TileParticles::leave(const Range& range) { members_.resize(range.first); }

/// Whole bricks and cells first, by number: whatever order the index finds them in, fits are made of the same samples
/// in the same order. False if there are more than `most`.
bool TileParticles::collect(const Box3& box, std::size_t most) {
  const CellBricks& bricks = solid_->bricks();
  const auto first_cell = static_cast<std::uint32_t>(bricks.size());
  // A cell in no brick counts as many as a brick may have: where units are too many, not all cells need be met.
  constexpr std::size_t kCellsABrick = CellBricks::kMostCells * CellBricks::kMostCells * CellBricks::kMostCells;
  units_.clear();
  std::size_t cells = 0;
  bool too_many = solid_->index().cell_boxes.any_meeting(box.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
    const std::uint32_t brick = bricks.brick_of(LimitCellId{cell});
    const std::uint32_t unit = brick == kNone ? first_cell + cell : brick;
    if (units_.empty() || units_.back() != unit) units_.push_back(unit);
    cells += brick == kNone ? kCellsABrick : 1;
    return cells > kCellsABrick * most;
  });
  std::ranges::sort(units_);
  units_.erase(std::unique(units_.begin(), units_.end()), units_.end());
  too_many = too_many || units_.size() > most;
  if (too_many) return false;
  if (used_ + units_.size() > kMost) clear();
  return std::ranges::all_of(units_, [&](std::uint32_t unit) { return add_meeting(whole(unit), box, most); });
}

std::uint32_t TileParticles::whole(std::uint32_t unit) {
  const auto [place, is_new] = of_units_.try_emplace(unit, 0);
  if (!is_new) return place->second;
  const CellBricks& bricks = solid_->bricks();
  TileParticle particle;
  ParamBox all;
  if (unit < bricks.size()) {
    particle.brick = unit;
    const auto& cells = bricks[unit].cells;
    all.high = Vec3(cells[0], cells[1], cells[2]);
  } else {
    particle.cell = LimitCellId{unit - static_cast<std::uint32_t>(bricks.size())};
  }
  return place->second = add_particle(particle, all);
}

/// Adds the particle to the members, if it meets the box, or its parts, if it sticks out far or is too coarse.
bool TileParticles::add_meeting(std::uint32_t particle, const Box3& box, std::size_t most) {
  const TileParticle& met = *pool_[particle];
  if (!met.bounds.intersects(box)) return true;
  const unsigned axes = axes_to_halve(met, box);
  if (axes == 0) {
    members_.push_back(particle);
    return members_.size() <= most;
  }
  if (met.children == 0 && !halve(particle, axes)) return false;
  const std::uint32_t first = met.first_child, end = first + met.children;
  for (std::uint32_t child = first; child < end; ++child) {
    if (!add_meeting(child, box, most)) return false;
  }
  return true;
}

/// Bit a: the particle is to be halved along axis a of its parameters before it stands for what the box has of it.
unsigned TileParticles::axes_to_halve(const TileParticle& particle, const Box3& box) const {
  if (particle.coarse_axes != 0) return particle.coarse_axes;
  const Vec3 over = (box.min() - particle.bounds.min()).cwiseMax(particle.bounds.max() - box.max());
  const Vec3 over_mm = (over.array() <= kMarginOver).select(Vec3::Zero(), over.cwiseProduct(pitch_mm_));
  const double longest_mm = box.diagonal().cwiseProduct(pitch_mm_).maxCoeff();
  const double most_over = particle.brick == kNone ? kMostOver : kMostOverOfBrick;
  const double allowed_mm = std::max(most_over * longest_mm, kLeastOver * pitch_mm_.minCoeff());
  if (over_mm.maxCoeff() <= allowed_mm) return 0;
  Eigen::Index farthest = 0;
  over_mm.maxCoeff(&farthest);
  return 1u << axis_along(particle, farthest);
}

std::uint32_t TileParticles::add_particle(const TileParticle& like, const ParamBox& parameters) {
  if (used_ == pool_.size()) pool_.push_back(std::make_unique<TileParticle>());
  TileParticle& particle = *pool_[used_];
  particle.cell = like.cell;
  particle.brick = like.brick;
  particle.first_child = particle.children = 0;
  particle.parameters = parameters;
  sample(particle);
  return static_cast<std::uint32_t>(used_++);
}

void TileParticles::sample(TileParticle& particle) {
  if (particle.brick != kNone) {
    particle.one_patch = true;
    blocks_->sample(solid_->bricks()[particle.brick], particle.parameters, particle.places, particle.values,
                    particle.residuals);
  } else {
    particle.one_patch = blocks_->is_in_one_patch(particle.cell, particle.parameters);
    blocks_->sample(particle.cell, particle.parameters, particle.places, particle.values);
    particle.residuals.position.setZero();
    particle.residuals.bulge.setZero();
  }
  Box3 samples;
  for (std::size_t slot = 0; slot < kBlockSlots; ++slot) samples.extend(at_slot(particle.places, slot));
  particle.bounds = particle.box_around(samples);
  particle.coarse_axes = particle.brick == kNone ? 0 : coarse_axes(particle);
}

/// Those along which it has several cells, if one tricubic polynomial leaves so much of them out that it would matter.
unsigned TileParticles::coarse_axes(const TileParticle& particle) const {
  unsigned axes = 0;
  for (int a = 0; a < 3; ++a) {
    if (particle.parameters.high[a] - particle.parameters.low[a] > 1) axes |= 1u << a;
  }
  if (axes == 0) return 0;
  // Across all of it a channel changes by as much as its values differ: a residual of the position counts with that
  // slope.
  const double moved = particle.residuals.position.cwiseQuotient(particle.bounds.diagonal()).maxCoeff();
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    Lanes low = particle.values[c][0], high = low;
    for (const Lanes& values : particle.values[c]) low = lesser(low, values), high = greater(high, values);
    const double differ = largest(high) + largest(-low);
    if (!(particle.residuals.values[c] + differ * moved <= kMostResidual * channels_[c].tolerance)) return axes;
  }
  return 0;
}

/// The axis of its parameters that goes farthest along an axis of the voxels.
unsigned TileParticles::axis_along(const TileParticle& particle, Eigen::Index voxel_axis) const {
  constexpr std::size_t kHalf = kBlockNodes / 2, kMiddle = kBlockPoints / 2;
  Vec3 lengths;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto at = [&](std::size_t node) { return at_slot(particle.places, block_slot(node))[voxel_axis]; };
    lengths[static_cast<Eigen::Index>(a)] =
        std::abs(at(kMiddle + kHalf * kBlockStride[a]) - at(kMiddle - kHalf * kBlockStride[a]));
  }
  Eigen::Index axis = 0;
  lengths.maxCoeff(&axis);
  return static_cast<unsigned>(axis);
}

/// Halves it along all these axes (bit a: axis a), between two cells if there are several. False if there is no room.
bool TileParticles::halve(std::uint32_t particle, unsigned axes) {
  const ParamBox whole = pool_[particle]->parameters;
  const auto children = static_cast<std::uint32_t>(1 << std::popcount(axes));
  if (used_ + children > kMost) return false;
  pool_[particle]->first_child = static_cast<std::uint32_t>(used_);
  pool_[particle]->children = children;
  for (unsigned child = 0; child < 8; ++child) {
    if (child & ~axes) continue;
    ParamBox box = whole;
    for (int a = 0; a < 3; ++a) {
      if (!(axes >> a & 1)) continue;
      const double size = whole.high[a] - whole.low[a];
      const double middle = whole.low[a] + (size > 1 ? std::floor(0.5 * size) : 0.5 * size);
      (child >> a & 1 ? box.low : box.high)[a] = middle;
    }
    add_particle(*pool_[particle], box);
  }
  return true;
}

std::optional<CellParam> TileParticles::near(const Range& range, const Vec3& voxel) const {
  std::optional<CellParam> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (std::size_t m = range.first; m < range.end; ++m) {
    const TileParticle& particle = *pool_[members_[m]];
    const double distance = (particle.bounds.center() - voxel).cwiseProduct(pitch_mm_).squaredNorm();
    if (distance >= nearest_distance) continue;
    nearest_distance = distance;
    const Vec3 middle = 0.5 * (particle.parameters.low + particle.parameters.high);
    const CellBricks& bricks = solid_->bricks();
    nearest =
        particle.brick == kNone ? CellParam{particle.cell, middle} : bricks.cell_param(bricks[particle.brick], middle);
  }
  return nearest;
}

}  // namespace ccslice
