// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tile_particles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kVoxelsAParticle = 48;  // Fewer are inverted as quickly as it is sampled and bounded.
constexpr std::size_t kFewest = 4;              // Boxes of few voxels may have so many.
constexpr double kMostOver = 0.6;    // As a share of the box's size: particles that stick out farther are halved.
constexpr double kLeastOver = 3;     // unless that is by so few voxels only,
constexpr double kMarginOver = 2.5;  // or by so few along an axis. However small, those that meet a box may by two.

}  // namespace

TileParticles::TileParticles(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                             std::shared_ptr<BlockStencils> stencils)
    : solid_(std::move(solid)),
      mesh_of_voxel_(voxel_of_mesh(spec.placement, spec.grid).inverse(Eigen::Affine)),
      pitch_mm_(spec.grid.pitch.x_mm, spec.grid.pitch.y_mm, spec.grid.pitch.z_mm),
      outside_voxels_(spec.outside_mm * pitch_mm_.cwiseInverse()),
      blocks_(*solid_, spec, std::move(stencils)) {}

Box3 TileParticles::reached(const Box3& box) const {
  return Box3(box.min() - outside_voxels_, box.max() + outside_voxels_);
}

void TileParticles::clear() {
  used_ = 0;
  of_cells_.clear();
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

/// Whole cells first, by number: whatever order the index finds them in, fits are made of the same samples in the same
/// order. False if there are more than `most`.
bool TileParticles::collect(const Box3& box, std::size_t most) {
  std::vector<LimitCellId> cells;
  const bool too_many =
      solid_->index().cell_boxes.any_meeting(box.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
        cells.emplace_back(cell);
        return cells.size() > most;
      });
  if (too_many) return false;
  if (used_ + cells.size() > kMost) clear();
  std::sort(cells.begin(), cells.end());
  return std::ranges::all_of(cells, [&](LimitCellId cell) { return add_meeting(all_of(cell), box, most); });
}

std::uint32_t TileParticles::all_of(LimitCellId cell) {
  const auto [place, is_new] = of_cells_.try_emplace(cell, 0);
  if (is_new) place->second = sample(cell, {});
  return place->second;
}

/// Adds the particle to the members, if it meets the box, or its halves, if it sticks out far.
bool TileParticles::add_meeting(std::uint32_t particle, const Box3& box, std::size_t most) {
  const Box3 bounds = pool_[particle]->bounds;
  if (!bounds.intersects(box)) return true;
  const Vec3 over = (box.min() - bounds.min()).cwiseMax(bounds.max() - box.max());
  const Vec3 over_mm = (over.array() <= kMarginOver).select(Vec3::Zero(), over.cwiseProduct(pitch_mm_));
  const double longest_mm = box.diagonal().cwiseProduct(pitch_mm_).maxCoeff();
  const double allowed_mm = std::max(kMostOver * longest_mm, kLeastOver * pitch_mm_.minCoeff());
  if (over_mm.maxCoeff() <= allowed_mm) {
    members_.push_back(particle);
    return members_.size() <= most;
  }
  if (pool_[particle]->first_child == 0) {
    if (used_ + 2 > kMost) return false;
    Eigen::Index farthest = 0;
    over_mm.maxCoeff(&farthest);
    halve(particle, farthest);
  }
  const std::uint32_t first = pool_[particle]->first_child;
  return add_meeting(first, box, most) && add_meeting(first + 1, box, most);
}

std::uint32_t TileParticles::sample(LimitCellId cell, const ParamBox& parameters) {
  if (used_ == pool_.size()) pool_.push_back(std::make_unique<TileParticle>());
  TileParticle& particle = *pool_[used_];
  particle.cell = cell;
  particle.first_child = 0;
  particle.parameters = parameters;
  particle.one_patch = blocks_.is_in_one_patch(cell, parameters);
  blocks_.sample(cell, parameters, particle.places, particle.values);
  particle.bounds = Box3();
  for (std::size_t slot = 0; slot < kBlockSlots; ++slot) particle.bounds.extend(at_slot(particle.places, slot));
  particle.bounds = grown(particle.bounds, kParticleMargin);
  return static_cast<std::uint32_t>(used_++);
}

/// Halves it along the axis of its parameters that goes farthest along an axis of the voxels.
void TileParticles::halve(std::uint32_t particle, Eigen::Index voxel_axis) {
  constexpr std::size_t kHalf = kBlockNodes / 2, kMiddle = std::tuple_size_v<BlockPoints> / 2;
  const ParamBox whole = pool_[particle]->parameters;
  Vec3 lengths;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto at = [&](std::size_t node) { return at_slot(pool_[particle]->places, block_slot(node))[voxel_axis]; };
    lengths[static_cast<Eigen::Index>(a)] =
        std::abs(at(kMiddle + kHalf * kBlockStride[a]) - at(kMiddle - kHalf * kBlockStride[a]));
  }
  Eigen::Index axis = 0;
  lengths.maxCoeff(&axis);
  ParamBox low = whole, high = whole;
  low.high[axis] = high.low[axis] = 0.5 * (whole.low[axis] + whole.high[axis]);
  pool_[particle]->first_child = static_cast<std::uint32_t>(used_);
  const LimitCellId cell = pool_[particle]->cell;
  sample(cell, low);
  sample(cell, high);
}

std::optional<CellParam> TileParticles::near(const Range& range, const Vec3& voxel) const {
  std::optional<CellParam> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (std::size_t m = range.first; m < range.end; ++m) {
    const TileParticle& particle = *pool_[members_[m]];
    const double distance = (particle.bounds.center() - voxel).cwiseProduct(pitch_mm_).squaredNorm();
    if (distance >= nearest_distance) continue;
    nearest_distance = distance;
    nearest = CellParam{particle.cell, 0.5 * (particle.parameters.low + particle.parameters.high)};
  }
  return nearest;
}

}  // namespace ccslice
