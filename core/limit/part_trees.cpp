// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/part_trees.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "core/limit/cell_index.h"
#include "core/limit/patch.h"
#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr std::uint8_t kMostHalvings = 7;   // Of a patch along an axis.
constexpr std::uint8_t kDeepestLevel = 12;  // Towards irregular lines and vertices.
constexpr double kLonger = 0.6;             // Axes are halved along which a part is so long, of its longest one.
constexpr int kRounds = 3;                  // After one search in vain.
constexpr double kRounding = 1e-9;          // Of a box's size.
constexpr double kThin = 1e-3;              // Maps are those of parts whose Jacobians aren't as singular as that.

/// What is left there is beside the cell's vertex, not beside a line.
bool is_beside_vertex(const LimitCell& cell, const PatchPath& path) {
  return cell.cell_class == CellClass::kVertex && path.child == 0;
}

BezierVolume net_of(double* grid) {
  bspline_to_bezier(grid, 3, kPositionDimension);
  BezierVolume net;
  for (std::size_t p = 0; p < net.size(); ++p) net[p] = Eigen::Vector4d::Map(grid + kPositionDimension * p);
  return net;
}

}  // namespace

PartTrees::PartTrees(const LimitSolid& solid, double distance_mm)
    : solid_(solid), distance_mm_(distance_mm), builder_(solid.data(), kPositionDimension), grid_(kPatchPoints) {}

/// Calls accept(node) for the leaves that may hold the point, until it is true.
template <typename Accept>
bool PartTrees::any_leaf(std::uint32_t root, const Vec3& point, Accept accept) const noexcept {
  std::array<std::uint32_t, 8 * (3 * kMostHalvings + 2 * kDeepestLevel)> stack;
  std::size_t depth = 0;
  stack[depth++] = root;
  while (depth > 0) {
    const std::uint32_t n = stack[--depth];
    const Node& node = nodes_[n];
    if (((node.map * (point - node.origin) - node.middle).array().abs() > 1).any()) continue;
    if (node.children == 0 || node.children == kWhole) {
      if (accept(n)) return true;
      continue;
    }
    if (depth + node.children > stack.size()) return true;
    for (std::uint32_t c = 0; c < node.children; ++c) stack[depth++] = node.first_child + c;
  }
  return false;
}

bool PartTrees::may_hold(LimitCellId cell, const Vec3& point) const noexcept {
  const auto root = roots_.find(cell);
  return root == roots_.end() || any_leaf(root->second, point, [](std::uint32_t) { return true; });
}

void PartTrees::refine(LimitCellId cell, const Vec3& point) noexcept {
  try {
    if (nodes_.empty()) nodes_.reserve(kMostNodes);
    for (int round = 0; round < kRounds; ++round) {
      if (nodes_.size() + 1 + 8 * kMostLeaves > kMostNodes) {
        nodes_.clear();  // Most of them are of cells that layers have left behind.
        roots_.clear();
      }
      const auto [root, is_new] = roots_.try_emplace(cell, static_cast<std::uint32_t>(nodes_.size()));
      if (is_new) append_root(cell);
      std::array<std::uint32_t, kMostLeaves> leaves;
      std::size_t count = 0;
      const bool holds_whole = any_leaf(root->second, point, [&](std::uint32_t leaf) {
        if (nodes_[leaf].children == kWhole) return true;
        leaves[count++] = leaf;
        return count == kMostLeaves;
      });
      if (count == 0 || (holds_whole && count < kMostLeaves)) return;
      for (std::size_t i = 0; i < count; ++i) divide(cell, leaves[i]);
    }
  } catch (const std::bad_alloc&) {
    return;  // Some parts stay as large as they are.
  }
}

void PartTrees::append_root(LimitCellId cell) {
  const bool is_regular = solid_.cell_class(cell) == CellClass::kRegular;
  nodes_.push_back({Mat3::Zero(), Vec3::Zero(), Vec3::Zero(), Part{{}, {}, {}, !is_regular}});
}

void PartTrees::divide(LimitCellId cell, std::uint32_t node) {
  // The map's rows are as long as one over half the box's extents.
  const bool is_small = nodes_[node].map.rowwise().norm().minCoeff() * 2 * distance_mm_ > 1;
  const auto first = static_cast<std::uint32_t>(nodes_.size());
  if (!is_small) nodes_[node].part.is_rest ? divide_rest(cell, node) : divide_patch(cell, node);
  const std::size_t children = nodes_.size() - first;
  nodes_[node].children = children == 0 ? kWhole : static_cast<std::uint16_t>(children);
  nodes_[node].first_child = first;
}

