// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>

#include "core/limit/cell_index.h"
#include "core/limit/cell_parts.h"
#include "core/limit/fold_search.h"
#include "core/limit/patch.h"
#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr int kMostLevels = 10;  // Towards irregular lines and vertices.
constexpr int kMostNets = 96;    // Of all patches of a cell that may come near.
constexpr int kDeepest = 12;     // Halvings of a patch.
constexpr PartSizes kParts = {.levels = 3, .halvings = 2};
constexpr std::size_t kMostPartsBytes = 8 << 20;
constexpr std::size_t kMapBytes = 128;  // Of a cell, beside its parts.

using Quad = Eigen::Vector4d;

/// A linear map of what is relative to the point sought, and how far from it `distance_mm` may lead.
struct Shear {
  Quad u, v, w;  // Columns.
  Quad reach;    // By axis.

  Shear(const Mat3& map, double distance_mm) noexcept {
    u << map.col(0), 0;
    v << map.col(1), 0;
    w << map.col(2), 0;
    reach << distance_mm * map.rowwise().norm(), 1;
  }
  Quad operator()(const Quad& p) const noexcept { return u * p[0] + v * p[1] + w * p[2]; }
};

/// Bounds of images.
struct ImageBox {
  Quad low = Quad::Constant(std::numeric_limits<double>::infinity()), high = -low;

  void extend(const Quad& image) noexcept {
    low = low.cwiseMin(image);
    high = high.cwiseMax(image);
  }
  bool is_away(const Quad& reach) const noexcept {
    return (low.array() > reach.array()).any() || (high.array() < -reach.array()).any();
  }
};

/// Gives the polar forms of a cubic B-spline segment's four basis functions f: f(a, b, c) is symmetric, affine in each,
/// and f(t, t, t) = f(t). At (from, from, to) and the like they are what its control points weigh in the Bezier points
/// of its piece from `from` to `to`.
Quad polar_basis(double a, double b, double c) noexcept {
  const double sum = a + b + c, pairs = a * b + b * c + c * a, all = a * b * c;
  return Quad(1 - sum + pairs - all, 4 - 2 * pairs + 3 * all, 1 + sum + pairs - 3 * all, all) / 6;
}

/// By Bezier point of a piece.
using PieceWeights = std::array<Quad, 4>;

/// Lines may be bent, so that the hull of a whole one comes near where none of its pieces does.
const std::array<PieceWeights, 8>& weights_along() noexcept {
  static const auto weights = [] {
    std::array<PieceWeights, 8> result;
    for (std::size_t piece = 0; piece < result.size(); ++piece) {
      const double from = static_cast<double>(piece) / result.size(),
                   to = static_cast<double>(piece + 1) / result.size();
      result[piece] = {polar_basis(from, from, from), polar_basis(from, from, to), polar_basis(from, to, to),
                       polar_basis(to, to, to)};
    }
    return result;
  }();
  return weights;
}

/// Points are relative to the one that is sought.
class NetSearch {
 public:
  NetSearch(const Mat3& of_cell, double distance_mm) : of_cell_(of_cell), distance_mm_(distance_mm) {}

  /// Some part of the net may come near; true as well when it was looked at for long enough.
  bool may_come_near(const BezierVolume& net, int depth) noexcept {
    const Mat3 edges = edges_of(net), inverse = edges.inverse();
    const Shear shear(inverse.allFinite() ? inverse : of_cell_, distance_mm_);
    ImageBox box;
    for (const Quad& point : net) box.extend(shear(point));
    if (box.is_away(shear.reach)) return false;
    if (depth == kDeepest || --nets_left_ <= 0) return true;
    Eigen::Index longest = 0;
    edges.colwise().squaredNorm().maxCoeff(&longest);
    BezierVolume low, high;
    halve_net(net, static_cast<std::size_t>(longest), low, high);
    return may_come_near(low, depth + 1) || may_come_near(high, depth + 1);
  }

 private:
  const Mat3& of_cell_;
  const double distance_mm_;
  int nets_left_ = kMostNets;
};

/// Whether a piece of a line's nest may come near. `layers` are its four layers along the line, point by point.
bool may_come_near_along(std::span<const Quad> layers, const Quad& reach) noexcept {
  const std::size_t count = layers.size() / 4;
  return std::ranges::any_of(weights_along(), [&](const PieceWeights& piece) {
    ImageBox box;
    for (std::size_t i = 0; i < count; ++i) {
      const Quad &a = layers[i], &b = layers[count + i], &c = layers[2 * count + i], &d = layers[3 * count + i];
      for (const Quad& weight : piece) box.extend(weight[0] * a + weight[1] * b + weight[2] * c + weight[3] * d);
    }
    return !box.is_away(reach);
  });
}

}  // namespace

CellDistance::CellDistance(const LimitSolid& solid)
    : solid_(solid), builder_(solid.data(), kPositionDimension), images_(solid.data().operators.max_ring_points()) {}

/// By the boxes around the cell's parts, as far as there is memory for them.
bool CellDistance::is_off_parts(LimitCellId cell, const Vec3& point, double distance_mm) noexcept {
  try {
    auto known = parts_.find(cell);
    if (known == parts_.end()) {
      if (parts_bytes_ >= kMostPartsBytes) return false;
      parts_.emplace(cell, CellHulls());
      parts_bytes_ += kMapBytes;
      return false;
    }
    const CellMap map = solid_.index().cell_maps[cell];
    CellHulls& parts = known->second;
    if (parts.size() == 0) {
      if (parts_bytes_ >= kMostPartsBytes) return false;
      const LimitCell& limit_cell = solid_.data().cells[cell];
      parts = CellHulls(1, part_count(limit_cell, kParts, builder_));
      parts.start_cell();
      append_parts(map, limit_cell, kParts, builder_, parts);
      parts.finish();
      parts_bytes_ += parts.memory_bytes();
    }
    const Vec3 margin = distance_mm * map.inverse_jacobian.cwiseAbs().rowwise().sum();
    return !parts.may_hold(LimitCellId{0}, map(point), margin);
  } catch (const std::bad_alloc&) {
    return false;
  }
}

bool CellDistance::exceeds(LimitCellId cell, const Vec3& point, double distance_mm) noexcept {
  if (is_off_parts(cell, point, distance_mm)) return true;
  const Mat3 of_cell = solid_.index().cell_maps[cell].inverse_jacobian;
  const Shear shear(of_cell, distance_mm);
  const Quad origin(point.x(), point.y(), point.z(), 0);
  const auto may_hold = [&](std::span<const double> points, int layers) {
    const std::size_t count = points.size() / kPositionDimension;
    ImageBox box;
    for (std::size_t i = 0; i < count; ++i) {
      const Quad image = shear(Quad::Map(&points[kPositionDimension * i]) - origin);
      box.extend(image);
      if (layers > 1) images_[i] = image;
    }
    if (box.is_away(shear.reach)) return false;
    return layers == 1 || may_come_near_along(std::span(images_).first(count), shear.reach);
  };
  NetSearch search(of_cell, distance_mm);
  return !builder_.any_patch(solid_.data().cells[cell], kMostLevels, may_hold, [&](double* grid) {
    if (!may_hold(std::span(grid, kPatchPoints), 1)) return false;
    bspline_to_bezier(grid, 3, kPositionDimension);
    BezierVolume net;
    for (std::size_t p = 0; p < net.size(); ++p) net[p] = Quad::Map(grid + kPositionDimension * p) - origin;
    return search.may_come_near(net, 0);
  });
}

}  // namespace ccslice
