// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/boundary_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ccslice {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr double kRounding = 1e-6;  // What floats lose, as a share of the size of what they tell.
constexpr double kLevel = 1e-9;     // Less of a row's step than that across it is rounding.

// Cubes are halved to about so many that cover the surface, or a share of the reach or of a triangle, and further, up
// to kFinerTimes, where more groups than these may be the nearest. All chosen by time: finer cubes take longer to make
// than they save.
constexpr double kCubesOfSurface = 1e5, kCubesInReach = 10, kShareOfTriangle = 0.15, kFinerTimes = 2,
                 kCubesAlongBlock = 8;
constexpr std::size_t kFewGroups = 8;
constexpr std::size_t kMostBlocks = std::size_t{1} << 17;

float least(const FloatLanes& lanes) noexcept {
  float result = lanes[0];
  for (std::size_t k = 1; k < kFloatLanes; ++k) result = std::min(result, lanes[k]);
  return result;
}

double cube_of(double area_mm2, double triangles, double reach_mm) {
  return std::max({std::sqrt(area_mm2 / kCubesOfSurface), reach_mm / kCubesInReach,
                   kShareOfTriangle * std::sqrt(area_mm2 / triangles)});
}

}  // namespace

BoundaryDistance::Blocks BoundaryDistance::blocks_of(const Vec3& box_mm, double cube_mm) {
  Blocks blocks;
  for (blocks.edge_mm = kCubesAlongBlock * cube_mm;; blocks.edge_mm *= 2) {
    double count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double along = std::ceil(box_mm[static_cast<Eigen::Index>(a)] / blocks.edge_mm) + 1;
      blocks.along[a] = static_cast<std::size_t>(std::min(along, double{kMostBlocks}));
      count *= along;
    }
    blocks.count = static_cast<std::size_t>(std::min(count, 2 * double{kMostBlocks}));
    if (blocks.count <= kMostBlocks) return blocks;
  }
}

BoundaryDistance::BoundaryDistance(std::vector<FloatTriangle> triangles, double reach_mm, double farthest_mm)
    : triangles_(std::move(triangles)), reach_mm_(static_cast<float>(reach_mm)) {
  const Box3 box(to_vec3(triangles_.box().min), to_vec3(triangles_.box().max));
  rounding_mm_ = kRounding * (box.sizes().norm() + box.center().norm() + farthest_mm);
  cube_mm_ = cube_of(triangles_.area_mm2(), static_cast<double>(kFloatLanes * triangles_.group_count()), reach_mm);
  size_ = blocks_of(box.sizes(), cube_mm_);
  low_ = box.min() - Vec3::Constant(size_.edge_mm / 3);  // Some room all round.
  blocks_ = std::make_unique<Block[]>(size_.count);
  bytes_ = triangles_.group_count() * TriangleTree::kBytesPerGroup + size_.count * sizeof(Block);
}

double BoundaryDistance::expected_bytes(double triangles, double area_mm2, const Vec3& box_mm, double reach_mm) {
  constexpr double kBytesPerTriangle =
      static_cast<double>(TriangleTree::kBytesPerGroup) / kFloatLanes + 3 * sizeof(FloatTriangle);  // While sorted.
  constexpr double kGroupsOfLeaf = 12;
  constexpr double kBytesPerCube = 1.5 * sizeof(Node) + sizeof(Leaf) + kGroupsOfLeaf * sizeof(std::uint32_t);
  const double cube = cube_of(area_mm2, triangles, reach_mm);
  // A cube with many groups near it is halved once more.
  const double groups_near = triangles / kFloatLanes * cube * cube / area_mm2;
  const double halved = groups_near > kFewGroups / 4.0 ? 8 : 2;
  const double in_reach = 2 * area_mm2 * (reach_mm + 2 * cube), in_box = (box_mm + Vec3::Constant(2 * cube)).prod();
  const double cubes = halved * std::min(in_reach, in_box) / (cube * cube * cube);
  return triangles * kBytesPerTriangle + cubes * kBytesPerCube +
         static_cast<double>(blocks_of(box_mm, cube).count) * (sizeof(Block) + sizeof(Cubes));
}

/// Halves a block into cubes.
class BoundaryDistance::Halver {
 public:
  Halver(const BoundaryDistance& whole, Cubes& cubes, const CancellationToken& cancel)
      : whole_(whole), triangles_(whole.triangles_), cubes_(cubes), cancel_(cancel) {}

  void run(const DistanceCube& cube) {
    const double bound = whole_.reach_mm_ + cube.radius();
    cubes_.nodes.emplace_back();
    examine(0, cube, triangles_.find_near(cube.box(), static_cast<float>(bound)));
  }

 private:
  /// `candidates`: groups, all that may be the nearest in the cube among them.
  void examine(std::size_t node, const DistanceCube& cube, const std::vector<std::uint32_t>& candidates);

  const BoundaryDistance& whole_;
  const TriangleTree& triangles_;
  Cubes& cubes_;
  const CancellationToken& cancel_;
};

