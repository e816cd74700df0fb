// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/surface_tree.h"

#include <algorithm>

namespace ccslice {
namespace {

bool is_monotone(const std::array<double, 4>& z) {
  const bool rising = z[0] <= z[1] && z[1] <= z[2] && z[2] <= z[3];
  const bool falling = z[0] >= z[1] && z[1] >= z[2] && z[2] >= z[3];
  return rising || falling;
}

/// Raises the degree of a quadratic, `stride` apart, to a cubic.
void raise_degree(const double* quadratic, int stride, double* cubic, int cubic_stride) {
  const double b0 = quadratic[0], b1 = quadratic[stride], b2 = quadratic[2 * stride];
  cubic[0] = b0;
  cubic[cubic_stride] = (b0 + 2 * b1) / 3;
  cubic[2 * cubic_stride] = (2 * b1 + b2) / 3;
  cubic[3 * cubic_stride] = b2;
}

using SlopeCoefficients = std::array<double, 12>;

bool has_one_strict_sign(const SlopeCoefficients& slopes) {
  const Eigen::Map<const Eigen::Array<double, 12, 1>> values(slopes.data());
  return values.minCoeff() > 0 || values.maxCoeff() < 0;
}

/// The height z rises everywhere along (a, b), its gradient at the middle: a z_s + b z_t has positive coefficients
/// only, hence positive values. A closed level line has two points on some line along (a, b), where z would be the
/// same. If z rises along any direction, it most likely does along this one. z_s has degree (2, 3) and z_t (3, 2):
/// raised to (3, 3) they can be added.
bool rises_along_middle_gradient(const SlopeCoefficients& along_s, const SlopeCoefficients& along_t) {
  NetCoefficients z_s, z_t;
  for (int row = 0; row < 4; ++row) raise_degree(&along_s[3 * row], 1, &z_s[4 * row], 1);
  for (int column = 0; column < 4; ++column) raise_degree(&along_t[column], 4, &z_t[column], 4);
  const double a = evaluate_middle(z_s), b = evaluate_middle(z_t);
  for (int k = 0; k < 16; ++k) {
    if (a * z_s[k] + b * z_t[k] <= 0) return false;
  }
  return true;
}

/// Differences of neighbouring coefficients are the coefficients of the slopes, but for a factor of 3. If they have one
/// sign, so has the slope in the whole box, and each level line is a graph over the other parameter.
LevelLines level_lines_of(const NetCoefficients& z) {
  SlopeCoefficients along_s, along_t;  // [3 * row + column]; [4 * row + column].
  for (int row = 0; row < 4; ++row) {
    for (int k = 0; k < 3; ++k) along_s[3 * row + k] = z[4 * row + k + 1] - z[4 * row + k];
  }
  for (int k = 0; k < 12; ++k) along_t[k] = z[k + 4] - z[k];
  const bool across_s = has_one_strict_sign(along_s), across_t = has_one_strict_sign(along_t);
  if (across_s || across_t) {
    return across_s && across_t ? LevelLines::kAcrossST : across_s ? LevelLines::kAcrossS : LevelLines::kAcrossT;
  }
  return rises_along_middle_gradient(along_s, along_t) ? LevelLines::kOpen : LevelLines::kUnknown;
}

/// A net that is bilinear between its corners, but for sides 1 and 2.
BezierNet corner_net(const Vec3& origin, const BezierCurve& right, const BezierCurve& top) {
  BezierNet net;
  const auto bilinear = [](double p00, double p10, double p11, double p01, int k) {
    const double u = (k % 4) / 3.0, v = (k / 4) / 3.0;
    return (1 - v) * ((1 - u) * p00 + u * p10) + v * ((1 - u) * p01 + u * p11);
  };
  for (int k = 0; k < 16; ++k) {
    net.x[k] = bilinear(origin.x(), right.x[0], right.x[3], top.x[0], k);
    net.y[k] = bilinear(origin.y(), right.y[0], right.y[3], top.y[0], k);
    net.z[k] = bilinear(origin.z(), right.z[0], right.z[3], top.z[0], k);
  }
  set_side_curve(net, 1, right);
  set_side_curve(net, 2, top);
  return net;
}

}  // namespace

bool SurfaceTree::start(const AffineMap& to_axes, std::size_t nodes_of_last_layer) {
  const bool same = to_axes.linear == to_axes_.linear && to_axes.offset == to_axes_.offset && !face_slots_.empty();
  if (same && nodes_.size() <= std::max(kKeptNodes, 8 * nodes_of_last_layer)) return false;
  to_axes_ = to_axes;
  nodes_.clear();
  nets_.clear();
  vertices_.clear();
  face_slots_.assign(surface_.faces_and_interfaces().size(), kNone);
  faces_.clear();
  middles_.clear();
  ring_count_ = 0;
  quarters_.clear();
  return true;
}

const SurfaceTree::Face& SurfaceTree::face_of(BoundaryFaceId id) {
  if (face_slots_[id] != kNone) return faces_[face_slots_[id]];
  Face face;
  face.first_middle = static_cast<std::uint32_t>(middles_.size());
  vertices_.enter_coarser_middles(id, middles_);
  face.middle_count = static_cast<std::uint32_t>(middles_.size()) - face.first_middle;
  if (surface_.faces_and_interfaces()[id].regular) {
    face.root = add_node({.face = id}, transformed(surface_.regular_patch(id), to_axes_));
  } else {
    if (ring_count_ == rings_.size()) rings_.emplace_back();
    IrregularCorner& ring = rings_[ring_count_];
    surface_.irregular_corner(id, ring);
    for (PaddedPoint& point : ring.ring) point = to_axes_.padded(point);
    face.root = add_remainder({.face = id}, static_cast<std::uint32_t>(ring_count_++));
  }
  face_slots_[id] = static_cast<std::uint32_t>(faces_.size());
  return faces_.emplace_back(face);
}

std::span<const std::uint32_t> SurfaceTree::coarser_middles(BoundaryFaceId id) {
  const Face& face = face_of(id);
  return std::span(middles_).subspan(face.first_middle, face.middle_count);
}

std::uint32_t SurfaceTree::add_node(const SurfaceBox& box, const BezierNet& net) {
  const CoefficientHull heights = hull_of(net.z);
  SurfaceNode& node = nodes_.emplace_back();
  nets_.push_back(net);
  node.box = box;
  node.low = heights.low;
  node.high = heights.high;
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t SurfaceTree::add_remainder(const SurfaceBox& box, std::uint32_t ring) {
  Eigen::AlignedBox4d hull;
  for (const PaddedPoint& point : rings_[ring].ring) hull.extend(point);
  const Vec3 vertex = surface_.corner_position(rings_[ring]);
  BezierNet net;
  net.x.fill(vertex.x());
  net.y.fill(vertex.y());
  net.z.fill(vertex.z());
  const std::uint32_t id = add_node(box, net);
  SurfaceNode& node = nodes_[id];
  node.remainder = true;
  node.ring = ring;
  node.low = hull.min().z();
  node.high = hull.max().z();
  node.diagonal = hull.diagonal().norm();
  return id;
}

const SurfaceNode& SurfaceTree::examine(std::uint32_t id) {
  SurfaceNode& node = nodes_[id];
  if (node.examined) return node;
  node.examined = true;
  for (int k = 0; k < 4; ++k) {
    const auto [s, t] = node.box.corner(k);
    node.corners[k] = vertices_.insert(node.box.face, s, t).first;
  }
  node.middles = vertices_.enter_middles(node.box);
  if (node.remainder) return node;
  const BezierNet& net = nets_[id];
  for (int side = 0; side < 4; ++side) {
    if (is_monotone(side_curve(net, side).z)) node.monotone_sides |= 1u << side;
  }
  node.level_lines = level_lines_of(net.z);
  node.chord = chord_bound(net);
  node.diagonal = diagonal_xy(net);
  return node;
}

std::uint32_t SurfaceTree::children(std::uint32_t id) {
  if (nodes_[id].children == kNone) {
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    nodes_[id].remainder ? add_quarters_of_remainder(id) : add_quarters_of_net(id);
    nodes_[id].children = first;
  }
  return nodes_[id].children;
}

void SurfaceTree::add_quarters_of_net(std::uint32_t id) {
  const std::array<BezierNet, 4> children = quarters_of(nets_[id]);
  const SurfaceBox box = nodes_[id].box;
  for (int quarter = 0; quarter < 4; ++quarter) {
    add_node(box.quarter(quarter % 2, quarter / 2), children[static_cast<std::size_t>(quarter)]);
  }
}

void SurfaceTree::add_quarters_of_remainder(std::uint32_t id) {
  const SurfaceBox box = nodes_[id].box;
  const std::uint32_t ring = nodes_[id].ring;
  std::array<BezierPatch, 3> patches;
  surface_.split(rings_[ring], patches);
  std::array<std::uint32_t, 4> quarters;
  quarters[0] = add_remainder(box.quarter(0, 0), ring);
  quarters[1] = add_node(box.quarter(1, 0), net_of(patches[0]));
  quarters[2] = add_node(box.quarter(0, 1), net_of(patches[1]));
  quarters[3] = add_node(box.quarter(1, 1), net_of(patches[2]));
  SurfaceNode& node = nodes_[id];
  node.low = nodes_[quarters[0]].low;
  node.high = nodes_[quarters[0]].high;
  for (const std::uint32_t quarter : quarters) {
    node.low = std::min(node.low, nodes_[quarter].low);
    node.high = std::max(node.high, nodes_[quarter].high);
  }
}

void SurfaceTree::stand_in(std::uint32_t id) {
  BezierNet& net = nets_[id];
  const Vec3 vertex(net.x[0], net.y[0], net.z[0]);
  net = corner_net(vertex, side_curve(nets_[id + 1], 3), side_curve(nets_[id + 2], 0));
}

const std::array<std::uint32_t, 8>& SurfaceTree::quarters(std::uint32_t id) {
  SurfaceNode& node = nodes_[id];
  if (node.quarters != kNone) return quarters_[node.quarters];
  node.quarters = static_cast<std::uint32_t>(quarters_.size());
  std::array<std::uint32_t, 8>& vertices = quarters_.emplace_back();
  const std::uint32_t quarter = node.box.size / 4;
  for (int side = 0; side < 4; ++side) {
    const bool forward = side < 2;  // Sides 2 and 3 run against s and t.
    for (int k = 0; k < 2; ++k) {
      auto [s, t] = node.box.corner(forward ? side : (side + 1) % 4);
      (side % 2 == 0 ? s : t) += ((k == 0) == forward ? 1 : 3) * quarter;
      vertices[2 * side + k] = vertices_.insert(node.box.face, s, t).first;
    }
  }
  return vertices;
}

}  // namespace ccslice
