// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_leaves.h"

#include <algorithm>
#include <cmath>

namespace ccslice {
namespace {

/// What remains at an irregular vertex becomes a leaf once its hull is this share of the tolerance.
constexpr double kIrregularShare = 0.125;
constexpr std::size_t kLeavesPerPoll = 256;

bool meets_plane_at_most_once(const std::array<double, 4>& z) {
  const bool rising = z[0] <= z[1] && z[1] <= z[2] && z[2] <= z[3];
  const bool falling = z[0] >= z[1] && z[1] >= z[2] && z[2] >= z[3];
  if (rising || falling) return true;
  const bool below = side_of(z[0]) == PlaneSide::kBelow;
  return std::all_of(z.begin(), z.end(), [below](double h) { return (side_of(h) == PlaneSide::kBelow) == below; });
}

/// Raises the degree of a quadratic, `stride` apart, to a cubic.
void raise_degree(const double* quadratic, int stride, double* cubic, int cubic_stride) {
  const double b0 = quadratic[0], b1 = quadratic[stride], b2 = quadratic[2 * stride];
  cubic[0] = b0;
  cubic[cubic_stride] = (b0 + 2 * b1) / 3;
  cubic[2 * cubic_stride] = (2 * b1 + b2) / 3;
  cubic[3 * cubic_stride] = b2;
}

/// The height increases (or decreases) strictly in direction s, in direction t, or along the gradient at the middle:
/// then its level lines are open inside.
bool is_monotone(const NetCoefficients& z) {
  std::array<double, 12> along_s, along_t;  // [3 * row + column]; [4 * row + column].
  for (int row = 0; row < 4; ++row) {
    for (int k = 0; k < 3; ++k) along_s[3 * row + k] = z[4 * row + k + 1] - z[4 * row + k];
  }
  for (int k = 0; k < 12; ++k) along_t[k] = z[k + 4] - z[k];
  const auto one_sign = [](const std::array<double, 12>& d) {
    const auto [low, high] = std::minmax_element(d.begin(), d.end());
    return *low > 0 || *high < 0;
  };
  if (one_sign(along_s) || one_sign(along_t)) return true;

  NetCoefficients z_s, z_t;
  for (int row = 0; row < 4; ++row) raise_degree(&along_s[3 * row], 1, &z_s[4 * row], 1);
  for (int column = 0; column < 4; ++column) raise_degree(&along_t[column], 4, &z_t[column], 4);
  const double a = evaluate_middle(z_s), b = evaluate_middle(z_t);
  for (int k = 0; k < 16; ++k) {
    if (a * z_s[k] + b * z_t[k] <= 0) return false;
  }
  return true;
}

bool is_resolved(const BezierNet& net) {
  int crossings = 0;
  for (int k = 0; k < 4; ++k) {
    if (!meets_plane_at_most_once(side_curve(net, k).z)) return false;
    crossings += side_of(net.z[kNetCorner[k]]) != side_of(net.z[kNetCorner[(k + 1) % 4]]);
  }
  return crossings <= 2 && is_monotone(net.z);
}

/// In the plane to within rounding: the signs of such heights are noise, and halving finds nothing but more of it.
bool lies_in_plane(const NetCoefficients& z, double margin) {
  return std::all_of(z.begin(), z.end(), [margin](double height) { return std::abs(height) <= 2 * margin; });
}

Box3 placed_hull(const IrregularCorner& corner, const AffineMap& map) {
  Box3 hull;
  for (const Vec3& point : corner.ring) hull.extend(map(point));
  return hull;
}

/// Bilinear between its corners, but for the two sides that regular neighbours within the face give.
ContourLeaf corner_leaf(const SurfaceBox& box, const Vec3& origin, const BezierCurve& right, const BezierCurve& top) {
  ContourLeaf leaf{.box = box, .resolved = true, .irregular = true, .net = {}};
  const auto bilinear = [](double p00, double p10, double p11, double p01, int k) {
    const double u = (k % 4) / 3.0, v = (k / 4) / 3.0;
    return (1 - v) * ((1 - u) * p00 + u * p10) + v * ((1 - u) * p01 + u * p11);
  };
  for (int k = 0; k < 16; ++k) {
    leaf.net.x[k] = bilinear(origin.x(), right.x[0], right.x[3], top.x[0], k);
    leaf.net.y[k] = bilinear(origin.y(), right.y[0], right.y[3], top.y[0], k);
    leaf.net.z[k] = bilinear(origin.z(), right.z[0], right.z[3], top.z[0], k);
  }
  set_side_curve(leaf.net, 1, right);
  set_side_curve(leaf.net, 2, top);
  return leaf;
}

}  // namespace

void ContourLeaves::collect(std::span<const std::uint32_t> faces, const LeafCriteria& criteria) {
  criteria_ = criteria;
  leaves_.clear();
  vertices_.clear();
  sides_.clear();
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (k % 32 == 0) criteria_.cancel.throw_if_cancelled();
    vertices_.enter_face(faces[k]);
    if (surface_.faces()[faces[k]].regular) {
      collect_box(transformed(surface_.regular_patch(faces[k]), criteria_.to_plane), SurfaceBox{.face = faces[k]});
    } else {
      collect_irregular(faces[k]);
    }
  }
  sides_.resize(vertices_.size(), PlaneSide::kUnknown);
}

