// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "tests/support/bfr_surface.h"

namespace ccslice::oracle {
namespace {

constexpr int kStarts = 16;
constexpr int kNewtonSteps = 30;
constexpr int kHalvings = 12;

struct Sample {
  Vec3 p;
  std::uint32_t face;
  double s, t;
};

/// The step of Newton's method on half the squared distance; along a side once the iterate lies on it and would leave.
Eigen::Vector2d newton_step(const BfrSurface::Derivatives& d, const Vec3& r, double s, double t) {
  const Eigen::Vector2d gradient(d.s.dot(r), d.t.dot(r));
  Eigen::Matrix2d hessian;
  hessian << d.s.squaredNorm() + d.ss.dot(r), d.s.dot(d.t) + d.st.dot(r), d.s.dot(d.t) + d.st.dot(r),
      d.t.squaredNorm() + d.tt.dot(r);
  const auto at_end = [](double x, double slope) { return (x <= 0 && slope > 0) || (x >= 1 && slope < 0); };
  const bool fix_s = at_end(s, gradient.x()), fix_t = at_end(t, gradient.y());
  if (fix_s && fix_t) return Eigen::Vector2d::Zero();
  Eigen::Vector2d step;
  if (fix_s) {
    step = {0, -gradient.y() / hessian(1, 1)};
  } else if (fix_t) {
    step = {-gradient.x() / hessian(0, 0), 0};
  } else {
    step = -hessian.partialPivLu().solve(gradient);
  }
  if (!step.allFinite() || step.dot(gradient) > 0) step = -gradient / (d.s.squaredNorm() + d.t.squaredNorm());
  return step;
}

/// Newton with steps clipped to the face, and halved until they come nearer (second derivatives are wild beside an
/// irregular vertex); the distance at the last point.
double descend(const BfrSurface& surface, const Sample& start, const Vec3& point) {
  double s = start.s, t = start.t, least = (start.p - point).norm();
  for (int k = 0; k < kNewtonSteps; ++k) {
    const BfrSurface::Derivatives d = surface.derivatives(start.face, s, t);
    Eigen::Vector2d step = newton_step(d, d.p - point, s, t);
    for (int halvings = 0; halvings < kHalvings; ++halvings, step *= 0.5) {
      const double s_next = std::clamp(s + step.x(), 0.0, 1.0), t_next = std::clamp(t + step.y(), 0.0, 1.0);
      if (std::abs(s_next - s) + std::abs(t_next - t) < 1e-13) return least;
      const double distance = (surface.position(start.face, s_next, t_next) - point).norm();
      if (distance >= least && halvings + 1 < kHalvings) continue;
      if (distance >= least) return least;
      s = s_next;
      t = t_next;
      least = distance;
      break;
    }
  }
  return least;
}

}  // namespace

struct NearestOnSurface::Grid {
  const BfrSurface& surface;
  double size = 1;
  std::map<std::array<int, 3>, std::vector<Sample>> buckets;

  std::array<int, 3> key(const Vec3& p) const {
    return {int(std::floor(p.x() / size)), int(std::floor(p.y() / size)), int(std::floor(p.z() / size))};
  }
};

NearestOnSurface::NearestOnSurface(const BfrSurface& surface, int samples) : grid_(new Grid{surface, 1, {}}) {
  std::vector<Sample> all;
  double longest = 0;
  for (std::uint32_t f = 0; f < surface.faces().size(); ++f) {
    for (int j = 0; j <= samples; ++j) {
      for (int i = 0; i <= samples; ++i) {
        const double s = (i + 0.5) / (samples + 1), t = (j + 0.5) / (samples + 1);  // Irregular vertices are no starts.
        all.push_back({surface.position(f, s, t), f, s, t});
        if (i > 0) longest = std::max(longest, (all.back().p - all[all.size() - 2].p).norm());
      }
    }
  }
  grid_->size = 2 * longest;
  for (const Sample& sample : all) grid_->buckets[grid_->key(sample.p)].push_back(sample);
}

NearestOnSurface::~NearestOnSurface() = default;

double NearestOnSurface::distance(const Vec3& point) const {
  std::vector<std::pair<double, const Sample*>> near;
  const std::array<int, 3> centre = grid_->key(point);
  for (int n = 0; n < 27; ++n) {
    const auto bucket = grid_->buckets.find({centre[0] + n % 3 - 1, centre[1] + n / 3 % 3 - 1, centre[2] + n / 9 - 1});
    if (bucket == grid_->buckets.end()) continue;
    for (const Sample& sample : bucket->second) near.push_back({(sample.p - point).squaredNorm(), &sample});
  }
  const std::size_t starts = std::min<std::size_t>(kStarts, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(starts), near.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < starts; ++i) least = std::min(least, descend(grid_->surface, *near[i].second, point));
  return least;
}

}  // namespace ccslice::oracle
