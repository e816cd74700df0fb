// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one-rings of limit-ready cells and of their boundary faces, in canonical order.
//
// A walk over faces carries the axes of the first cell along: crossing a face mirrors one corner bit, so shared corners
// keep their bits. Cells (quads) are visited breadth first, faces in the order of their axes, and control points are
// numbered as they are met. Two rings with the same KEY have the same topology, numbered alike, and share one operator.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/frame.h"

namespace ccslice {

/// Bits 2 * axis + (at 1): on this side the ring ends, and a phantom layer P(-1) = 2 P(0) - P(1) takes the layer's
/// place.
using PhantomMask = std::uint8_t;

/// 4 x 4 x 4 control points around a regular cell: points[i + 4 j + 16 k]; kNone in phantom layers.
struct RegularRing {
  std::array<VertexId, 64> points;
  PhantomMask phantoms = 0;
};

/// The ring of a line cell, framed so that the line is u = v = 0: four layers along w of a 2-D ring.
struct LineRing {
  std::vector<VertexId> points;                     // points[layer * count + i]; kNone in phantom layers.
  std::uint32_t count = 0;                          // Points of a layer.
  PhantomMask phantoms = 0;                         // Bits 4 and 5 only: layers 0 and 3.
  std::vector<std::array<std::uint32_t, 4>> quads;  // The quads of a layer, corner bits u + 2v; quads[0] is the cell.
  std::uint8_t sharp_corners = 0;                   // Corners of quads[0] whose edge along the line is sharp.
  std::vector<std::uint32_t> key;
};

/// The ring of a vertex cell, framed so that the irregular vertex is (0,0,0).
struct VertexRing {
  std::vector<VertexId> points;
  std::vector<std::array<std::uint32_t, 8>> cells;        // Numbers of points; cells[0] is the cell itself.
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;  // At the cell's vertices.
  std::vector<std::uint32_t> sharp_vertices;              // Those of the cell's vertices that are sharp.
  std::vector<std::uint32_t> key;
};

/// Index along one axis of a 4 x 4 (x 4) grid: of a corner bit in the cell `step` (-1, 0, 1) cells away from the
/// middle, whose axes are mirrored by crossing.
constexpr unsigned grid_index(int step, unsigned bit) { return step == 0 ? 1 + bit : step > 0 ? 3 - bit : 1 - bit; }

/// Sorts a ring's sharp edges and appends them and its sharp vertices to its key.
void append_sharp_features(std::vector<std::array<std::uint32_t, 2>>& edges, const std::vector<std::uint32_t>& vertices,
                           std::vector<std::uint32_t>& key);

/// Walks the rings of one complex. Keeps scratch memory; REQUIRES: the complex outlives it, and the vertices of the
/// cells asked for are complete.
class RingWalker {
 public:
  explicit RingWalker(const CellComplex& complex);

  /// REQUIRES: the cell is regular.
  RegularRing regular(CellId cell, const Frame& frame = {}) const;
  /// REQUIRES: a line cell with its line at u = v = 0 of the frame.
  LineRing line(CellId cell, const Frame& frame);
  VertexRing vertex(CellId cell, const Frame& frame);

 private:
  struct Framed {
    CellId cell;
    Frame frame;
  };
  VertexId vertex_at(const Framed& at, unsigned corner) const {
    return complex_.cell_vertices(at.cell)[at.frame.corner(corner)];
  }
  /// The cell across the face where framed axis a is `side`; its cell is kNone on the boundary.
  Framed cross(const Framed& from, unsigned a, unsigned side) const;
  /// Queues the cells across the first `sides` faces that touch the `core` vertices and aren't queued yet.
  void queue_neighbours(const Framed& at, unsigned sides, std::span<const VertexId> core,
                        std::vector<Framed>& queue) const;
  void collect_sharp_features(VertexRing& ring) const;
  void number(VertexId vertex, std::vector<VertexId>& points);
  void forget(const std::vector<VertexId>& points);

  const CellComplex& complex_;
  std::vector<std::uint32_t> local_;  // Number of a vertex in the ring being walked, or kNone.
};

}  // namespace ccslice