void ContourLeaves::collect_irregular(std::uint32_t face) {
  surface_.irregular_corner(face, corner_);
  SurfaceBox box{.face = face};
  BezierCurve right, top;
  while (true) {
    const Box3 hull = placed_hull(corner_, criteria_.to_plane);
    if (hull.min().z() > criteria_.margin_mm || hull.max().z() < -criteria_.margin_mm) return;
    const double small_mm = std::min(kIrregularShare * criteria_.tolerance_mm, criteria_.small_mm);
    if (box.size < kSurfaceOne && (hull.diagonal().norm() <= small_mm || box.size <= kSmallestBox)) {
      return add(corner_leaf(box, criteria_.to_plane(surface_.corner_position(corner_)), right, top));
    }
    std::array<BezierPatch, 3> patches;
    surface_.split(corner_, patches, split_scratch_);
    const BezierNet east = transformed(patches[0], criteria_.to_plane);
    const BezierNet north = transformed(patches[1], criteria_.to_plane);
    const std::uint32_t half = box.size / 2;
    enter_vertex(face, {half, 0}, east.z[kNetCorner[0]]);
    enter_vertex(face, {box.size, half}, east.z[kNetCorner[2]]);
    enter_vertex(face, {half, box.size}, north.z[kNetCorner[2]]);
    enter_vertex(face, {0, half}, north.z[kNetCorner[0]]);
    collect_box(east, box.quarter(1, 0));
    collect_box(north, box.quarter(0, 1));
    collect_box(transformed(patches[2], criteria_.to_plane), box.quarter(1, 1));
    right = side_curve(east, 3);
    top = side_curve(north, 0);
    box = box.quarter(0, 0);
  }
}

void ContourLeaves::collect_box(const BezierNet& net, const SurfaceBox& box) {
  if (!straddles_zero(net.z, criteria_.margin_mm)) return;
  if (box.size > kSmallestBox && chord_bound(net) > criteria_.tolerance_mm) return halve_box(net, box);
  const bool resolved = is_resolved(net) || lies_in_plane(net.z, criteria_.margin_mm);
  if (resolved || box.size <= kSmallestBox || diagonal_xy(net) <= criteria_.small_mm) {
    return add({.box = box, .resolved = resolved, .irregular = false, .net = net});
  }
  halve_box(net, box);
}

void ContourLeaves::halve_box(const BezierNet& net, const SurfaceBox& box) {
  vertices_.enter_halving(box);
  HalvedCoefficients x, y, z;
  halve(net.x, x);
  halve(net.y, y);
  halve(net.z, z);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int i = quarter % 2, j = quarter / 2;
    BezierNet child;
    take_quarter(z, i, j, child.z);
    if (!straddles_zero(child.z, criteria_.margin_mm)) continue;
    take_quarter(x, i, j, child.x);
    take_quarter(y, i, j, child.y);
    collect_box(child, box.quarter(i, j));
  }
}

void ContourLeaves::add(const ContourLeaf& leaf) {
  if (leaves_.size() % kLeavesPerPoll == 0) criteria_.cancel.throw_if_cancelled();
  leaves_.push_back(leaf);
  for (int k = 0; k < 4; ++k) enter_vertex(leaf.box.face, leaf.box.corner(k), leaf.net.z[kNetCorner[k]]);
}

void ContourLeaves::enter_vertex(std::uint32_t face, const std::array<std::uint32_t, 2>& at, double height) {
  const std::uint32_t vertex = vertices_.insert(face, at[0], at[1]).first;
  sides_.resize(vertices_.size(), PlaneSide::kUnknown);
  if (sides_[vertex] == PlaneSide::kUnknown) sides_[vertex] = side_of(height);
}

}  // namespace ccslice
