// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boundary faces and the boxes that halving makes of them, kept from one layer to the next: parallel planes meet
// the same boxes again and again, and whatever doesn't depend on the plane's height is found once.
//
// A regular box is a bicubic net; its four quarters are made by halving it. What remains at the irregular vertex of a
// face (a REMAINDER, at first the whole face) has a hull only; its four quarters are a smaller remainder, quarter
// (0,0), and three regular boxes.
//
// Nodes are made when they are first asked for. A node is a function of the face, its box and the axes, so what a
// layer sees doesn't depend on the layers before it. All are forgotten once they are more than kKeptNodes and more than
// eight times what the last layer visited.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/contour/bezier_net.h"
#include "core/contour/surface_mesh.h"

namespace ccslice {

/// What is known of a node's lines of equal height.
enum class LevelLines : std::uint8_t {
  kUnknown,
  kOpen,      // None is closed: the height rises in some direction of the box.
  kAcrossS,   // The height rises (or falls) strictly along s: each is a graph s(t).
  kAcrossT,   // The height rises (or falls) strictly along t: each is a graph t(s).
  kAcrossST,  // Both.
};

/// A box of a face. Coordinates are along the axes of SurfaceTree::start(): in planes of equal height, and the height.
struct alignas(64) SurfaceNode {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  double low = 0, high = 0;         // Heights of the hull.
  std::uint32_t children = kNone;   // The first of four: quarters (0,0), (1,0), (0,1), (1,1).
  bool remainder = false;           // At an irregular vertex.
  bool examined = false;            // All that follows up to `diagonal` is known.
  std::uint8_t monotone_sides = 0;  // Bit k: along side k the height only rises or only falls.
  LevelLines level_lines = LevelLines::kUnknown;
  std::array<std::uint32_t, 4> corners = {};  // Vertices.
  std::array<std::uint32_t, 4> middles = {};  // Middles of the sides.
  ChordBound chord;
  double diagonal = 0;  // Diagonal of the hull's box in the plane; for a remainder, of its box in space. mm.

  SurfaceBox box;
  std::uint32_t quarters = kNone;  // Where SurfaceTree keeps the vertices at 1/4 and 3/4 of the sides.
  std::uint32_t ring = kNone;      // For a remainder: where SurfaceTree keeps its control points.
};

class SurfaceTree {
 public:
  static constexpr std::uint32_t kNone = SurfaceNode::kNone;
  static constexpr std::size_t kKeptNodes = 1 << 14;

  explicit SurfaceTree(const BoundarySurface& surface) : surface_(surface), vertices_(surface) {}

  /// Before a layer. True if all nodes and vertices of before are forgotten: for other axes, or to bound the memory.
  [[nodiscard]] bool start(const AffineMap& to_axes, std::size_t nodes_of_last_layer);

  const SurfaceVertices& vertices() const { return vertices_; }
  std::size_t node_count() const { return nodes_.size(); }
  const SurfaceNode& node(std::uint32_t id) const { return nodes_[id]; }
  /// A remainder has children once stand_in() has asked for them.
  const BezierNet& net(std::uint32_t id) const { return nets_[id]; }

  std::uint32_t root(BoundaryFaceId face) { return face_of(face).root; }
  /// Vertices that coarser neighbours put on the sides of a face.
  std::span<const std::uint32_t> coarser_middles(BoundaryFaceId face);

  const SurfaceNode& examine(std::uint32_t id);
  /// Splits a remainder, and narrows its heights to those of its quarters.
  std::uint32_t children(std::uint32_t id);
  /// Gives a remainder a net: bilinear, but for the sides 1 and 2 that it shares with its siblings, so that contours
  /// pass from them without a gap. It is for remainders smaller than the tolerance, where any net in the hull does.
  /// REQUIRES: it is no root.
  void stand_in(std::uint32_t id);
  /// The vertices at 1/4 and 3/4 of sides 0, 1, 2, 3.
  const std::array<std::uint32_t, 8>& quarters(std::uint32_t id);

 private:
  struct Face {
    std::uint32_t root = kNone;
    std::uint32_t first_middle = 0, middle_count = 0;
  };

  const Face& face_of(BoundaryFaceId face);
  std::uint32_t add_node(const SurfaceBox& box, const BezierNet& net);
  std::uint32_t add_remainder(const SurfaceBox& box, std::uint32_t ring);
  void add_quarters_of_net(std::uint32_t id);
  void add_quarters_of_remainder(std::uint32_t id);

  const BoundarySurface& surface_;
  AffineMap to_axes_;
  std::vector<SurfaceNode> nodes_;
  std::vector<BezierNet> nets_;  // By node.
  SurfaceVertices vertices_;
  std::vector<std::uint32_t> face_slots_;  // By face: its index in faces_.
  std::vector<Face> faces_;
  std::vector<std::uint32_t> middles_;  // coarser_middles() of all faces.
  std::vector<IrregularCorner> rings_;  // One a face: of the smallest remainder; mapped to the axes.
  std::size_t ring_count_ = 0;          // Of them in use: their memory is kept.
  std::vector<std::array<std::uint32_t, 8>> quarters_;
};

}  // namespace ccslice