void BoundaryDistance::Halver::examine(std::size_t node, const DistanceCube& cube,
                                       const std::vector<std::uint32_t>& candidates) {
  constexpr double kSlack = 1.001;  // For edges that were halved.
  throw_if_cancelled_in_place(cancel_);
  const FloatPoint middle = to_float_point(cube.middle);
  const PointLanes in_lanes = in_all_lanes(middle);
  const auto most = static_cast<float>(whole_.reach_mm_ + cube.radius() + whole_.rounding_mm_);
  float squared = most * most;
  const std::uint32_t* nearest = nullptr;
  for (const std::uint32_t& group : candidates) {
    if (triangles_.box(group).squared_distance(middle) >= squared) continue;
    const FloatLanes of_group = triangles_.group(group).squared_distances(in_lanes);
    const float of_nearest = least(of_group);
    if (of_nearest >= squared) continue;
    squared = of_nearest;
    nearest = &group;
  }
  cubes_.nodes[node].distance = std::sqrt(squared);
  if (nearest == nullptr) return;
  const bool is_small = 2 * cube.half <= kSlack * whole_.cube_mm_;
  const std::vector<std::uint32_t> kept =
      nearest_somewhere(triangles_, cube, candidates, *nearest, is_small, whole_.rounding_mm_);
  const bool is_smallest = 2 * cube.half <= kSlack * whole_.cube_mm_ / kFinerTimes;
  if (is_smallest || (is_small && kept.size() <= kFewGroups)) {
    cubes_.nodes[node].kind = Node::Kind::kLeaf;
    cubes_.nodes[node].first = static_cast<std::uint32_t>(cubes_.leaves.size());
    const auto first_group = static_cast<std::uint32_t>(cubes_.groups.size());
    cubes_.groups.insert(cubes_.groups.end(), kept.begin(), kept.end());
    cubes_.leaves.emplace_back(first_group, static_cast<std::uint32_t>(cubes_.groups.size()));
    return;
  }
  const std::size_t first = cubes_.nodes.size();
  cubes_.nodes[node].first = static_cast<std::uint32_t>(first);
  cubes_.nodes[node].kind = Node::Kind::kHalved;
  cubes_.nodes.resize(first + 8);
  for (unsigned child = 0; child < 8; ++child) examine(first + child, cube.child(child), kept);
}

/// The block that holds a point, or kNoBlock, and its cube.
std::size_t BoundaryDistance::block_of(const Vec3& point, DistanceCube& cube) const noexcept {
  std::size_t block = 0;
  cube.half = size_.edge_mm / 2;
  for (std::size_t a = 3; a-- > 0;) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double at = std::floor((point[axis] - low_[axis]) / size_.edge_mm);
    if (!(at >= 0 && at < static_cast<double>(size_.along[a]))) return kNoBlock;
    block = block * size_.along[a] + static_cast<std::size_t>(at);
    cube.middle[axis] = low_[axis] + (at + 0.5) * size_.edge_mm;
  }
  return block;
}

const BoundaryDistance::Cubes& BoundaryDistance::cubes_of(std::size_t block, const DistanceCube& cube,
                                                          const CancellationToken& cancel) const {
  Block& of = blocks_[block];
  std::call_once(of.made, [&] {
    auto cubes = std::make_unique<Cubes>();
    Halver(*this, *cubes, cancel).run(cube);
    cubes->nodes.shrink_to_fit();
    cubes->groups.shrink_to_fit();
    bytes_ += sizeof(Cubes) + cubes->nodes.size() * sizeof(Node) + cubes->leaves.size() * sizeof(Leaf) +
              cubes->groups.size() * sizeof(std::uint32_t);
    of.cubes = std::move(cubes);
  });
  return *of.cubes;
}

struct BoundaryDistance::Row {
  const Vec3& first;
  const Vec3& step;
  std::uint32_t begin;
  std::span<const float> bounds;
  std::span<float> values;
  double step_mm = step.norm();
  Vec3 per_step = step.cwiseInverse();
  std::array<Eigen::Index, 3> moving = {};  // Axes along which it goes on, rounding apart.
  std::size_t moving_count = 0;

  void find_axes() {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (std::abs(step[axis]) > kLevel * step_mm) moving[moving_count++] = axis;
    }
  }
  std::span<const Eigen::Index> axes() const { return std::span(moving).first(moving_count); }
  Vec3 at(std::size_t k) const { return first + static_cast<double>(begin + k) * step; }
  void fill(std::size_t from, std::size_t end, float value) const {
    std::ranges::fill(values.subspan(from, end - from), value);
  }
  /// There are bounds, all farther from the distance than `apart`.
  bool is_far_from_bounds(double distance, double apart) const {
    return !bounds.empty() && std::ranges::none_of(bounds, [&](float b) { return std::abs(distance - b) <= apart; });
  }
};

