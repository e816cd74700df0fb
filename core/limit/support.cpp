// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/limit/halve_patch_net.h"

namespace ccslice {

namespace {

using Heights = std::array<double, 16>;  // A bicubic Bezier net of heights, 4 * row + column.

constexpr int kMaxDepth = 60;

double largest(const Heights& h) { return *std::max_element(h.begin(), h.end()); }
double largest_corner(const Heights& h) { return std::max({h[0], h[3], h[12], h[15]}); }

/// Second differences along columns (stride 1) or rows (stride 4).
double curvature(const Heights& h, std::size_t stride) {
  double most = 0;
  for (std::size_t line = 0; line < 4; ++line) {
    const std::size_t first = line * (stride == 1 ? 4 : 1);
    for (std::size_t i = 0; i < 2; ++i) {
      const std::size_t a = first + i * stride;
      most = std::max(most, std::abs(h[a] - 2 * h[a + stride] + h[a + 2 * stride]));
    }
  }
  return most;
}

struct BoundedFace {
  double bound;
  BoundaryFaceId face;
  bool operator<(const BoundedFace& other) const {
    return bound != other.bound ? bound < other.bound : face > other.face;
  }
};

class Search {
 public:
  Search(const BoundarySurface& surface, const Vec3& direction, const CancellationToken& cancel)
      : surface_(surface), direction_(direction), poll_(cancel) {}

  /// A linear function on a compact set is largest on its boundary, so the boundary's faces are enough, unless the
  /// solid folds out through them. They come by falling bounds: as soon as the next one is at most best_ + tolerance_,
  /// all that are left are. Few are looked at, so they are kept in a heap and not sorted.
  double run() {
    std::vector<BoundedFace> faces;
    faces.reserve(surface_.faces().size());
    double lowest = std::numeric_limits<double>::infinity();
    for (const BoundaryFaceId f : surface_.face_ids()) {
      poll_();
      const Box3& box = surface_.hull_box(f);
      faces.push_back({direction_.cwiseMax(0).dot(box.max()) + direction_.cwiseMin(0).dot(box.min()), f});
      lowest = std::min(lowest, direction_.cwiseMin(0).dot(box.max()) + direction_.cwiseMax(0).dot(box.min()));
    }
    std::make_heap(faces.begin(), faces.end());
    tolerance_ = std::max(1e-10 * (faces.front().bound - lowest), std::numeric_limits<double>::min());
    while (!faces.empty() && faces.front().bound > best_ + tolerance_) {
      const BoundaryFaceId face = faces.front().face;
      surface_.faces()[face].regular ? search(surface_.regular_patch(face)) : search_irregular(face);
      std::pop_heap(faces.begin(), faces.end());
      faces.pop_back();
    }
    return best_;
  }

 private:
  void search(const BezierPatch& patch) {
    Heights heights;
    for (std::size_t i = 0; i < 16; ++i) heights[i] = direction_.dot(patch.b[i].head<3>());
    search(heights, 0);
  }

  /// direction . S is a bicubic: its largest Bernstein coefficient bounds it, and those at corners are values. Others
  /// are off the values by about their second differences, which halving divides by four, so it is halved where these
  /// are larger. The half with the larger bound goes first: it is likelier to raise best_, which spares the other.
  void search(const Heights& heights, int depth) {
    poll_();
    best_ = std::max(best_, largest_corner(heights));
    if (largest(heights) <= best_ + tolerance_ || depth == kMaxDepth) return;
    const std::size_t stride = curvature(heights, 1) >= curvature(heights, 4) ? 1 : 4;
    Heights low, high;
    halve_patch_net(heights, stride, low, high);
    const bool low_first = largest(low) >= largest(high);
    search(low_first ? low : high, depth + 1);
    search(low_first ? high : low, depth + 1);
  }

  /// No rule of the surface has a negative weight: of k edges a vertex keeps 1 - 7/(4k) of itself, 1/8 even for k = 2.
  /// So what remains at the corner lies in its ring's hull. The ring shrinks geometrically, by 0.65 a level at most
  /// around a smooth vertex: kMaxDepth levels leave some 1e-11 of it.
  void search_irregular(BoundaryFaceId face) {
    IrregularCorner corner;
    std::array<BezierPatch, 3> patches;
    surface_.irregular_corner(face, corner);
    best_ = std::max(best_, direction_.dot(surface_.corner_position(corner)));
    for (int depth = 0; depth < kMaxDepth; ++depth) {
      double bound = -std::numeric_limits<double>::infinity();
      for (const PaddedPoint& p : corner.ring) bound = std::max(bound, direction_.dot(p.head<3>()));
      if (bound <= best_ + tolerance_) return;
      surface_.split(corner, patches);
      for (const BezierPatch& patch : patches) search(patch);
    }
  }

  const BoundarySurface& surface_;
  Vec3 direction_;
  PeriodicPoll poll_;
  double best_ = -std::numeric_limits<double>::infinity();
  double tolerance_ = 0;
};

}  // namespace

std::vector<double> support(const BoundarySurface& surface, std::span<const Vec3> directions,
                            const CancellationToken& cancel) {
  std::vector<double> values;
  for (const Vec3& direction : directions) {
    cancel.throw_if_cancelled();
    values.push_back(Search(surface, direction, cancel).run());
  }
  return values;
}

Box3 bounding_box(const BoundarySurface& surface, const Placement& placement, const CancellationToken& cancel) {
  const Mat3& linear = placement.linear();
  std::vector<Vec3> directions;
  for (const double sign : {1.0, -1.0}) {
    for (int axis = 0; axis < 3; ++axis) directions.push_back(sign * linear.row(axis).transpose());
  }
  const std::vector<double> s = support(surface, directions, cancel);
  return Box3(placement.translation() - Vec3(s[3], s[4], s[5]), placement.translation() + Vec3(s[0], s[1], s[2]));
}

}  // namespace ccslice
