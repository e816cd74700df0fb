// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A standing coyote of 35 hexahedra, 11 wedges and 2 tetrahedra: 2,832 cells after two refinements, as in
// [Luu19, Table 2]. It lies on its side, as it is printed: x is up, y from its tail to its nose, z from its left to its
// right.
//
//   trunk      5 x 3 hexahedra; the outer ones are hips, flanks and shoulders
//   legs       3 hexahedra each; a wedge in front of each foot, and one as the bend of each hock
//   neck       3 hexahedra; head and muzzle one each, and a wedge for the nose
//   ears       a wedge on each side of the head, its cheek, with a tetrahedron on top
//   tail       a wedge for the bend at its root, 3 hexahedra, and a wedge for the tip

#include <algorithm>

#include "core/models/model_builder.h"
#include "core/models/models.h"

namespace ccslice {
namespace {

using Vertex = ModelBuilder::Vertex;

/// A place in the side view: from tail to nose, and above the ground.
struct Spot {
  double along, up;
};
/// A section through trunk, neck, head or tail: spots of its lower and its upper edge, and their half-widths.
struct Section {
  Spot low, high;
  double half_low, half_high;
};
/// A section through the trunk and its sides.
struct TrunkSection {
  Section middle;
  Spot side_low, side_high;
  double half_side_low, half_side_high;
};

// From rump to chest.
constexpr std::array<TrunkSection, 6> kTrunk = {{{{{-21, 31}, {-22, 43}, 4.5, 4.5}, {-21.5, 24}, {-20, 39}, 11.5, 10.5},
                                                 {{{-11, 30}, {-12, 46}, 5, 5}, {-9, 25}, {-11, 41}, 11.5, 12},
                                                 {{{-1, 27}, {-2, 47}, 5, 5}, {-1, 29}, {-2, 43}, 12, 12},
                                                 {{{8, 23}, {7, 48}, 5, 5}, {8, 27}, {7, 44}, 12.5, 12.5},
                                                 {{{15, 21}, {15, 50}, 5, 5}, {13.5, 24}, {14, 45}, 12.5, 12.5},
                                                 {{{26, 25}, {23, 51}, 5, 5.5}, {24.5, 24}, {22, 44}, 11.5, 11}}};
// From the chest's front to the skull's back, then the brow and the muzzle.
constexpr std::array<Section, 5> kNeck = {{{{33, 34}, {23, 55}, 7.5, 6.5},
                                           {{36, 41}, {25, 60}, 7.5, 6.5},
                                           {{38, 47}, {28, 64}, 6.5, 6},
                                           {{46, 47}, {41, 64}, 5, 5},
                                           {{55, 47.5}, {53, 55}, 3.5, 3.3}}};
constexpr Section kNose = {{61.5, 50}, {61.5, 50}, 2.4, 2.4};
constexpr Section kCheek = {{39, 50}, {34, 63}, 10.5, 10};
constexpr Spot kEarTip = {29, 87};
constexpr double kHalfEarTip = 9;
// From the root of the tail to its end. The first section shares its lower edge with the rump.
constexpr std::array<Section, 4> kTail = {{{{-21, 31}, {-28, 41}, 4.5, 4.5},
                                           {{-27, 24}, {-36, 32}, 5.5, 5.5},
                                           {{-32, 14}, {-43, 21}, 6.5, 6.5},
                                           {{-38, 7}, {-46, 12}, 5, 5}}};
constexpr Section kTailTip = {{-46, 3}, {-46, 3}, 3, 3};

/// A section through a leg: its back and its front in the side view, and inner and outer half-width.
struct LegSection {
  Spot back, front;
  double half_inner, half_outer;
};
constexpr LegSection kThigh = {{-26.5, 16.5}, {-15.5, 13}, 4, 12};
constexpr LegSection kHock = {{-27.5, 11.5}, {-15.5, 13}, 4, 12};
constexpr std::array<LegSection, 2> kHindFoot = {{{{-24, 4}, {-15.5, 4.5}, 4, 11.5}, {{-25, 0}, {-15, 0}, 3.5, 12}}};
constexpr Spot kHindToe = {-9.5, 0};
constexpr std::array<LegSection, 3> kForeLeg = {
    {{{13, 16}, {23, 16}, 4, 12}, {{14, 4}, {22.5, 4.5}, 4, 11.5}, {{13, 0}, {23, 0}, 3.5, 12}}};
constexpr Spot kForeToe = {28, 0};

class Coyote {
 public:
  Coyote() : builder_("stiffness") {}

