// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Random control meshes: whatever the catalogue of tiny meshes didn't think of.

#pragma once

#include <cstdint>

#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

enum class RandomKind {
  kPolycube,  // Some cells of a small box, so many kinds of boundary edges and vertices.
  kHexStar,   // Hexes round a vertex with a random link, whole or in part.
  kTetStar,   // The same as tetrahedra.
  kTerrain,   // Columns of hexes and wedges, one or two high.
};

/// Jittered, with two random channels; some boundary edges sharp, some vertices tagged, and the corners of some cells
/// in mirrored order, at random. Not always valid: pieces may touch at a vertex or an edge only.
ControlMesh random_mesh(RandomKind kind, std::uint32_t seed);

}  // namespace ccslice::oracle
