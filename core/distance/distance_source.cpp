// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/distance_source.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <list>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/contour/tessellate.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {
namespace {

constexpr double kFinestMm = 0.002, kFineMm = 0.005;
constexpr double kFineShare = 1.0 / 100, kCoarsestShare = 1.0 / 10;  // Shares of the reach.

/// Distances that were made last, while the solids are there.
class KeptDistances {
 public:
  struct Entry {
    std::weak_ptr<const LimitSolid> solid;
    Mat3 placed;
    SurfaceKind kind;
    double reach_mm;
    std::shared_ptr<const BoundaryDistance> distance;

    bool is_like(const Entry& other) const {
      return !solid.owner_before(other.solid) && !other.solid.owner_before(solid) && placed == other.placed &&
             kind == other.kind && reach_mm == other.reach_mm;
    }
  };

  std::shared_ptr<const BoundaryDistance> find(const Entry& like) {
    const std::lock_guard lock(mutex_);
    const auto entry = std::ranges::find_if(kept_, [&](const Entry& each) { return each.is_like(like); });
    if (entry == kept_.end()) return nullptr;
    kept_.splice(kept_.begin(), kept_, entry);
    return kept_.front().distance;
  }
  void keep(Entry made) {
    const std::lock_guard lock(mutex_);
    kept_.push_front(std::move(made));
  }
  /// Lets go of those whose solids are gone, and of the oldest ones if all take too much. They grow while they are
  /// used, so this is for when a use has ended.
  void trim() {
    const std::lock_guard lock(mutex_);
    kept_.remove_if([](const Entry& entry) { return entry.solid.expired(); });
    std::size_t bytes = 0;
    const auto beyond = std::ranges::find_if(
        kept_, [&](const Entry& entry) { return (bytes += entry.distance->memory_bytes()) > kMostBytes; });
    kept_.erase(beyond, kept_.end());
  }

 private:
  static constexpr std::size_t kMostBytes = 64 << 20;

  std::mutex mutex_;
  std::list<Entry> kept_;
};

KeptDistances& kept_distances() {
  static KeptDistances kept;
  return kept;
}

IdRange<BoundaryFaceId> faces_of(const LimitSolid& solid, SurfaceKind kind) {
  const BoundarySurface surface(solid);
  return kind == SurfaceKind::kBoundary ? surface.face_ids() : surface.interface_ids();
}

}  // namespace

/// The surface as triangles, told before they are made.
struct DistanceSource::Surface {
  Placement placement = Placement::Identity();
  TessellationOptions options;
  std::size_t triangles = 0;
  double area_mm2 = 0;
};

DistanceSource::DistanceSource(ChannelRange range, std::shared_ptr<const LimitSolid> solid, const Mat3& placed,
                               SurfaceKind surface, double reach_mm)
    : range_(std::move(range)),
      solid_(std::move(solid)),
      placed_(placed),
      kind_(surface),
      reach_mm_(reach_mm),
      origin_(placed * solid_->summary().bounding_box.center()),
      farthest_mm_((placed.cwiseAbs() * solid_->summary().bounding_box.sizes()).norm() / 2) {
  const std::size_t faces = faces_of(*solid_, kind_).size();
  if (faces == 0) {
    throw Error(ErrorCode::kFieldInvalid,
                "the mesh has no cell regions that meet; ask for the distance from its boundary");
  }
  if (2 * faces <= kMostTriangles) return;
  throw Error(ErrorCode::kTooManyTriangles, "the surface has " + std::to_string(faces) + " faces, more than the " +
                                                std::to_string(kMostTriangles / 2) +
                                                " that distances are found from; use a coarser mesh");
}

DistanceSource::~DistanceSource() {
  solid_.reset();
  distance_.reset();
  kept_distances().trim();
}

const DistanceSource::Surface& DistanceSource::surface(const CancellationToken& cancel) const {
  std::call_once(bounded_, [&] {
    auto found = std::make_shared<Surface>();
    TessellationOptions& options = found->options;
    found->placement.linear() = placed_;
    options.tolerance_mm = std::clamp(kFineShare * reach_mm_, kFinestMm, kFineMm);
    struct TooMany {};
    for (;; options.tolerance_mm *= 2) {
      found->triangles = 0;
      found->area_mm2 = 0;
      const bool may_be_coarser = 2 * options.tolerance_mm <= kCoarsestShare * reach_mm_;
      const std::size_t most = may_be_coarser ? kManyTriangles : kMostTriangles;
      try {
        visit_leaves(*solid_, found->placement, options, faces_of(*solid_, kind_), [&](const std::array<Vec3, 4>& c) {
          throw_if_cancelled_in_place(cancel);
          if ((found->triangles += 2) > most) throw TooMany();
          found->area_mm2 += ((c[2] - c[0]).cross(c[3] - c[1])).norm() / 2;
        });
        break;
      } catch (const TooMany&) {
      }
    }
    surface_ = std::move(found);
  });
  return *surface_;
}

const BoundaryDistance& DistanceSource::distance(const CancellationToken& cancel) const {
  std::call_once(made_, [&] {
    KeptDistances::Entry entry{solid_, placed_, kind_, reach_mm_, nullptr};
    distance_ = kept_distances().find(entry);
    if (distance_) return;
    const Surface& of = surface(cancel);
    std::vector<FloatTriangle> triangles;
    triangles.reserve(of.triangles);
    visit_leaves(*solid_, of.placement, of.options, faces_of(*solid_, kind_), [&](const std::array<Vec3, 4>& c) {
      throw_if_cancelled_in_place(cancel);
      std::array<FloatPoint, 4> corners;
      std::ranges::transform(c, corners.begin(), [&](const Vec3& corner) { return to_float_point(corner - origin_); });
      triangles.push_back({corners[0], corners[1], corners[2]});
      triangles.push_back({corners[0], corners[2], corners[3]});
    });
    distance_ = std::make_shared<const BoundaryDistance>(std::move(triangles), reach_mm_, farthest_mm_);
    entry.distance = distance_;
    kept_distances().keep(std::move(entry));
  });
  return *distance_;
}

double DistanceSource::memory_bytes(const CancellationToken& cancel) const {
  const Surface& of = surface(cancel);
  const Vec3 box_mm = placed_.cwiseAbs() * solid_->summary().bounding_box.sizes();
  return BoundaryDistance::expected_bytes(static_cast<double>(of.triangles), of.area_mm2, box_mm, reach_mm_);
}

void DistanceSource::sample_row(const SourceRow& row, std::span<const std::span<const float>> /*inputs*/,
                                std::span<float> values) const {
  const std::span<float> sampled = values.first(row.count);
  const CancellationToken cancel = row.cancel != nullptr ? *row.cancel : CancellationToken();
  distance(cancel).sample(placed_ * row.mesh_first - origin_, placed_ * row.mesh_step, row.begin, row.bounds, sampled,
                          cancel);
  const auto least = static_cast<float>(range_.min), most = static_cast<float>(range_.max);
  if (least <= 0 && most >= static_cast<float>(reach_mm_)) return;
  for (float& value : sampled) value = std::min(std::max(value, least), most);
}

}  // namespace ccslice
