// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/overlap_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace ccslice {

namespace {

// Gauss points across lines, and their weights.
constexpr std::array<double, 3> kAcross = {0.11270166537925831, 0.5, 0.88729833462074169};
constexpr std::array<double, 3> kWeight = {5.0 / 18, 8.0 / 18, 5.0 / 18};
constexpr double kStep = 0.5;  // Between places on a line.

/// To the nearest side of a cell, to first order. mm. 0 where the cell is flat.
double to_nearest_side_mm(const PlaceInCell& place) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double along = place.uvw[axis];
    nearest = std::min(nearest, std::min(along, 1 - along) / place.inverse_jacobian.row(axis).norm());
  }
  return std::isfinite(nearest) ? nearest : 0;
}

}  // namespace

void CellOverlap::add(const OverlapPartner& partner) {
  const auto at = std::ranges::lower_bound(partners, partner.cell, {}, &OverlapPartner::cell);
  if (at == partners.end() || at->cell != partner.cell) {
    partners.insert(at, partner);
  } else {
    at->volume_mm3 += partner.volume_mm3;
    if (partner.depth_mm > at->depth_mm) at->position = partner.position, at->depth_mm = partner.depth_mm;
  }
}

void OverlapMeasure::collect(LimitCellId cell) {
  candidates_.clear(), touching_.clear();
  const Box3 box = index_.cell_boxes.box(cell);
  const CellMap map = index_.cell_maps[cell];
  index_.cell_boxes.any_meeting(box, [&](std::uint32_t item) {
    const LimitCellId other{item};
    ++work_;
    if (other == cell) return false;
    if (solid_.touch(cell, other)) {
      touching_.push_back(other);
    } else if (index_.cell_maps[other].may_meet(box) && map.may_meet(index_.cell_boxes.box(other))) {
      candidates_.push_back(other);
    }
    return false;
  });
  std::ranges::sort(candidates_);
  std::ranges::sort(touching_);
  if (candidates_.size() > kMostCandidates) candidates_.resize(kMostCandidates);
}

OverlapMeasure::Place OverlapMeasure::look(const CellParam& at, bool on_boundary, CellOverlap& found) {
  const LimitSample sample = probe_.evaluator().sample(at);
  Place place{sample.position, sample.jacobian, {}, {}};
  for (const LimitCellId other : candidates_) {
    const auto in = probe_.find(other, place.position);
    if (!in) continue;
    if (!place.in) place.in = in, place.holder = other;
    double depth_mm = 0;
    if (on_boundary) depth_mm = std::isfinite(in->depth_mm) ? in->depth_mm : to_nearest_side_mm(*in);
    found.add({other, place.position, depth_mm});
  }
  return place;
}

double OverlapMeasure::reach(const Place& place, const Vec3& along) const {
  const Vec3 pace = place.in->inverse_jacobian * along;  // Through the holder, for one parameter of the cell.
  const unsigned sides = solid_.boundary_sides(place.holder);
  double least = std::numeric_limits<double>::infinity();
  for (int side = 0; side < 6; ++side) {
    if (!(sides >> side & 1)) continue;
    const double at = place.in->uvw[side / 2], way = side % 2 == 1 ? 1 - at : at;
    const double towards = side % 2 == 1 ? pace[side / 2] : -pace[side / 2];
    if (towards > 0) least = std::min(least, way / towards);
  }
  return std::isfinite(least) ? std::min(least, kStep) : kStep / 2;
}

OverlapMeasure::AlongAxis OverlapMeasure::measure(LimitCellId cell, int axis, CellOverlap& found) {
  const unsigned sides = solid_.boundary_sides(cell);
  AlongAxis along;
  along.ends = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      std::array<Place, 3> line;
      for (int k = 0; k < 3; ++k) {
        Vec3 uvw;
        uvw[axis] = kStep * k, uvw[(axis + 1) % 3] = kAcross[i], uvw[(axis + 2) % 3] = kAcross[j];
        const bool on_boundary = k != 1 && (sides >> (2 * axis + k / 2) & 1);
        line[static_cast<std::size_t>(k)] = look({cell, uvw}, on_boundary, found);
      }
      const auto add = [&](const Place& place, double length) {
        const double volume = std::abs(place.jacobian.determinant());
        along.volumes_mm3.emplace_back(place.holder, kWeight[i] * kWeight[j] * length * volume);
      };
      for (std::size_t k = 0; k < 2; ++k) {
        const Place &low = line[k], &high = line[k + 1];
        if (low.in && high.in) {
          add(low, kStep / 2);
          add(high, kStep / 2);
        } else if (low.in || high.in) {
          const Place& inner = low.in ? low : high;
          add(inner, reach(inner, inner.jacobian.col(axis) * (low.in ? 1.0 : -1.0)));
          ++along.ends;
        }
      }
    }
  }
  return along;
}

CellOverlap OverlapMeasure::examine(LimitCellId cell) {
  CellOverlap found;
  collect(cell);
  if (candidates_.empty()) return found;
  AlongAxis best;
  for (int axis = 0; axis < 3; ++axis) {
    AlongAxis along = measure(cell, axis, found);
    if (along.ends > best.ends) best = std::move(along);
  }
  for (const auto& [partner, volume_mm3] : best.volumes_mm3) found.add({partner, Vec3::Zero(), 0, volume_mm3});
  Box3 near;
  for (const OverlapPartner& partner : found.partners) near.extend(index_.cell_boxes.box(partner.cell));
  for (const LimitCellId other : touching_) {
    if (near.intersects(index_.cell_boxes.box(other))) found.neighbours.push_back(other);
  }
  return found;
}

}  // namespace ccslice
