// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/surface_pieces.h"

#include <cmath>
#include <cstddef>

#include "core/limit/halve_patch_net.h"
#include "core/limit/lane_box.h"
#include "core/subdivision/operator_table.h"

namespace ccslice {

namespace {

// The box of an irregular face holds the patches of so many levels. The hull of what is left reaches far.
constexpr int kBoxLevels = 3;

using SurfaceNet = std::array<PaddedPoint, 16>;

Vec3 point_of(const PaddedPoint& p) { return p.head<3>(); }

std::array<Vec3, 4> corners_of(const SurfaceNet& net) {
  return {point_of(net[0]), point_of(net[3]), point_of(net[15]), point_of(net[12])};
}

/// `b`, seen along the axes of `a`: beside it, or beyond it on the outer side or deep on the inner one.
bool is_off(const SlantedBox& a, const SlantedBox& b, double least_mm) {
  if (!a.has_normal) return false;
  const Mat3 turn = a.axes * b.axes.transpose();
  const Vec3 middle = turn * (0.5 * (b.low + b.high)), reach = turn.cwiseAbs() * (0.5 * (b.high - b.low));
  const Vec3 low = middle - reach, high = middle + reach;
  return low[0] > a.high[0] || low[1] > a.high[1] || low[2] >= a.high[2] - least_mm || high[0] < a.low[0] ||
         high[1] < a.low[1] || high[2] < a.low[2] - least_mm;
}

/// Along the directions across an edge of either: the boxes are apart (the theorem of separating axes).
bool are_apart_across_edges(const SlantedBox& a, const SlantedBox& b) {
  constexpr double kParallel = 1e-9;  // Edges that nearly are have no direction across.
  const Mat3 turn = a.axes * b.axes.transpose(), reach = turn.cwiseAbs().array() + kParallel;
  const Vec3 way = turn * (0.5 * (b.low + b.high)) - 0.5 * (a.low + a.high);
  const Vec3 half_a = 0.5 * (a.high - a.low), half_b = 0.5 * (b.high - b.low);
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const double of_a = half_a[i1] * reach(i2, j) + half_a[i2] * reach(i1, j);
      const double of_b = half_b[j1] * reach(i, j2) + half_b[j2] * reach(i, j1);
      if (std::abs(way[i2] * turn(i1, j) - way[i1] * turn(i2, j)) > of_a + of_b) return true;
    }
  }
  return false;
}

}  // namespace

SlantedBox SlantedBox::around(std::span<const PaddedPoint> points, const std::array<Vec3, 4>& corners) {
  const Vec3 along = (corners[1] - corners[0] + corners[2] - corners[3]).normalized();
  const Vec3 across = (corners[3] - corners[0] + corners[2] - corners[1]).normalized();
  const Vec3 normal = along.cross(across);
  constexpr double kFlat = 1e-3;  // The sine of the angle between its sides.
  SlantedBox found;
  found.has_normal = normal.norm() > kFlat;
  if (found.has_normal) {
    found.axes.row(0) = along;
    found.axes.row(2) = normal.normalized();
    found.axes.row(1) = normal.normalized().cross(along);
  }
  const LaneMap map(found.axes);
  LaneBox box, slanted;
  for (const PaddedPoint& p : points) {
    const Lanes point = load_unaligned(p.data());
    box.extend(point);
    slanted.extend(map(point));
  }
  found.box = box.box();
  const Box3 turned = slanted.box();
  found.low = turned.min(), found.high = turned.max();
  return found;
}

bool cannot_cross(const SlantedBox& a, const SlantedBox& b, double least_mm) {
  return !a.box.intersects(b.box) || is_off(a, b, least_mm) || is_off(b, a, least_mm) || are_apart_across_edges(a, b);
}

SlantedBox SurfacePieces::box_of(BoundaryFaceId face) {
  if (surface_.faces()[face].regular) {
    const BezierPatch patch = surface_.regular_patch(face);
    return SlantedBox::around(patch.b, corners_of(patch.b));
  }
  surface_.irregular_corner(face, boxed_corner_);
  points_.clear();
  std::array<Vec3, 4> corners;
  for (int level = 0; level < kBoxLevels; ++level) {
    surface_.split(boxed_corner_, patches_);
    for (const BezierPatch& patch : patches_) points_.insert(points_.end(), patch.b.begin(), patch.b.end());
    if (level == 0) {
      corners = {Vec3::Zero(), point_of(patches_[0].b[3]), point_of(patches_[2].b[15]), point_of(patches_[1].b[12])};
    }
  }
  points_.insert(points_.end(), boxed_corner_.ring.begin(), boxed_corner_.ring.end());
  corners[0] = surface_.corner_position(boxed_corner_);
  return SlantedBox::around(points_, corners);
}

void SurfacePieces::append(const SurfaceNet& net) {
  SurfacePiece& piece = pieces_.emplace_back();
  piece.net = net;
  piece.corners = corners_of(net);
  piece.box = SlantedBox::around(net, piece.corners);
  quarters_.push_back(kNone);
}

void SurfacePieces::append_split() {
  surface_.split(corner_, patches_);
  for (const BezierPatch& patch : patches_) append(patch.b);
  SurfacePiece& rest = pieces_.emplace_back();
  rest.is_rest = true;
  rest.corners = {surface_.corner_position(corner_), point_of(patches_[0].b[0]), point_of(patches_[2].b[0]),
                  point_of(patches_[1].b[0])};
  rest.box = SlantedBox::around(corner_.ring, rest.corners);
  quarters_.push_back(kNone);
}

void SurfacePieces::start(BoundaryFaceId face) {
  constexpr std::size_t kUsual = 8;  // Pieces.
  pieces_.clear(), quarters_.clear();
  pieces_.reserve(kUsual);
  if (surface_.faces()[face].regular) {
    append(surface_.regular_patch(face).b);
  } else {
    surface_.irregular_corner(face, corner_);
    append_split();
  }
  roots_ = size();
}

std::uint32_t SurfacePieces::quarters(std::uint32_t piece) {
  if (quarters_[piece] != kNone) return quarters_[piece];
  quarters_[piece] = size();
  if (pieces_[piece].is_rest) {
    append_split();
  } else {
    SurfaceNet low, high, first, second;
    halve_patch_net(pieces_[piece].net, 4, low, high);
    for (const SurfaceNet* half : {&low, &high}) {
      halve_patch_net(*half, 1, first, second);
      append(first);
      append(second);
    }
  }
  return quarters_[piece];
}

}  // namespace ccslice
