// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sample solids made by code: the models of [Luu19, Fig. 7 and Table 2] anew, and a box.
//
// RING is a ring of the size class of the ring in [Luu19, Table 2]: 32 cells round, 4 across, 4 high. Its four circular
// edges are sharp, which makes every cell regular, so its limit is known in closed form. Round the ring it is the
// closed uniform cubic B-spline over 32 control points of a regular polygon: with control radius R the limit's radius
// at the knots, which lie on the axes, is R (4 + 2 cos(2 pi / 32)) / 6. Across and upwards the control points are
// equally spaced and the boundary is interpolated, so the limit is linear there. At a pitch of 0.0423 x 0.0846 x 0.03
// mm it takes 1975 x 987 voxels and 576 layers, with about 507 million voxels inside.
//
// BOX is a box with sharp edges and corners: its limit is the box itself and its gradient is linear to the last bits.

#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/mesh/control_mesh.h"

namespace ccslice {

struct RingShape {
  int cells_round = 32, cells_across = 4, cells_high = 4;
  double outer_diameter_mm = 83.53;  // The limit's, along the axes.
  double inner_diameter_mm = 54.47;
  double height_mm = 17.28;
};

/// About the z axis, standing on z = 0. One channel, "hardness": 0 at the inner radius, 1 at the outer one, linear
/// between. REQUIRES: cells_round a multiple of 4, cells_across and cells_high >= 1, 0 < inner < outer diameter.
ControlMesh make_ring(const RingShape& shape = {});

struct BoxShape {
  Vec3 size_mm = Vec3(24, 16, 8);
  int cells_x = 6, cells_y = 4, cells_z = 2;
};

/// With one corner at the origin. One channel, "gradient": 0 at x = 0, 1 at the other end. REQUIRES: counts >= 1.
ControlMesh make_box(const BoxShape& shape = {});

/// After the other samples of [Luu19, Fig. 7]: the same cell counts and sizes, all edges smooth. Without folds.
/// COYOTE: 48 cells, channel "stiffness" from its back to its paws. ENGINE: 301, "hardness", 1 in the liners.
/// BRACKET: 163, "stiffness" from the middle outwards. GRID: 1,000, "stiffness" along x, more in the nodes' cores.
ControlMesh make_coyote();
ControlMesh make_engine();
ControlMesh make_bracket();
ControlMesh make_grid();

struct SampleModel {
  std::string_view name;
  std::string_view description;
  ControlMesh (*make)();
};

/// All samples, by name.
std::span<const SampleModel> sample_models();
/// Null if there is none of that name.
const SampleModel* find_sample_model(std::string_view name);

}  // namespace ccslice
