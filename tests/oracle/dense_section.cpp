// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/dense_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace ccslice::oracle {
namespace {

/// Sets of crossings that hang together.
class Groups {
 public:
  std::size_t add() {
    parent_.push_back(parent_.size());
    return parent_.size() - 1;
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t i, std::size_t j) { parent_[find(i)] = find(j); }

 private:
  std::vector<std::size_t> parent_;
};

Vec3 unit_normal(const BfrSurface::Derivatives& d) {
  const Vec3 n = d.s.cross(d.t);
  return n.norm() > 0 ? Vec3(n.normalized()) : Vec3(Vec3::Zero());
}

}  // namespace

double DenseLoop::width() const {
  Eigen::AlignedBox2d box;
  for (const Point& p : points) box.extend(p.xy);
  return box.sizes().minCoeff();
}

DenseSurface::DenseSurface(const BfrSurface& surface, int samples_a_side) : surface_(surface), n_(samples_a_side) {
  for (std::uint32_t f = 0; f < surface.faces().size(); ++f) {
    for (int j = 0; j <= n_; ++j) {
      for (int i = 0; i <= n_; ++i) {
        const auto d = surface.derivatives(f, double(i) / n_, double(j) / n_);
        points_.push_back(d.p);
        normals_.push_back(unit_normal(d));
      }
    }
  }
}

std::size_t DenseSurface::index(std::uint32_t face, int i, int j) const {
  return (std::size_t{face} * (n_ + 1) + j) * (n_ + 1) + i;
}

std::vector<DenseLoop> DenseSurface::section(const SlicePlane& plane) const {
  const Vec3 normal = plane.x_axis.cross(plane.y_axis);
  const auto height = [&](const Vec3& p) { return (p - plane.origin).dot(normal); };
  Groups groups;
  std::vector<DenseLoop::Point> points;
  std::map<std::array<long, 2>, std::size_t> by_place;  // Faces meet at equal places.
  const auto crossing = [&](std::uint32_t face, std::array<double, 2> low, std::array<double, 2> high) {
    for (int step = 0; step < 50; ++step) {  // `low` stays below or in the plane.
      const std::array<double, 2> middle = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
      (height(surface_.position(face, middle[0], middle[1])) <= 0 ? low : high) = middle;
    }
    const auto d = surface_.derivatives(face, low[0], low[1]);
    const Vec2 xy((d.p - plane.origin).dot(plane.x_axis), (d.p - plane.origin).dot(plane.y_axis));
    const auto [it, added] =
        by_place.try_emplace({std::lround(xy.x() * 1e5), std::lround(xy.y() * 1e5)}, points.size());
    if (added) {
      groups.add();
      points.push_back({xy, unit_normal(d).cross(normal).norm()});
    }
    return it->second;
  };
  for (std::uint32_t f = 0; f < surface_.faces().size(); ++f) {
    for (int j = 0; j < n_; ++j) {
      for (int i = 0; i < n_; ++i) {
        const std::array<std::array<int, 2>, 4> ring = {{{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}};
        std::vector<std::size_t> met;
        for (int e = 0; e < 4; ++e) {
          std::array<int, 2> a = ring[e], b = ring[(e + 1) % 4];
          const bool above_a = height(points_[index(f, a[0], a[1])]) > 0,
                     above_b = height(points_[index(f, b[0], b[1])]) > 0;
          if (above_a == above_b) continue;
          if (above_a) std::swap(a, b);
          met.push_back(crossing(f, {double(a[0]) / n_, double(a[1]) / n_}, {double(b[0]) / n_, double(b[1]) / n_}));
        }
        for (std::size_t k = 1; k < met.size(); ++k) groups.join(met[0], met[k]);
      }
    }
  }
  std::map<std::size_t, DenseLoop> loops;
  for (std::size_t i = 0; i < points.size(); ++i) loops[groups.find(i)].points.push_back(points[i]);
  std::vector<DenseLoop> result;
  for (auto& [root, loop] : loops) result.push_back(std::move(loop));
  return result;
}

std::vector<double> DenseSurface::critical_heights(const Vec3& normal, std::size_t most) const {
  std::vector<std::size_t> order(points_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto slope = [&](std::size_t i) { return normals_[i].cross(normal).norm() + (normals_[i].isZero() ? 1 : 0); };
  std::ranges::sort(order, {}, slope);
  std::vector<double> heights;
  for (const std::size_t i : order) {
    if (heights.size() >= most || slope(i) > 0.1) break;
    const double h = points_[i].dot(normal);
    if (std::ranges::all_of(heights, [&](double other) { return std::abs(other - h) > 0.05; })) heights.push_back(h);
  }
  return heights;
}

}  // namespace ccslice::oracle
