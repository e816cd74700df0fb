// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/solid_angle.h"

#include <cmath>
#include <numbers>

namespace ccslice::oracle {

double solid_angle(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 to_a = a - point, to_b = b - point, to_c = c - point;
  const double la = to_a.norm(), lb = to_b.norm(), lc = to_c.norm();
  const double volume = to_a.dot(to_b.cross(to_c));
  const double along = la * lb * lc + to_a.dot(to_b) * lc + to_b.dot(to_c) * la + to_c.dot(to_a) * lb;
  return 2 * std::atan2(volume, along);
}

SurfaceWinding::SurfaceWinding(const BfrSurface& surface, int samples)
    : count_(samples), faces_(surface.faces().size()) {
  for (std::uint32_t face = 0; face < faces_; ++face) {
    for (int i = 0; i <= count_; ++i) {
      for (int j = 0; j <= count_; ++j) {
        samples_.push_back(surface.position(face, static_cast<double>(i) / count_, static_cast<double>(j) / count_));
      }
    }
  }
  for (std::uint32_t face = 0; face < faces_; ++face) add_boxes({face, 0, 0, count_});
}

Box3 SurfaceWinding::add_boxes(const Square& square) {
  const std::size_t own = boxes_.size();
  boxes_.emplace_back();
  boxes_within_.emplace_back();
  Box3 box;
  if (square.size == 1) {
    for (int k = 0; k < 4; ++k) box.extend(sample(square.face, square.i + k % 2, square.j + k / 2));
  } else {
    const int half = square.size / 2;
    for (int k = 0; k < 4; ++k) {
      box.extend(add_boxes({square.face, square.i + k % 2 * half, square.j + k / 2 * half, half}));
    }
  }
  boxes_[own] = box;
  boxes_within_[own] = boxes_.size() - own - 1;
  return box;
}

double SurfaceWinding::angle_of(const Square& square, const Vec3& point, std::size_t& box) const {
  const std::size_t own = box++;
  const auto& [face, i, j, size] = square;
  if (size == 1 || boxes_[own].exteriorDistance(point) > 2 * boxes_[own].diagonal().norm()) {
    box += boxes_within_[own];
    const Vec3 &a = sample(face, i, j), &b = sample(face, i + size, j), &c = sample(face, i + size, j + size),
               &d = sample(face, i, j + size);
    return solid_angle(point, a, b, c) + solid_angle(point, a, c, d);
  }
  double angle = 0;
  const int half = size / 2;
  for (int k = 0; k < 4; ++k) angle += angle_of({face, i + k % 2 * half, j + k / 2 * half, half}, point, box);
  return angle;
}

double SurfaceWinding::number_at(const Vec3& point) const {
  double angle = 0;
  std::size_t box = 0;
  for (std::uint32_t face = 0; face < faces_; ++face) angle += angle_of({face, 0, 0, count_}, point, box);
  return angle / (4 * std::numbers::pi);
}

}  // namespace ccslice::oracle
