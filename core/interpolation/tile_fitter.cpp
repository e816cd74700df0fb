// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tile_fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kVoxelsAParticle = 48;  // Fewer are inverted as quickly as it is sampled and bounded.
constexpr std::size_t kMostParticles = 2048;    // Some 8 MiB; whole cells of a box inside may come on top.
constexpr std::size_t kFewest = 4;              // Boxes of few voxels may have so many.
constexpr double kMargin = 0.06;                // Of a particle's size: its faces lie that near to its nodes' box.
constexpr double kMostOver = 0.6;               // Of the box's size: particles that stick out farther are halved,
constexpr double kLeastOver = 3;                // unless that is by so few voxels only.
constexpr double kShareInPatch = 0.9;           // What bounds may take of a tolerance,
constexpr double kShareIrregular = 0.5;         // and what they may beside irregular lines, where they aren't proved.
constexpr std::size_t kManyParticles = 40, kSomeParticles = 6;  // Of more, fewer nodes each are fitted to.

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

TileFitter::TileFitter(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec)
    : solid_(std::move(solid)),
      mesh_of_voxel_(voxel_of_mesh(spec.placement, spec.grid).inverse(Eigen::Affine)),
      pitch_mm_(spec.grid.pitch.x_mm, spec.grid.pitch.y_mm, spec.grid.pitch.z_mm),
      outside_voxels_(spec.outside_mm * pitch_mm_.cwiseInverse()),
      outside_mm_(spec.outside_mm),
      channels_(spec.channels),
      blocks_(*solid_, spec) {}

void TileFitter::clear() {
  used_ = 0;
  members_.clear();
}

TileFitter::Particles TileFitter::enter(const Box3& box, std::uint64_t voxels, const Particles& around) {
  const std::size_t most = std::min<std::size_t>(kMostParticles, voxels / kVoxelsAParticle + kFewest);
  const Box3 reached(box.min() - outside_voxels_, box.max() + outside_voxels_);
  if (!around.known) clear();
  Particles found{true, members_.size(), members_.size()};
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

void TileFitter::leave(const Particles& particles) { members_.resize(particles.first); }

/// Whole cells first. False if there are more than `most`.
bool TileFitter::collect(const Box3& box, std::size_t most) {
  std::vector<std::uint32_t> cells;
  const bool too_many = solid_->data().cell_boxes.any_meeting(box.transformed(mesh_of_voxel_), [&](std::uint32_t cell) {
    cells.push_back(cell);
    return cells.size() > most;
  });
  if (too_many) return false;
  std::sort(cells.begin(), cells.end());
  return std::ranges::all_of(cells, [&](std::uint32_t cell) { return add_meeting(sample(cell, {}), box, most); });
}

/// Adds the particle to the members, if it meets the box, or its halves, if it sticks out far.
bool TileFitter::add_meeting(std::uint32_t particle, const Box3& box, std::size_t most) {
  const Box3 bounds = pool_[particle]->bounds;
  if (!bounds.intersects(box)) return true;
  const Vec3 over_mm = (box.min() - bounds.min()).cwiseMax(bounds.max() - box.max()).cwiseProduct(pitch_mm_);
  const double longest_mm = box.diagonal().cwiseProduct(pitch_mm_).maxCoeff();
  const double allowed_mm = std::max(kMostOver * longest_mm, kLeastOver * pitch_mm_.minCoeff());
  if (over_mm.maxCoeff() <= allowed_mm) {
    members_.push_back(particle);
    return members_.size() <= most;
  }
  if (pool_[particle]->first_child == 0) {
    if (used_ + 2 > kMostParticles) return false;
    Eigen::Index farthest = 0;
    over_mm.maxCoeff(&farthest);
    halve(particle, farthest);
  }
  const std::uint32_t first = pool_[particle]->first_child;
  return add_meeting(first, box, most) && add_meeting(first + 1, box, most);
}

std::uint32_t TileFitter::sample(std::uint32_t cell, const ParamBox& parameters) {
  if (used_ == pool_.size()) pool_.push_back(std::make_unique<Particle>());
  Particle& particle = *pool_[used_];
  particle.cell = cell;
  particle.first_child = 0;
  particle.parameters = parameters;
  particle.one_patch = blocks_.is_in_one_patch(cell, parameters);
  blocks_.sample(cell, parameters, particle.places, particle.values);
  particle.bounds = Box3();
  for (std::size_t slot = 0; slot < kBlockSlots; ++slot) particle.bounds.extend(at_slot(particle.places, slot));
  particle.bounds = grown(particle.bounds, kMargin);
  return static_cast<std::uint32_t>(used_++);
}

/// Along the axis of its parameters that goes farthest along an axis of the voxels.
void TileFitter::halve(std::uint32_t particle, Eigen::Index voxel_axis) {
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
  const std::uint32_t cell = pool_[particle]->cell;
  sample(cell, low);
  sample(cell, high);
}

TileFitter::Outcome TileFitter::fit(const Particles& particles, const Box3& box, std::uint64_t voxels,
                                    std::uint64_t least_voxels) {
  if (!particles.known) return Outcome::kHalve;
  const std::span<const std::uint32_t> members =
      std::span(members_).subspan(particles.first, particles.end - particles.first);
  if (members.empty()) return Outcome::kHopeless;
  const double error = fit_polynomials(members);
  if (!(error <= 1)) {
    // Errors of cubics fall with the fourth power of the size.
    const double halvings = std::log2(static_cast<double>(voxels) / static_cast<double>(least_voxels)) / 2;
    return error > std::exp2(4 * halvings + 4) ? Outcome::kHopeless : Outcome::kHalve;
  }
  double worst = 0, steepest = 0;
  bool at_boundary = false;
  for (const std::uint32_t m : members) {
    worst = std::max(bound_over(*pool_[m], 1), worst);  // Not a number stays that.
    if (!(worst <= 1)) return Outcome::kHalve;
    steepest = std::max(steepness(*pool_[m]), steepest);
    at_boundary = at_boundary || is_at_boundary(*pool_[m], box);
  }
  return at_boundary && !(worst * kShareInPatch + steepest <= 1) ? Outcome::kHalve : Outcome::kFits;
}

/// Returns the largest error at the nodes that are fitted to, as a share of its channel's tolerance.
double TileFitter::fit_polynomials(std::span<const std::uint32_t> particles) {
  Box3 nodes;
  const std::span<const std::size_t> slots = slots_to_fit(particles.size());
  places_.clear();
  for (const std::uint32_t p : particles) {
    for (const std::size_t slot : slots) {
      places_.push_back(at_slot(pool_[p]->places, slot));
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
      for (const std::size_t slot : slots) values_.push_back(pool_[p]->values[c][slot / kLanes][slot % kLanes]);
    }
    polynomials_.emplace_back();
    worst = std::max(fitter_.fit(values_, polynomials_.back()) / channels_[c].tolerance, worst);
  }
  return worst;
}

/// As a share of what it may be.
double TileFitter::bound_over(const Particle& particle, double enough) {
  const double share = particle.one_patch ? kShareInPatch : kShareIrregular;
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
    worst = std::max(bound_(polynomials_[c], errors, enough * allowed) / allowed, worst);
  }
  return worst;
}

