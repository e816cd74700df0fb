// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The catalogue of tiny control meshes, each named for the feature it exercises. Unless a name says otherwise their
// geometry is jittered (seeded; too little to invert a cell) and carries two channels of random values, so that a wrong
// weight shows. Edges are about 10 mm long.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

struct TinyMesh {
  std::string name;
  ControlMesh mesh;
};

/// Every valid tiny mesh.
const std::vector<TinyMesh>& tiny_meshes();
/// REQUIRES: a name of the catalogue.
const ControlMesh& tiny_mesh(const std::string& name);

/// A mesh that validation must refuse, and what it must say: this code, and ids out of `ids` only (one at least, unless
/// `ids` is empty).
struct InvalidMesh {
  std::string name;
  ControlMesh mesh;
  ErrorCode code;
  std::vector<std::int64_t> ids;
};
const std::vector<InvalidMesh>& invalid_meshes();

// Builders, for tests that want their own geometry. Unit: mm. No jitter, no channels.

using KeepCell = std::function<bool(int, int, int)>;
/// nx * ny * nz cubes of `size_mm`, without those that keep() refuses.
ControlMesh box_mesh(int nx, int ny, int nz, double size_mm = 10, const KeepCell& keep = {});
/// A box of cubes of 10 mm, each as six tetrahedra round its diagonal.
ControlMesh kuhn_box(int cells);
/// 4 x 4 x 4 cubes, the middle vertex moved out of the box: inverted cells, and a limit that folds.
ControlMesh folding_box_mesh();
/// `sectors` quadrilaterals round a point, each split into m * m, extruded into `layers` layers of hexes. Closed (an
/// interior edge of that valence) or open (a boundary edge with that many hexes, `degrees` wide in all).
ControlMesh fan_mesh(int sectors, int m, int layers, double degrees = 360);
/// Two or three cells round the z axis, `degrees` in all, with a sharp edge along it: reentrant ones fold. Jittered.
ControlMesh sharp_fan(int cells, double degrees, std::uint32_t seed);
/// Below a slit a lobe that gets 21 times as thick in its first cell, along which control points come ever closer;
/// above it another one, in the last column of one piece with it. A channel is 1 in that one, and 0 elsewhere.
ControlMesh tapered_slit(double width_mm);
/// Two lobes of so many cells squared, bent round the y axis: in a quarter they are one piece, elsewhere apart by a
/// slit. Across it there lie cells that share an edge or, beside the middle, a vertex, and no more. A channel is 1 in
/// the outer lobe, and 0 in the inner one and where they meet. With a slit in a quarter only, its end turns a corner
/// inside of the part, where cells share three vertices.
ControlMesh vertex_slit(double width_mm, int cells = 4, bool only_a_quarter = false);
/// Two lobes bent round the y axis, apart by a slit. A single column of cells lies round its end, beside both. In the
/// inner lobe a channel is 0, along the outer one it rises from there on.
ControlMesh forked_slit(double width_mm);
/// A slab with two valleys that cross, sharp at the bottom: folds.
ControlMesh crossed_valleys();
/// One hex for each triangle round a centre vertex whose link is the given triangulation of the sphere (vertices on
/// it).
ControlMesh star_mesh(const std::vector<Vec3>& sphere, const std::vector<std::array<int, 3>>& triangles);
/// Triangles of the convex hull of points on a sphere, no four of them in one outer plane.
std::vector<std::array<int, 3>> hull_triangles(const std::vector<Vec3>& points);
/// The refined mesh's own points as a control mesh of hexes.
ControlMesh refined_mesh(const ControlMesh& mesh);

inline constexpr int kBandCellsPerTurn = 48;
/// A band of 2 x 2 cells across and upwards, 1 mm wide and 2 mm high: with these inner radii about the z axis, one for
/// each 1/48 of a turn. A channel is the number of turns.
ControlMesh band_along(const std::vector<double>& radii_mm);
/// Such a band of two turns that are `gap_mm` apart, or overlap by as much as that is negative.
ControlMesh spiral(double gap_mm);

/// Parts inside each other and in contact: three quarters of barrels, each one cell of 5 mm thick and 20 mm high.
ControlMesh nested_shells(int count);

/// Adds a mesh of the same channels, moved by an offset, as parts that share nothing with those before.
void append_mesh(ControlMesh& mesh, const ControlMesh& other, const Vec3& offset);
/// Moves every vertex by at most `amplitude_mm` in each direction.
void jitter(ControlMesh& mesh, double amplitude_mm, std::uint32_t seed);
void add_random_channels(ControlMesh& mesh, int channels, std::uint32_t seed);
/// Channels x, y, z (mm): the material at a parameter is its own position, to float precision of the control points.
void grade_by_coordinates(ControlMesh& mesh);
/// Sharpens boundary edges for which keep(end a, end b) holds.
void sharpen(ControlMesh& mesh, const std::function<bool(const Vec3&, const Vec3&)>& keep);
/// Sharpens boundary edges with exactly `cells` cells.
void sharpen_by_cells(ControlMesh& mesh, std::size_t cells);

}  // namespace ccslice::oracle