void BoundaryDistance::sample(const Vec3& first, const Vec3& step, std::uint32_t begin,
                              std::span<const float> bounds_mm, std::span<float> values,
                              const CancellationToken& cancel) const {
  Row row{first, step, begin, bounds_mm, values};
  row.find_axes();
  for (std::size_t k = 0; k < values.size();) {
    const Vec3 point = row.at(k);
    DistanceCube cube;
    const std::size_t block = block_of(point, cube);
    if (block == kNoBlock) {
      const FloatPoint alone = to_float_point(point);
      values[k++] = distance(triangles_.find_near({alone, alone}, reach_mm_), point);
      continue;
    }
    auto steps = static_cast<double>(values.size() - k);
    for (const Eigen::Index axis : row.axes()) {
      const double side = cube.middle[axis] + std::copysign(cube.half, step[axis]);
      steps = std::min(steps, (side - point[axis]) * row.per_step[axis]);
    }
    const std::size_t end = k + static_cast<std::size_t>(std::max(1.0, std::ceil(steps)));
    const Cubes& cubes = cubes_of(block, cube, cancel);
    walk(cubes, cubes.nodes.front(), cube, row, k, end);
    k = end;
  }
}

/// Sets the values of points [begin, end), all of which are in the cube.
void BoundaryDistance::walk(const Cubes& cubes, const Node& node, const DistanceCube& cube, const Row& row,
                            std::size_t begin, std::size_t end) const {
  const float shown = std::min(node.distance, reach_mm_);
  if (node.kind == Node::Kind::kBeyondReach) return row.fill(begin, end, reach_mm_);
  if (row.is_far_from_bounds(node.distance, cube.radius() + rounding_mm_)) return row.fill(begin, end, shown);
  if (node.kind == Node::Kind::kLeaf) return sample_leaf(cubes, cubes.leaves[node.first], cube, row, begin, end);
  // The row leaves a child for another where it crosses a plane through the middle.
  std::array<std::size_t, 5> cuts = {begin};
  std::size_t count = 1;
  for (const Eigen::Index axis : row.axes()) {
    const double at = std::ceil((cube.middle[axis] - row.first[axis]) * row.per_step[axis]) - row.begin;
    if (!(at > static_cast<double>(begin) && at < static_cast<double>(end))) continue;
    const auto cut = static_cast<std::size_t>(at);
    std::size_t place = count++;
    for (; cuts[place - 1] > cut; --place) cuts[place] = cuts[place - 1];
    cuts[place] = cut;
  }
  cuts[count] = end;
  for (std::size_t i = 0; i < count; ++i) {
    if (cuts[i] == cuts[i + 1]) continue;
    const Vec3 within = row.first + (row.begin + 0.5 * static_cast<double>(cuts[i] + cuts[i + 1] - 1)) * row.step;
    unsigned child = 0;
    for (unsigned axis = 0; axis < 3; ++axis) child |= (within[axis] >= cube.middle[axis] ? 1u : 0u) << axis;
    walk(cubes, cubes.nodes[node.first + child], cube.child(child), row, cuts[i], cuts[i + 1]);
  }
}

/// `groups`: the nearest among them, if it is within reach.
float BoundaryDistance::distance(std::span<const std::uint32_t> groups, const Vec3& point) const noexcept {
  const FloatPoint at = to_float_point(point);
  const PointLanes in_lanes = in_all_lanes(at);
  float squared = reach_mm_ * reach_mm_;
  for (const std::uint32_t group : groups) {
    if (triangles_.box(group).squared_distance(at) >= squared) continue;
    squared = std::min(squared, least(triangles_.group(group).squared_distances(in_lanes)));
  }
  return std::min(std::sqrt(squared), reach_mm_);
}

void BoundaryDistance::sample_leaf(const Cubes& cubes, const Leaf& leaf, const DistanceCube& cube, const Row& row,
                                   std::size_t begin, std::size_t end) const {
  const auto groups = std::span(cubes.groups).subspan(leaf.first_group, leaf.end_group - leaf.first_group);
  const auto look = [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) row.values[k] = distance(groups, row.at(k));
  };
  if (row.bounds.empty()) return look(begin, end);
  std::call_once(leaf.slab_made, [&] { leaf.slab = slab_of(triangles_, cube, groups, rounding_mm_); });
  const DistanceSlab& slab = leaf.slab;
  // n x at point k is first + k step. About in the middle of its bounds, which are on one side of those of the row but
  // where it is between bound + least and bound + most.
  const Vec3 n = to_vec3(slab.n);
  const double step = n.dot(row.step), first = n.dot(row.first) + row.begin * step;
  const double middle = 0.5 * (static_cast<double>(slab.least) + slab.most);
  for (std::size_t k = begin; k < end; ++k) {
    row.values[k] = std::clamp(static_cast<float>(first + static_cast<double>(k) * step - middle), 0.0f, reach_mm_);
  }
  for (const float bound : row.bounds) {
    const double low = bound + slab.least - first, high = bound + slab.most - first;
    if (std::abs(step) < kRounding * row.step_mm || row.step_mm == 0) {  // The row is level.
      if (low <= rounding_mm_ && high >= -rounding_mm_) look(begin, end);
      continue;
    }
    const auto point_at = [&](double nx) {
      return static_cast<std::size_t>(std::clamp(nx / step, static_cast<double>(begin), static_cast<double>(end)));
    };
    look(point_at(step > 0 ? low : high), std::min(end, point_at(step > 0 ? high : low) + 1));
  }
}

}  // namespace ccslice