/// How much of a tolerance following a polynomial may take, as far as voxels may lie off the solid, at the corners.
double TileFitter::steepness(const Particle& particle) const {
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

/// A side of it that is on the boundary may come near some voxel of the box.
bool TileFitter::is_at_boundary(const Particle& particle, const Box3& box) const {
  const unsigned sides = solid_->data().cells[particle.cell].boundary_sides;
  const Box3 reached(box.min() - outside_voxels_, box.max() + outside_voxels_);
  for (std::size_t side = 0; side < 6; ++side) {
    const auto axis = static_cast<Eigen::Index>(side / 2);
    const bool high = side % 2 != 0;
    if (!(sides >> side & 1) || (high ? particle.parameters.high[axis] < 1 : particle.parameters.low[axis] > 0))
      continue;
    Box3 face;
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      const std::size_t at = n / kBlockStride[side / 2] % kBlockNodes;
      if (at == (high ? kBlockNodes - 1 : 0)) face.extend(at_slot(particle.places, block_slot(n)));
    }
    if (grown(face, kMargin).intersects(reached)) return true;
  }
  return false;
}

std::optional<CellParam> TileFitter::near(const Particles& particles, const Vec3& voxel) const {
  std::optional<CellParam> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (std::size_t m = particles.first; m < particles.end; ++m) {
    const Particle& particle = *pool_[members_[m]];
    const double distance = (particle.bounds.center() - voxel).cwiseProduct(pitch_mm_).squaredNorm();
    if (distance >= nearest_distance) continue;
    nearest_distance = distance;
    nearest = CellParam{particle.cell, 0.5 * (particle.parameters.low + particle.parameters.high)};
  }
  return nearest;
}

}  // namespace ccslice
