// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_truth.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/limit/cell_index.h"
#include "tests/oracle/nearest_places.h"

namespace ccslice::oracle {
namespace {

constexpr double kAcceptMm = 1e-6;         // As voxels are inverted: world mm.
constexpr double kRoundingOfSize = 1e-12;  // What doubles can reach.
constexpr int kMostSteps = 40, kMostHalvings = 8;
constexpr double kRivalsApart =
    0.1;  // Two places are one if they are nearer to each other, as a share of the way there.

InversionOptions options_of(const Placement& placement, double diagonal_mm, double outside_mm) {
  const Vec3 scales = scales_of(placement);
  InversionOptions options;
  options.accept_mm = std::max(kAcceptMm / scales[0], kRoundingOfSize * diagonal_mm);
  options.outside_mm = outside_mm / scales[2];
  return options;
}

double diagonal_of(const LimitSolid& solid) { return solid.summary().bounding_box.diagonal().norm(); }

}  // namespace

Vec3 scales_of(const Placement& placement) { return Eigen::JacobiSVD<Mat3>(placement.linear()).singularValues(); }

const char* to_text(VoxelPlace place) {
  switch (place) {
    case VoxelPlace::kInside: return "inside";
    case VoxelPlace::kOff: return "off the solid";
    case VoxelPlace::kAmbiguous: return "near a fold or overlap";
    case VoxelPlace::kOverlap: return "where cells overlap";
    default: return "nowhere";
  }
}

TruthFinder::TruthFinder(std::shared_ptr<const LimitSolid> solid, const Placement& placement, double outside_mm)
    : solid_(std::move(solid)),
      mesh_of_world_(placement.inverse(Eigen::Affine)),
      least_scale_(scales_of(placement)[2]),
      diagonal_mm_(diagonal_of(*solid_)),
      accept_mm_(options_of(placement, diagonal_mm_, outside_mm).accept_mm),
      inverter_(*solid_, options_of(placement, diagonal_mm_, outside_mm)) {}

std::optional<VoxelTruth> TruthFinder::find(const Vec3& world) {
  const Vec3 point = mesh_of_world_ * world;
  const auto found = inverter_.invert(point);
  if (!found) return std::nullopt;
  VoxelTruth truth;
  truth.at = found->at;
  truth.residual_mm = polish(point, truth.at);
  const Vec3 margin = Vec3::Constant(accept_mm_);
  const Box3 around(point - margin, point + margin);
  if (solid_->index().is_ambiguous(around)) {
    const bool overlaps = solid_->summary().overlaps.cells > 0 && !may_fold(around);
    truth.place = overlaps ? VoxelPlace::kOverlap : VoxelPlace::kAmbiguous;
  } else if (truth.residual_mm > accept_mm_) {
    truth.place = VoxelPlace::kOff;
    take_nearest(point, truth);
  } else if (is_inside_another(point, truth.at.cell)) {
    truth.place = VoxelPlace::kOverlap;
  }
  truth.values = values_at(truth.at);
  return truth;
}

bool TruthFinder::may_fold(const Box3& box) const {
  const CellIndex& index = solid_->index();
  return std::ranges::any_of(index.fold_cells,
                             [&](LimitCellId cell) { return index.cell_boxes.box(cell).intersects(box); });
}

bool TruthFinder::overlaps_another(LimitCellId cell) {
  for (int place = 0; place < 125; ++place) {
    const Vec3 uvw = Vec3(place % 5, place / 5 % 5, place / 25) / 4;
    if (is_inside_another(inverter_.evaluator().geo({cell, uvw}), cell)) return true;
  }
  return false;
}

/// A cell besides this one holds the point well within its sides. Found the slow way: from the middle of each cell's
/// eighths.
bool TruthFinder::is_inside_another(const Vec3& point, LimitCellId cell) {
  constexpr double kFromSides = 1e-3;
  const auto holds = [&](LimitCellId other) {
    for (int eighth = 0; eighth < 8; ++eighth) {
      CellParam at{other, Vec3(0.25 + 0.5 * (eighth & 1), 0.25 + 0.5 * (eighth >> 1 & 1), 0.25 + 0.5 * (eighth >> 2))};
      if (polish(point, at) > accept_mm_) continue;
      return at.uvw.minCoeff() > kFromSides && at.uvw.maxCoeff() < 1 - kFromSides;
    }
    return false;
  };
  return solid_->index().cell_boxes.any_meeting(
      Box3(point, point), [&](std::uint32_t item) { return item != cell && holds(LimitCellId{item}); });
}

/// Where another place is as near, there is no telling which a voxel takes.
void TruthFinder::take_nearest(const Vec3& point, VoxelTruth& truth) {
  const std::vector<NearPlace> places = nearest_places(inverter_.evaluator(), point, truth.residual_mm);
  if (places.empty()) return;
  const NearPlace& nearest = places.front();
  if (nearest.distance_mm < truth.residual_mm) {
    truth.at = nearest.at;
    truth.residual_mm = nearest.distance_mm;
  }
  if (truth.residual_mm <= accept_mm_) truth.place = VoxelPlace::kInside;
  for (const NearPlace& other : places) {
    const bool is_rival = other.distance_mm < nearest.distance_mm + accept_mm_ &&
                          (other.position - nearest.position).norm() > kRivalsApart * nearest.distance_mm;
    if (is_rival) truth.place = VoxelPlace::kAmbiguous;
  }
}

std::vector<double> TruthFinder::slack(const VoxelTruth& truth) {
  std::vector<double> slack(truth.values.size());
  const Vec3 middle = inverter_.evaluator().geo(truth.at);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> change(slack.size());
    for (const double side : {-1.0, 1.0}) {
      CellParam at = truth.at;
      polish(middle + side * accept_mm_ * Vec3::Unit(axis), at);
      const std::vector<double> values = values_at(at);
      for (std::size_t c = 0; c < change.size(); ++c) {
        change[c] = std::max(change[c], std::abs(values[c] - truth.values[c]));
      }
    }
    for (std::size_t c = 0; c < slack.size(); ++c) slack[c] += 2 * change[c];
  }
  return slack;
}

