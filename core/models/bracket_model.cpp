// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The plate that topology optimization makes of a beam held at both ends and loaded in its middle: a truss of struts,
// one cell thick. A joint of n struts is a fan of n cells round a control point, an extraordinary edge unless n = 4;
// held and loaded joints are rings round a hole. At each end a mounting pad rises from an inset.
//
//   joints  2 * (4 fans of 3, 3 of 4, 2 of 5 cells), 2 rings of 7 and one of 9    91 cells
//   struts  listed below with their cells                                            60
//   pads    2 * (6 of an inset and the pad itself, in the place of one of a ring)    12

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "core/models/model_builder.h"
#include "core/models/models.h"

namespace ccslice {
namespace {

using Vertex = ModelBuilder::Vertex;

struct Joint {
  double x, y;
  double hole_radius;  // 0: a fan.
};
struct Strut {
  int a, b;
  double width;
  int cells;
};

// The right half; joint 0 is on the line of symmetry, and joint -i is the mirror image of joint i.
constexpr std::array<Joint, 11> kJoints = {{{0, 33, 3.0},
                                            {65, 10, 3.6},
                                            {53, 22, 0},
                                            {41, 31, 0},
                                            {23, 36, 0},
                                            {50, 5, 0},
                                            {34, 4, 0},
                                            {12, 4, 0},
                                            {39, 17, 0},
                                            {24, 19, 0},
                                            {9, 19, 0}}};
constexpr std::array<Strut, 20> kStruts = {{{1, 2, 4.2, 3},  {1, 5, 4.2, 3},  {2, 3, 4.2, 2},  {2, 8, 2.8, 1},
                                            {3, 4, 4.2, 2},  {3, 9, 2.9, 2},  {4, 0, 4.4, 2},  {4, 9, 2.8, 1},
                                            {4, 10, 2.9, 2}, {5, 6, 4.2, 2},  {5, 8, 2.8, 1},  {6, 7, 4.2, 2},
                                            {6, 8, 2.8, 1},  {7, 9, 2.9, 1},  {7, 10, 2.8, 1}, {8, 9, 2.9, 1},
                                            {9, 10, 2.9, 1}, {10, 0, 2.9, 1}, {7, -7, 4.4, 1}, {10, -10, 2.9, 1}}};
constexpr double kThickness = 4.3;

class Bracket {
 public:
  Bracket() : builder_("stiffness") {
    for (const Strut& strut : kStruts) {
      add_strut_ends(strut);
      if (strut.a != -strut.b) add_strut_ends({-strut.a, -strut.b, strut.width, strut.cells});
    }
  }

  ControlMesh build() && {
    for (auto& [joint, ends] : ends_) add_joint(joint, ends);
    for (const Strut& strut : kStruts) {
      add_strut(strut);
      if (strut.a != -strut.b) add_strut({-strut.a, -strut.b, strut.width, strut.cells});
    }
    const Box3 limit(Vec3(-70.55925, 1.98686, 0), Vec3(70.55925, 38.13667, 5.88198));
    return std::move(builder_).finish(limit, Vec3(3397 * 0.0423, 478 * 0.0846, 142 * 0.03));
  }

 private:
  /// A control point below and the one above it.
  struct Post {
    Vertex low, high;
  };
  /// Where a strut begins: the posts on its right and left, looking away from the joint.
  struct End {
    int to;
    double angle;
    Post right, left;
  };

  static Vec2 position_of(int joint) {
    const Joint& j = kJoints[static_cast<std::size_t>(std::abs(joint))];
    return {joint < 0 ? -j.x : j.x, j.y};
  }
  static double hole_of(int joint) { return kJoints[static_cast<std::size_t>(std::abs(joint))].hole_radius; }

  /// Stiff in the middle of the part, soft outwards.
  static double value_at(const Vec2& p) {
    const double distance = std::hypot(p.x() / 68, (p.y() - 20) / 48);
    return std::clamp(1 - distance * distance, 0.0, 1.0);
  }

  Post add_post(const Vec2& p) {
    const double value = value_at(p);
    return {builder_.add_vertex(Vec3(p.x(), p.y(), 0), value),
            builder_.add_vertex(Vec3(p.x(), p.y(), kThickness), value)};
  }
  Vec2 flat(const Post& post) const { return builder_.position(post.low).head<2>(); }

  void add_strut_ends(const Strut& strut) {
    ends_[strut.a].push_back({strut.b, 0, {}, {}});
    ends_[strut.b].push_back({strut.a, 0, {}, {}});
    widths_[{strut.a, strut.b}] = widths_[{strut.b, strut.a}] = strut.width;
  }

  /// All of a joint's rim lies on a circle: then its outline is convex. Its radius leaves room between the struts.
  double rim_radius(int joint, const std::vector<End>& ends) const {
    double widest = 0;
    for (const End& end : ends) widest = std::max(widest, widths_.at({joint, end.to}));
    double radius = std::max(0.75 * widest, hole_of(joint) > 0 ? hole_of(joint) + 3.4 : 0.0);
    while (!has_room(joint, ends, radius)) radius += 0.1;
    return radius;
  }
  double half_angle(int joint, const End& end, double radius) const {
    return std::asin(widths_.at({joint, end.to}) / (2 * radius));
  }
  bool has_room(int joint, const std::vector<End>& ends, double radius) const {
    constexpr double kLeast = 0.15;  // Radians between two struts.
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const std::size_t n = (i + 1) % ends.size();
      const double gap = ends[n].angle - ends[i].angle + (n == 0 ? 2 * std::numbers::pi : 0);
      if (gap < half_angle(joint, ends[i], radius) + half_angle(joint, ends[n], radius) + kLeast) return false;
    }
    return true;
  }

