// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/point_clusters.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "core/mesh/disjoint_sets.h"

namespace ccslice {
namespace {

using Points = std::span<std::uint32_t>;

class ClusterFinder {
 public:
  ClusterFinder(std::span<const Vec3> points, double distance)
      : points_(points), distance_(distance), sets_(points.size()) {}

  DisjointSets& run();

 private:
  /// A point in a cube of the grid.
  struct Entry {
    std::uint64_t cube;  // Its hash: cubes that share one only have more points looked at.
    std::uint32_t point;
  };

  void add_entries(std::uint32_t point, const Vec3& low, double side, std::vector<Entry>& entries) const;
  Box3 box_of(Points points) const;
  /// Moves the points beyond the middle of the box's longest side to the back, and says where they begin.
  std::size_t halve(Points points, const Box3& box) const;
  void unite(Points points);
  void unite_between(Points a, Points b);
  bool any_within(Points a, Points b) const;
  void unite_all(Points points) {
    for (const std::uint32_t point : points) sets_.unite(points.front(), point);
  }

  std::span<const Vec3> points_;
  double distance_;
  DisjointSets sets_;
};

std::uint64_t mixed(std::uint64_t hash, std::int64_t number) {
  hash = (hash ^ static_cast<std::uint64_t>(number)) * 0x9e3779b97f4a7c15ull;
  return hash ^ std::rotr(hash, 29);
}

void ClusterFinder::add_entries(std::uint32_t point, const Vec3& low, double side, std::vector<Entry>& entries) const {
  std::array<std::array<std::int64_t, 2>, 3> cubes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double at = (points_[point][a] - low[a]) / side;
    // A little more than the distance: with 2^30 cubes division rounds by a millionth of one at most.
    const double reach = distance_ / side + 1e-6;
    cubes[axis] = {static_cast<std::int64_t>(std::floor(at - reach)),
                   static_cast<std::int64_t>(std::floor(at + reach))};
  }
  for (std::int64_t x = cubes[0][0]; x <= cubes[0][1]; ++x) {
    for (std::int64_t y = cubes[1][0]; y <= cubes[1][1]; ++y) {
      for (std::int64_t z = cubes[2][0]; z <= cubes[2][1]; ++z) {
        entries.push_back({mixed(mixed(mixed(0, x), y), z), point});
      }
    }
  }
}

Box3 ClusterFinder::box_of(Points points) const {
  Box3 box;
  for (const std::uint32_t point : points) box.extend(points_[point]);
  return box;
}

std::size_t ClusterFinder::halve(Points points, const Box3& box) const {
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const double low = box.min()[axis], high = box.max()[axis], middle = low + (high - low) / 2;
  // Rounded, the middle of two neighbouring numbers is one of them: the lower one belongs to the front.
  const auto back = std::partition(points.begin(), points.end(), [&](std::uint32_t point) {
    const double at = points_[point][axis];
    return at <= middle && at < high;
  });
  return static_cast<std::size_t>(back - points.begin());
}

void ClusterFinder::unite(Points points) {
  constexpr std::size_t kFew = 8;
  if (points.size() <= kFew) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if ((points_[points[i]] - points_[points[j]]).norm() <= distance_) sets_.unite(points[i], points[j]);
      }
    }
    return;
  }
  const Box3 box = box_of(points);
  if (box.diagonal().norm() <= distance_) return unite_all(points);
  const std::size_t half = halve(points, box);
  unite(points.first(half));
  unite(points.subspan(half));
  unite_between(points.first(half), points.subspan(half));
}

/// The points of each box that is no longer than the distance are united already.
void ClusterFinder::unite_between(Points a, Points b) {
  const Box3 box_a = box_of(a), box_b = box_of(b);
  if (box_a.exteriorDistance(box_b) > distance_) return;
  const double length_a = box_a.diagonal().norm(), length_b = box_b.diagonal().norm();
  if (std::max(length_a, length_b) <= distance_) {
    if (!sets_.same(a.front(), b.front()) && any_within(a, b)) sets_.unite(a.front(), b.front());
    return;
  }
  const bool first = length_a >= length_b;
  const Points halved = first ? a : b, other = first ? b : a;
  const std::size_t half = halve(halved, first ? box_a : box_b);
  unite_between(halved.first(half), other);
  unite_between(halved.subspan(half), other);
}

