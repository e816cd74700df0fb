// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/thin_features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include "core/inversion/point_inverter.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {
namespace {

constexpr int kSteps = 4;              // Along a way, so that a gap isn't jumped over.
constexpr double kJustTooThin = 0.99;  // Of least: what is as thick as that isn't warned of.
constexpr int kHalvings = 10;          // To a thousandth.
constexpr int kMostPerEdge = 8;        // Places of a face, each way.
constexpr std::uint32_t kFacesPerPoll = 8;

/// A place of the boundary, world frame.
struct Place {
  CellParam at;
  Vec3 position, outward;
};

class ThinSearch {
 public:
  ThinSearch(const LimitSolid& solid, const Placement& placement, const SmallestFeature& smallest)
      : solid_(solid),
        placement_(placement),
        to_mesh_(placement.inverse()),
        normals_(placement.linear().inverse().transpose()),
        smallest_(smallest),
        surface_(solid),
        evaluator_(solid),
        inverter_(solid, {.outside_mm = kOutsideMm}) {}

  ThinFeatures run(const CancellationToken& cancel) {
    const auto faces = static_cast<std::uint32_t>(surface_.faces().size());
    const std::uint32_t step = 1 + (faces - 1) / kMostThinSamples;
    const int per_edge = std::clamp(static_cast<int>(std::sqrt(kMostThinSamples / faces)), 1, kMostPerEdge);
    ThinFeatures found;
    for (std::uint32_t face = 0; face < faces; face += step) {
      if (face / step % kFacesPerPoll == 0) cancel.throw_if_cancelled();
      for (int k = 0; k < per_edge * per_edge; ++k) {
        ++found.samples;
        const auto place =
            place_of(BoundaryFaceId{face}, (k % per_edge + 0.5) / per_edge, (k / per_edge + 0.5) / per_edge);
        if (!place) continue;
        if (const auto thin = look(*place)) found.places.push_back(*thin);
      }
    }
    std::ranges::stable_sort(found.places, {},
                             [](const ThinPlace& place) { return place.thickness_mm / place.least_mm; });
    return found;
  }

 private:
  static constexpr double kOutsideMm = 1e-6;

  /// Nothing where the surface has no normal.
  std::optional<Place> place_of(BoundaryFaceId face, double s, double t) {
    const BoundaryFace& side = surface_.faces()[face];
    Place place{surface_.cell_param(face, s, t), {}, {}};
    const LimitSample sample = evaluator_.sample(place.at);
    // (J_b x J_c) . J_a = det J: the product points to where the axis a rises if det J is positive. Normals are mapped
    // by the inverse transpose, also where the placement mirrors.
    const int axis = side.cell_side / 2;
    const double sign = (side.cell_side % 2 == 1 ? 1 : -1) * (sample.jacobian.determinant() < 0 ? -1 : 1);
    const Vec3 normal = sign * sample.jacobian.col((axis + 1) % 3).cross(sample.jacobian.col((axis + 2) % 3));
    const Vec3 outward = normals_ * normal.normalized();
    if (!(outward.norm() > 0) || !outward.allFinite()) return std::nullopt;
    place.position = placement_ * sample.position;
    place.outward = outward.normalized();
    return place;
  }

  bool is_inside(const Vec3& point, std::optional<CellParam>& hint) {
    const auto result = inverter_.invert(to_mesh_ * point, hint);
    if (result) hint = result->at;
    return result.has_value();
  }

  /// How far it goes on inside from a place along a way: the end of the first of kSteps steps that ends outside, with
  /// what is known to be inside before; nothing if all end inside.
  struct Way {
    double inside_mm, outside_mm;
  };
  std::optional<Way> way_out(const Place& place, const Vec3& along, double length_mm) {
    std::optional<CellParam> hint = place.at;
    for (int step = 1; step <= kSteps; ++step) {
      const double at = length_mm * step / kSteps;
      if (!is_inside(place.position + at * along, hint)) return Way{length_mm * (step - 1) / kSteps, at};
    }
    return std::nullopt;
  }

  double thickness(const Place& place, Way way) {
    for (int i = 0; i < kHalvings; ++i) {
      std::optional<CellParam> hint = place.at;
      const double middle = (way.inside_mm + way.outside_mm) / 2;
      (is_inside(place.position - middle * place.outward, hint) ? way.inside_mm : way.outside_mm) = middle;
    }
    return way.outside_mm;
  }

  bool is_thin_on_leaning_ways(const Place& place, double length_mm) {
    static const double kSine = std::sin(kLeanDeg * std::numbers::pi / 180), kCosine = std::sqrt(1 - kSine * kSine);
    const Vec3 across = place.outward.unitOrthogonal(), other = place.outward.cross(across);
    for (const Vec3& lean : {Vec3(across), Vec3(-across), Vec3(other), Vec3(-other)}) {
      if (!way_out(place, kSine * lean - kCosine * place.outward, length_mm / kCosine)) return false;
    }
    return true;
  }

  std::optional<ThinPlace> look(const Place& place) {
    const double least = smallest_.least_mm(place.outward);
    const auto way = way_out(place, -place.outward, kJustTooThin * least);
    if (!way || !is_thin_on_leaning_ways(place, least)) return std::nullopt;
    return ThinPlace{place.position, thickness(place, *way), least, solid_.control_cell(place.at.cell)};
  }

  const LimitSolid& solid_;
  const Placement placement_, to_mesh_;
  const Mat3 normals_;  // To the world frame.
  const SmallestFeature smallest_;
  const BoundarySurface surface_;
  LimitEvaluator evaluator_;
  PointInverter inverter_;
};

}  // namespace

double SmallestFeature::least_mm(const Vec3& normal) const {
  return std::max(mm, normal.cwiseAbs().cwiseProduct(voxels_mm).maxCoeff());
}

ThinFeatures find_thin_features(const LimitSolid& solid, const Placement& placement, const SmallestFeature& smallest,
                                const CancellationToken& cancel) {
  if (smallest.mm == 0 && smallest.voxels_mm.isZero(0)) return {};
  return ThinSearch(solid, placement, smallest).run(cancel);
}

}  // namespace ccslice