std::vector<VoxelTruth> TruthFinder::places_beyond_interfaces(const Vec3& world, const VoxelTruth& truth) {
  std::vector<VoxelTruth> beyond;
  if (!solid_->has_several_regions()) return beyond;
  const double within_mm = truth.residual_mm + accept_mm_;
  const Vec3 point = mesh_of_world_ * world;
  const auto add = [&](const CellParam& at, double distance_mm) {
    if (distance_mm > within_mm || region_of(at.cell) == region_of(truth)) return;
    beyond.push_back({at, distance_mm, truth.place, values_at(at)});
  };
  // Whole layers of voxels may lie on a plane interface, and Newton's method is far faster than the search.
  solid_->index().cell_boxes.visit_at(point, within_mm, [&](std::uint32_t item) {
    CellParam at{LimitCellId{item}, Vec3::Constant(0.5)};
    if (region_of(at.cell) == region_of(truth)) return;
    const double distance_mm = polish(point, at);
    add(at, distance_mm);
  });
  if (!beyond.empty()) return beyond;
  for (const NearPlace& place : nearest_places(inverter_.evaluator(), point, within_mm)) {
    add(place.at, place.distance_mm);
  }
  return beyond;
}

bool TruthFinder::region_is_near(std::uint8_t region, const Vec3& world, const VoxelTruth& truth, double world_mm) {
  const double within_mm = truth.residual_mm + accept_mm_ + world_mm / least_scale_;
  const std::vector<VoxelTruth> beyond = places_beyond_interfaces(world, truth);
  if (std::ranges::any_of(beyond, [&](const VoxelTruth& place) { return region_of(place) == region; })) return true;
  const std::vector<NearPlace> places = nearest_places(inverter_.evaluator(), mesh_of_world_ * world, within_mm);
  return std::ranges::any_of(places, [&](const NearPlace& place) {
    return place.distance_mm <= within_mm && region_of(place.at.cell) == region;
  });
}

/// Newton's method with halved steps, inside the cell. Returns the residual.
double TruthFinder::polish(const Vec3& point, CellParam& at) {
  LimitEvaluator& evaluator = inverter_.evaluator();
  LimitSample sample = evaluator.sample(at);
  double residual = (point - sample.position).norm();
  for (int step = 0; step < kMostSteps && residual > kRoundingOfSize * diagonal_mm_; ++step) {
    Vec3 move = sample.jacobian.fullPivLu().solve(point - sample.position);
    if (!move.allFinite()) break;
    bool nearer = false;
    for (int halving = 0; halving < kMostHalvings && !nearer; ++halving, move /= 2) {
      const CellParam next{at.cell, (at.uvw + move).cwiseMax(0).cwiseMin(1)};
      const LimitSample there = evaluator.sample(next);
      const double left = (point - there.position).norm();
      nearer = left < residual;
      if (!nearer) continue;
      at = next;
      sample = there;
      residual = left;
    }
    if (!nearer) break;
  }
  return residual;
}

std::vector<double> TruthFinder::values_at(const CellParam& at) {
  std::vector<double> values(solid_->channel_count());
  inverter_.evaluator().mat(at, values);
  return values;
}

}  // namespace ccslice::oracle