bool ClusterFinder::any_within(Points a, Points b) const {
  constexpr std::size_t kFewPairs = 64;
  const auto within = [&](std::uint32_t i, std::uint32_t j) { return (points_[i] - points_[j]).norm() <= distance_; };
  if (a.size() * b.size() <= kFewPairs) {
    return std::ranges::any_of(a, [&](auto i) { return std::ranges::any_of(b, [&](auto j) { return within(i, j); }); });
  }
  const Box3 box_a = box_of(a), box_b = box_of(b);
  if (box_a.exteriorDistance(box_b) > distance_) return false;
  if (box_a.merged(box_b).diagonal().norm() <= distance_) return true;
  const double length_a = box_a.diagonal().norm(), length_b = box_b.diagonal().norm();
  if (length_a == 0 && length_b == 0) return within(a.front(), b.front());
  const bool first = length_a >= length_b;
  const Points halved = first ? a : b, other = first ? b : a;
  const std::size_t half = halve(halved, first ? box_a : box_b);
  return any_within(halved.first(half), other) || any_within(halved.subspan(half), other);
}

DisjointSets& ClusterFinder::run() {
  constexpr double kDistancesOnASide = 8, kMostCubesOnASide = 0x1p30;
  Box3 box;
  for (const Vec3& point : points_) {
    if (point.allFinite()) box.extend(point);
  }
  const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
  const double side = std::max({kDistancesOnASide * distance_, extent / kMostCubesOnASide, 1e-300});
  if (!std::isfinite(extent) || !std::isfinite(side)) return sets_;
  // Parts often begin at a round number, and have points at its multiples: walls lie elsewhere.
  const Vec3 low = box.isEmpty() ? Vec3::Zero() : Vec3(box.min() - Vec3::Constant(0.37 * side));
  std::vector<Entry> entries;
  entries.reserve(points_.size() + points_.size() / 2);
  for (std::uint32_t point = 0; point < points_.size(); ++point) {
    if (points_[point].allFinite()) add_entries(point, low, side, entries);
  }
  std::ranges::sort(entries, {}, [](const Entry& entry) { return std::pair(entry.cube, entry.point); });
  std::vector<std::uint32_t> cube;
  for (auto first = entries.begin(); first != entries.end();) {
    const auto end = std::find_if(first, entries.end(), [&](const Entry& entry) { return entry.cube != first->cube; });
    cube.clear();
    for (auto entry = first; entry != end; ++entry) cube.push_back(entry->point);
    // A point comes twice where two of its cubes share a hash; one pair more does no harm.
    if (cube.size() > 1) unite(cube);
    first = end;
  }
  return sets_;
}

double length_of(std::span<const Vec3> points, const PointCluster& cluster) {
  constexpr std::size_t kMostCompared = 64;
  if (cluster.points.size() > kMostCompared) return cluster.box.diagonal().norm();
  double length = 0;
  for (std::size_t i = 0; i < cluster.points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      length = std::max(length, (points[cluster.points[i]] - points[cluster.points[j]]).norm());
    }
  }
  return length;
}

}  // namespace

std::vector<PointCluster> find_point_clusters(std::span<const Vec3> points, double distance) {
  ClusterFinder finder(points, distance);
  DisjointSets& sets = finder.run();
  std::vector<std::uint32_t> number(points.size(), 0);  // Of the cluster, from 1, by first point.
  std::vector<PointCluster> clusters;
  for (std::uint32_t point = 0; point < points.size(); ++point) {
    const std::uint32_t first = sets.first_of(point);
    if (first == point) continue;
    if (number[first] == 0) {
      clusters.push_back({{first}, Box3(points[first], points[first])});
      number[first] = static_cast<std::uint32_t>(clusters.size());
    }
    PointCluster& cluster = clusters[number[first] - 1];
    cluster.points.push_back(point);
    cluster.box.extend(points[point]);
  }
  std::ranges::sort(clusters, {}, [](const PointCluster& cluster) { return cluster.points.front(); });
  for (PointCluster& cluster : clusters) cluster.length = length_of(points, cluster);
  return clusters;
}

}  // namespace ccslice
