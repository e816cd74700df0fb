// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The QUARTERS of a block's face (interpolation/pieces/block_faces.h): the quadrilaterals between every other node,
// worked on at once, a lane each. The second lane's is at the end of s, the third one's at that of t, the fourth one's
// at both. Most faces have four triangles' quadrilaterals in each quarter. Where these are as large as the face,
// quarters still know its arcs.

#pragma once

#include <immintrin.h>

#include <array>
#include <cstddef>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/interpolation/pieces/block_arcs.h"
#include "core/interpolation/pieces/block_faces.h"
#include "core/interpolation/samples/block_nodes.h"

namespace ccslice {

/// Four points, or what is multiplied with them, a lane each.
struct LanePoints {
  Lanes x, y, z;

  LanePoints of_lane(std::size_t lane) const { return {Lanes{} + x[lane], Lanes{} + y[lane], Lanes{} + z[lane]}; }
  Lanes dot(const LanePoints& b) const { return x * b.x + y * b.y + z * b.z; }
  LanePoints cross(const LanePoints& b) const { return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x}; }
};
inline LanePoints operator+(const LanePoints& a, const LanePoints& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline LanePoints operator-(const LanePoints& a, const LanePoints& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline LanePoints operator*(double factor, const LanePoints& p) { return {factor * p.x, factor * p.y, factor * p.z}; }

class FaceQuarters {
 public:
  static constexpr std::size_t kNodes = 3;  // Along a quarter's side.

  FaceQuarters(const BlockPoints& points, const BlockFace& face) {
    for (std::size_t t = 0; t < kNodes; ++t) {
      for (std::size_t s = 0; s < kNodes; ++s) {
        const Vec3 &a = points[face.node(s, t)], &b = points[face.node(s + 2, t)], &c = points[face.node(s, t + 2)],
                   &d = points[face.node(s + 2, t + 2)];
        nodes_[t][s] = {Lanes{a.x(), b.x(), c.x(), d.x()}, Lanes{a.y(), b.y(), c.y(), d.y()},
                        Lanes{a.z(), b.z(), c.z(), d.z()}};
      }
    }
  }

  /// Quarters at the end of s, or of t: for choosing by lane.
  static auto at_end_of_s() { return Lanes{0, 1, 0, 1} > 0; }
  static auto at_end_of_t() { return Lanes{0, 0, 1, 1} > 0; }

  /// Each quarter's own. s, t < kNodes.
  const LanePoints& node(std::size_t s, std::size_t t) const { return nodes_[t][s]; }

  /// Calls visit(lower, along_s, along_t, upper) with the corners of a quadrilateral of each quarter: it is Size nodes
  /// long, and (s, t) is its lower corner. With size 4 it is the face, in all lanes.
  template <std::size_t Size, typename Visit>
  auto with_corners(std::size_t s, std::size_t t, const Visit& visit) const {
    if constexpr (Size < kBlockNodes - 1) {
      return visit(node(s, t), node(s + Size, t), node(s, t + Size), node(s + Size, t + Size));
    } else {
      return visit(node(0, 0).of_lane(0), node(2, 0).of_lane(1), node(0, 2).of_lane(2), node(2, 2).of_lane(3));
    }
  }

  /// The face's whole arc along s through the t-th node of each quarter, and along t through the s-th one.
  ArcBends<LanePoints> along_s(std::size_t t) const {
    return whole_arc<FirstAlongS>(node(0, t), node(1, t), node(2, t));
  }
  ArcBends<LanePoints> along_t(std::size_t s) const {
    return whole_arc<FirstAlongT>(node(s, 0), node(s, 1), node(s, 2));
  }

 private:
  /// The lanes of a way's beginning, or of its end, for both.
  struct FirstAlongS {
    static Lanes begin(Lanes lanes) { return _mm256_movedup_pd(lanes); }
    static Lanes end(Lanes lanes) { return _mm256_permute_pd(lanes, 0b1111); }
  };
  struct FirstAlongT {
    static Lanes begin(Lanes lanes) { return _mm256_permute2f128_pd(lanes, lanes, 0x00); }
    static Lanes end(Lanes lanes) { return _mm256_permute2f128_pd(lanes, lanes, 0x11); }
  };

  /// Each quarter knows the nodes of its own part of the arc; lanes give the others theirs.
  template <typename Way>
  static ArcBends<LanePoints> whole_arc(const LanePoints& a, const LanePoints& b, const LanePoints& c) {
    const LanePoints outer = {a.x - 2 * b.x + c.x, a.y - 2 * b.y + c.y, a.z - 2 * b.z + c.z};
    const auto second = [](Lanes b, Lanes c) { return Way::begin(b) - 2 * Way::begin(c) + Way::end(b); };
    return {{LanePoints{Way::begin(outer.x), Way::begin(outer.y), Way::begin(outer.z)},
             LanePoints{second(b.x, c.x), second(b.y, c.y), second(b.z, c.z)},
             LanePoints{Way::end(outer.x), Way::end(outer.y), Way::end(outer.z)}}};
  }

  std::array<std::array<LanePoints, kNodes>, kNodes> nodes_;  // By t, by s.
};

/// What arcs are bent by along rows across them.
inline ArcBends<Lanes> across(const LanePoints& row, const ArcBends<LanePoints>& bends) {
  return {{row.dot(bends.at[0]), row.dot(bends.at[1]), row.dot(bends.at[2])}};
}

/// m (interpolation/pieces/block_arcs.h) of the chord between every step-th node in each quarter, or over the whole
/// arc. `at_end`: quarters at the end of the arcs. With step 1 the chord is that of a `half` of the quarter, 0 or 1.
template <std::size_t Step, typename AtEnd>
Lanes middles(const ArcBends<Lanes>& bends, AtEnd at_end, std::size_t half) {
  if constexpr (Step > 2) return bends.middle(0, Step);
  return at_end ? bends.middle(2 + half, Step) : bends.middle(half, Step);
}

}  // namespace ccslice
