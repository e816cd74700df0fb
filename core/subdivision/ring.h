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

/// 4 x 4 x 4 control points around a regular cell: points[i + 4 j + 16 k]; kNone in phantom layers. A cell that is as
/// meshed has its corners alone, and phantom layers all round: these make a B-spline the trilinear map of the corners.
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

/// All cells that touch some corners of a cell, framed alike, with the sharp edges and vertices at those corners.
struct NumberedCells {
  std::vector<VertexId> points;
  std::vector<std::array<std::uint32_t, 8>> cells;  // Numbers of points; cells[0] is the cell itself.
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;
  std::vector<std::uint32_t> sharp_vertices;
};

/// The star of an irregular vertex: the cells at it, each framed so that the vertex is its corner (0,0,0). points[0] is
/// the vertex.
struct VertexStar : NumberedCells {
  std::vector<std::uint32_t> key;
};

/// The ring of a vertex cell, framed so that the irregular vertex is (0,0,0): the cells that touch its other seven
/// corners. Some of their points belong to the vertex's star; those are numbered first.
struct VertexRing {
  std::vector<VertexId> points;
  std::vector<std::uint32_t> shared;                // The first points: their numbers in the star.
  std::vector<std::array<std::uint32_t, 8>> cells;  // Numbers of points; cells[0] is the cell itself.
  std::vector<std::uint32_t> key;

  /// The points that the star lacks.
  std::span<const VertexId> own() const { return std::span(points).subspan(shared.size()); }
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
  /// The star of the cell's vertex (0,0,0) of the frame, numbered from this cell on. REQUIRES: hexahedra at it.
  VertexStar star(CellId cell, const Frame& frame);
  /// `star`: the points of that star, in any order.
  VertexRing vertex(CellId cell, const Frame& frame, std::span<const VertexId> star);
  /// A vertex cell's star and ring together.
  NumberedCells neighbourhood(CellId cell, const Frame& frame);
  const CellComplex& complex() const { return complex_; }

 private:
  struct Framed {
    CellId cell;
    Frame frame;
  };
  VertexId vertex_at(const Framed& at, unsigned corner) const {
    return complex_.cell_vertices(at.cell)[at.frame.corner(corner)];
  }
  std::array<VertexId, 8> framed_vertices(const Framed& at) const;
  /// The cell's side where framed axis a is `side`.
  HalfFaceId half_face_of(const Framed& at, unsigned a, unsigned side) const {
    const Frame& f = at.frame;
    const unsigned local_side = side ^ (f.origin >> f.axis[a] & 1u);
    return complex_.cell_half_faces(at.cell)[2u * f.axis[a] + local_side];
  }
  /// The cell across the face where framed axis a is `side`; its cell is kNone on the boundary.
  Framed cross(const Framed& from, unsigned a, unsigned side) const;
  /// The cells that touch the `core` vertices and that a breadth-first walk reaches from the first one, always across
  /// the first `sides` faces of a cell.
  std::vector<Framed> walk(const Framed& start, unsigned sides, std::span<const VertexId> core);
  NumberedCells cells_at(const Framed& start, std::span<const VertexId> core);
  /// Finds the sharp edges and vertices at the `core` vertices. REQUIRES: the ring's points have their numbers.
  void collect_sharp_features(std::span<const VertexId> core, std::vector<std::array<std::uint32_t, 2>>& edges,
                              std::vector<std::uint32_t>& vertices) const;
  void number(VertexId vertex, std::vector<VertexId>& points);
  std::array<std::uint32_t, 8> numbers_of(const Framed& at) const;
  void forget(std::span<const VertexId> points);

  const CellComplex& complex_;
  std::vector<std::uint32_t> local_;        // Number of a vertex in the ring being walked, or kNone.
  std::vector<std::uint32_t> core_, seen_;  // The last walk whose core a vertex was in, and that met a cell.
  std::uint32_t walks_ = 0;
};

}  // namespace ccslice