  ControlMesh build() && {
    add_trunk();
    add_neck_and_head();
    add_tail();
    for (const int side : {0, 1}) {
      add_hind_leg(side);
      add_fore_leg(side);
    }
    const Box3 limit(Vec3(0.15639, -45.55746, -12.16309), Vec3(73.39366, 58.73645, 12.16309));
    return std::move(builder_).finish(limit, Vec3(1494 * 0.0423, 991 * 0.0846, 738 * 0.03));
  }

 private:
  /// Lower right, upper right, upper left, lower left, seen from behind.
  using Ring = std::array<Vertex, 4>;

  /// Stiff paws, soft ears and back.
  static double value_at(const Spot& spot) { return std::clamp(1 - spot.up / 62, 0.0, 1.0); }

  Vertex add(const Spot& spot, double left) {
    return builder_.add_vertex(Vec3(spot.up, spot.along, -left), value_at(spot));
  }
  Ring add_ring(const Section& s) {
    return {add(s.low, -s.half_low), add(s.high, -s.half_high), add(s.high, s.half_high), add(s.low, s.half_low)};
  }
  void add_hex(const Ring& from, const Ring& to) {
    builder_.add_hex({from[0], from[1], from[2], from[3], to[0], to[1], to[2], to[3]});
  }
  void add_wedge(const std::array<Vertex, 6>& corners) { builder_.add_cell(CellKind::kWedge, corners); }

  /// The side cells' sections between trunk and outside, in the order of a ring. side 0: right, 1: left.
  Ring side_ring(std::size_t s, int side) const {
    const Ring& m = trunk_[s];
    const std::array<Vertex, 2>& out = sides_[s][static_cast<std::size_t>(side)];
    return side == 0 ? Ring{out[0], out[1], m[1], m[0]} : Ring{m[3], m[2], out[1], out[0]};
  }

  void add_trunk() {
    for (std::size_t s = 0; s < kTrunk.size(); ++s) {
      const TrunkSection& section = kTrunk[s];
      trunk_[s] = add_ring(section.middle);
      for (const int side : {0, 1}) {
        const double sign = side == 0 ? -1 : 1;
        sides_[s][static_cast<std::size_t>(side)] = {add(section.side_low, sign * section.half_side_low),
                                                     add(section.side_high, sign * section.half_side_high)};
      }
    }
    for (std::size_t s = 0; s + 1 < kTrunk.size(); ++s) {
      add_hex(trunk_[s], trunk_[s + 1]);
      for (const int side : {0, 1}) add_hex(side_ring(s, side), side_ring(s + 1, side));
    }
  }

  void add_neck_and_head() {
    Ring last = trunk_.back();
    std::array<Ring, kNeck.size()> rings{};
    for (std::size_t i = 0; i < kNeck.size(); ++i) {
      rings[i] = add_ring(kNeck[i]);
      add_hex(last, rings[i]);
      last = rings[i];
    }
    const Vertex right = add(kNose.low, -kNose.half_low), left = add(kNose.low, kNose.half_low);
    add_wedge({last[3], last[2], left, last[0], last[1], right});
    for (const int side : {0, 1}) add_cheek_and_ear(rings[2], rings[3], side);
  }

