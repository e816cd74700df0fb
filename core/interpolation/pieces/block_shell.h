// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The SHELL of a block's face: where the flat triangles that stand for the face (interpolation/pieces/block_raster.h)
// lie outside of it. Who finds the block's voxels by the triangles takes the shell's voxels for the block's own.
//
// A face that is flat, or bulges out of the block, has no shell.

#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/interpolation/pieces/block_faces.h"
#include "core/interpolation/pieces/block_shape.h"
#include "core/interpolation/samples/block_nodes.h"

namespace ccslice {

/// Memory is kept from face to face.
class BlockShell {
 public:
  /// A place on a triangle's edge where that is farthest from the face, about. Its inside may be a third deeper: of a
  /// parabola, by the square of what the triangle's circumradius is to half of its longest edge.
  struct Place {
    Vec3 voxel;
    Eigen::RowVector3d outwards;  // across_quads(), away from the block.
    double depth;                 // How far it is outside, as such a share of the block's thickness. > 0.
    unsigned sides;               // Of the block, that the edge lies on: bit 2 * axis + (at its end).
  };
  /// A quadrilateral of triangles of which some part is outside. They share the edge from the first corner to the last.
  struct Quad {
    std::array<std::size_t, 4> corners;  // Nodes: a lower pair and an upper one.
    Eigen::RowVector3d outwards;         // As its places have it.
    double depth = 0;                    // Of its deepest place.
  };

  /// `side`: 2 * axis + (at its end). REQUIRES: shape is shape_of(points), and not flat.
  void find(const BlockPoints& points, const BlockShape& shape, std::size_t side);

  const std::vector<Place>& places() const { return places_; }
  const std::vector<Quad>& quads() const { return quads_; }
  /// How far the deepest place lies beyond the block; 0 if there is no shell.
  double depth() const { return depth_; }

 private:
  struct Edges;
  template <std::size_t Step>
  void find_in_quarters(const BlockPoints& points, const BlockShape& shape, std::size_t side);
  void find_in_whole(const BlockPoints& points, const BlockShape& shape, std::size_t side);
  void add(const BlockPoints& points, const BlockFace& face, const Edges& edges);

  double depth_ = 0;
  std::vector<Place> places_;
  std::vector<Quad> quads_;
};

}  // namespace ccslice