  void place_ends(int joint, std::vector<End>& ends) {
    const Vec2 middle = position_of(joint);
    for (End& end : ends) {
      const Vec2 way = position_of(end.to) - middle;
      end.angle = std::atan2(way.y(), way.x());
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.angle < b.angle; });
    const double radius = rim_radius(joint, ends);
    const auto on_rim = [&](double angle) {
      return add_post(middle + radius * Vec2(std::cos(angle), std::sin(angle)));
    };
    for (End& end : ends) {
      const double half = half_angle(joint, end, radius);
      end.right = on_rim(end.angle - half);
      end.left = on_rim(end.angle + half);
    }
  }

  void add_joint(int joint, std::vector<End>& ends) {
    place_ends(joint, ends);
    std::vector<Post> rim;
    for (const End& end : ends) {
      rim.push_back(end.right);
      rim.push_back(end.left);
    }
    if (hole_of(joint) > 0) return add_ring(joint, fill_gaps(joint, rim));
    // Mirror images of joints are mirror images of fans.
    if (joint < 0) std::rotate(rim.begin(), rim.begin() + 1, rim.end());
    add_fan(rim);
  }

  /// Spokes to every other post; the hub is in their middle, so that every cell is convex.
  void add_fan(const std::vector<Post>& rim) {
    Vec2 middle = Vec2::Zero();
    for (std::size_t i = 0; i < rim.size(); i += 2) middle += 2 * flat(rim[i]) / static_cast<double>(rim.size());
    const Post hub = add_post(middle);
    for (std::size_t i = 0; i < rim.size(); i += 2) add_quad(hub, rim[i], rim[i + 1], rim[(i + 2) % rim.size()]);
  }

  /// More posts where the struts leave a large part of a rim free.
  std::vector<Post> fill_gaps(int joint, const std::vector<Post>& rim) {
    constexpr double kLargest = 1.2;  // Radians.
    std::vector<Post> full;
    const Vec2 middle = position_of(joint);
    for (std::size_t i = 0; i < rim.size(); ++i) {
      full.push_back(rim[i]);
      if (i % 2 == 0) continue;
      const Vec2 from = flat(rim[i]) - middle, to = flat(rim[(i + 1) % rim.size()]) - middle;
      double gap = std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
      if (gap < 0) gap += 2 * std::numbers::pi;
      const int parts = static_cast<int>(std::ceil(gap / kLargest));
      for (int part = 1; part < parts; ++part) {
        full.push_back(add_post(middle + Eigen::Rotation2Dd(gap * part / parts) * from));
      }
    }
    return full;
  }

  void add_ring(int joint, const std::vector<Post>& rim) {
    std::vector<Post> hole;
    const Vec2 middle = position_of(joint);
    for (const Post& post : rim) hole.push_back(add_post(middle + hole_of(joint) * (flat(post) - middle).normalized()));
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const std::size_t n = (i + 1) % rim.size();
      if (has_pad(joint, flat(rim[i]), flat(rim[n]))) {
        add_pad(hole[i], rim[i], rim[n], hole[n]);
      } else {
        add_quad(hole[i], rim[i], rim[n], hole[n]);
      }
    }
  }

  /// Pads point away from the part, at its two ends.
  static bool has_pad(int joint, const Vec2& from, const Vec2& to) {
    const Vec2 middle = position_of(joint), way(middle.x() > 0 ? 1 : -1, -0.3);
    const auto turns_left = [](const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x() > 0; };
    return joint != 0 && turns_left(from - middle, way) && turns_left(way, to - middle);
  }

  /// Counter-clockwise seen from above.
  void add_quad(const Post& a, const Post& b, const Post& c, const Post& d) {
    builder_.add_hex({a.low, b.low, c.low, d.low, a.high, b.high, c.high, d.high});
  }

  void add_pad(const Post& a, const Post& b, const Post& c, const Post& d) {
    const std::array<Vertex, 4> top =
        builder_.add_hex_with_inset({a.low, b.low, c.low, d.low, a.high, b.high, c.high, d.high}, 0.62, 0.55, 0);
    ModelBuilder::Hex pad{};
    for (std::size_t i = 0; i < 4; ++i) {
      pad[i] = top[i];
      pad[i + 4] = builder_.add_vertex(builder_.position(top[i]) + Vec3(0, 0, 0.4 * kThickness), 0);
    }
    builder_.add_hex(pad);
  }

  const End& end_of(int joint, int to) const {
    const std::vector<End>& ends = ends_.at(joint);
    return *std::find_if(ends.begin(), ends.end(), [to](const End& end) { return end.to == to; });
  }

  void add_strut(const Strut& strut) {
    const End &from = end_of(strut.a, strut.b), &to = end_of(strut.b, strut.a);
    Post right = from.right, left = from.left;
    for (int i = 1; i <= strut.cells; ++i) {
      const double t = static_cast<double>(i) / strut.cells;
      const bool last = i == strut.cells;
      const Post next_right = last ? to.left : add_post((1 - t) * flat(from.right) + t * flat(to.left));
      const Post next_left = last ? to.right : add_post((1 - t) * flat(from.left) + t * flat(to.right));
      add_quad(right, next_right, next_left, left);
      right = next_right;
      left = next_left;
    }
  }

  ModelBuilder builder_;
  std::map<int, std::vector<End>> ends_;
  std::map<std::array<int, 2>, double> widths_;
};

}  // namespace

ControlMesh make_bracket() { return Bracket().build(); }

}  // namespace ccslice