  /// `back` and `front`: the skull's sections.
  void add_cheek_and_ear(const Ring& back, const Ring& front, int side) {
    const double sign = side == 0 ? -1 : 1;
    const Vertex low = add(kCheek.low, sign * kCheek.half_low), high = add(kCheek.high, sign * kCheek.half_high);
    const Vertex tip = add(kEarTip, sign * kHalfEarTip);
    if (side == 0) {
      add_wedge({back[0], front[0], low, back[1], front[1], high});
      builder_.add_cell(CellKind::kTet, std::array{back[1], front[1], high, tip});
    } else {
      add_wedge({front[3], back[3], low, front[2], back[2], high});
      builder_.add_cell(CellKind::kTet, std::array{front[2], back[2], high, tip});
    }
  }

  void add_tail() {
    const Ring& rump = trunk_.front();
    const Section& root = kTail[0];
    Ring last = {rump[0], add(root.high, -root.half_high), add(root.high, root.half_high), rump[3]};
    add_wedge({rump[3], last[2], rump[2], rump[0], last[1], rump[1]});
    for (std::size_t i = 1; i < kTail.size(); ++i) {
      const Ring ring = add_ring(kTail[i]);
      add_hex(ring, last);
      last = ring;
    }
    const Vertex right = add(kTailTip.low, -kTailTip.half_low), left = add(kTailTip.low, kTailTip.half_low);
    add_wedge({last[3], left, last[2], last[0], right, last[1]});
  }

  /// Back right, front right, front left, back left, seen from above.
  Ring add_leg_ring(const LegSection& s, int side) {
    const double right = side == 0 ? -s.half_outer : s.half_inner, left = side == 0 ? -s.half_inner : s.half_outer;
    return {add(s.back, right), add(s.front, right), add(s.front, left), add(s.back, left)};
  }

  /// The underside of a hip (`s` = 0) or shoulder.
  Ring underside(std::size_t s, int side) const {
    const Ring back = side_ring(s, side), front = side_ring(s + 1, side);
    return {back[0], front[0], front[3], back[3]};
  }

  /// A cell between two rings of a leg, `low` below `high`.
  void add_leg_cell(const Ring& low, const Ring& high) {
    builder_.add_hex({low[0], low[3], low[2], low[1], high[0], high[3], high[2], high[1]});
  }

  void add_toe(const Ring& ground, const Ring& ankle, const Spot& toe) {
    const double right = -builder_.position(ground[1]).z(), left = -builder_.position(ground[2]).z();
    const double middle = (left + right) / 2, half = 0.4 * (left - right);
    add_wedge({ground[2], ankle[2], add(toe, middle + half), ground[1], ankle[1], add(toe, middle - half)});
  }

  void add_hind_leg(int side) {
    const Ring thigh = add_leg_ring(kThigh, side);
    add_leg_cell(thigh, underside(0, side));
    const double outer = kHock.half_outer, inner = kHock.half_inner;
    const Ring hock = {add(kHock.back, side == 0 ? -outer : inner), thigh[1], thigh[2],
                       add(kHock.back, side == 0 ? -inner : outer)};
    add_wedge({hock[3], thigh[3], thigh[2], hock[0], thigh[0], thigh[1]});
    const Ring ankle = add_leg_ring(kHindFoot[0], side), ground = add_leg_ring(kHindFoot[1], side);
    add_leg_cell(ankle, hock);
    add_leg_cell(ground, ankle);
    add_toe(ground, ankle, kHindToe);
  }

  void add_fore_leg(int side) {
    Ring above = underside(kTrunk.size() - 2, side), ankle{};
    for (const LegSection& section : kForeLeg) {
      ankle = above;
      above = add_leg_ring(section, side);
      add_leg_cell(above, ankle);
    }
    add_toe(above, ankle, kForeToe);
  }

  ModelBuilder builder_;
  std::array<Ring, kTrunk.size()> trunk_{};
  std::array<std::array<std::array<Vertex, 2>, 2>, kTrunk.size()> sides_{};
};

}  // namespace

ControlMesh make_coyote() { return Coyote().build(); }

}  // namespace ccslice