/// Into what the next level has, patches and line sub-cells, and what is left after it.
void PartTrees::divide_rest(LimitCellId cell, std::uint32_t node) {
  const LimitCell& limit_cell = solid_.data().cells[cell];
  PatchPath path = nodes_[node].part.path;
  if (is_beside_vertex(limit_cell, path)) {
    if (path.level >= kDeepestLevel) return;
    for (path.child = 1; path.child < 8; ++path.child) {
      const bool is_line = sub_cell_of(solid_.data(), limit_cell, path).cell_class == CellClass::kLine;
      is_line ? append_rest(cell, path) : append_patch(cell, path);
    }
    path.child = 0;
    ++path.level;
  } else {
    if (path.line_level >= kDeepestLevel) return;
    for (path.line_child = 1; path.line_child < 4; ++path.line_child) append_patch(cell, path);
    path.line_child = 0;
    ++path.line_level;
  }
  append_rest(cell, path);
}

void PartTrees::append_patch(LimitCellId cell, const PatchPath& path) {
  builder_.build(solid_.data().cells[cell], path, grid_.data());
  append_net(net_of(grid_.data()), solid_.index().cell_maps[cell].inverse_jacobian, Part{path, {}, {}, false});
}

void PartTrees::append_rest(LimitCellId cell, const PatchPath& path) {
  const std::span<const double> points = builder_.points_of_rest(solid_.data().cells[cell], path);
  hull_.clear();
  for (std::size_t i = 0; i < points.size(); i += kPositionDimension) hull_.emplace_back(Vec3::Map(&points[i]));
  append(hull_, solid_.index().cell_maps[cell].inverse_jacobian, Part{path, {}, {}, true});
}

void PartTrees::divide_patch(LimitCellId cell, std::uint32_t node) {
  const Part part = nodes_[node].part;
  builder_.build(solid_.data().cells[cell], part.path, grid_.data());
  std::vector<std::pair<BezierVolume, Part>> pieces = {{net_of(grid_.data()), part}};
  BezierVolume& net = pieces.front().first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int bit = part.halvings[axis] - 1; bit >= 0; --bit) {
      BezierVolume low, high;
      halve_net(net, axis, low, high);
      net = part.index[axis] >> bit & 1 ? high : low;
    }
  }
  const Vec3 lengths = edges_of(net).colwise().norm();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double length = lengths[static_cast<Eigen::Index>(axis)];
    if (!(length >= kLonger * lengths.maxCoeff()) || part.halvings[axis] == kMostHalvings) continue;
    const std::size_t count = pieces.size();
    for (std::size_t i = 0; i < count; ++i) {
      std::pair<BezierVolume, Part> low = pieces[i], high = pieces[i];
      halve_net(pieces[i].first, axis, low.first, high.first);
      ++low.second.halvings[axis], ++high.second.halvings[axis];
      low.second.index[axis] = static_cast<std::uint8_t>(2 * low.second.index[axis]);
      high.second.index[axis] = static_cast<std::uint8_t>(low.second.index[axis] + 1);
      pieces[i] = low;
      pieces.push_back(high);
    }
  }
  if (pieces.size() == 1) return;
  const Mat3 of_parent = nodes_[node].map;
  for (const auto& [piece, place] : pieces) append_net(piece, of_parent, place);
}

void PartTrees::append_net(const BezierVolume& net, const Mat3& of_parent, const Part& part) {
  const Mat3 edges = edges_of(net);
  const bool is_thin = !(std::abs(edges.determinant()) > kThin * edges.colwise().norm().prod());
  hull_.clear();
  for (const Eigen::Vector4d& p : net) hull_.push_back(p.head<3>());
  append(hull_, is_thin ? of_parent : Mat3(edges.inverse()), part);
}

void PartTrees::append(std::span<const Vec3> hull, const Mat3& map, const Part& part) {
  Box3 box;
  for (const Vec3& point : hull) box.extend(map * (point - hull.front()));
  const Vec3 half =
      0.5 * box.sizes() + distance_mm_ * map.rowwise().norm() + Vec3::Constant(kRounding) + kRounding * box.sizes();
  const Vec3 per_half = half.cwiseInverse();
  Node node{per_half.asDiagonal() * map, hull.front(), per_half.cwiseProduct(box.center()), part};
  // Where that are no numbers, the box is all of space.
  if (!node.map.allFinite() || !node.middle.allFinite()) node.map.setZero(), node.middle.setZero();
  nodes_.push_back(node);
}

}  // namespace ccslice
