// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>

#include "ccslice/v1/mesh.pb.h"

namespace ccslice::server {

/// n x n x n hexahedra that fill the cube [0, size]^3, with one channel "x" that is the x coordinate.
v1::ControlMesh make_block(std::uint32_t n, double size_mm);

/// Its edges sharp too, and its corners: the limit volume is the cube itself.
v1::ControlMesh make_box(std::uint32_t n, double size_mm);

/// So many boxes of 10 mm, each somewhat beside the others: all of them hold the points of [2,8]^3, which takes long to
/// find out.
v1::ControlMesh make_overlapping_boxes(std::uint32_t count);

/// Two blocks of 10 mm and 2 x 2 x 2 cells each, the second one moved along x.
v1::ControlMesh make_two_blocks(double shift_mm);

/// A plate with so many walls on it, 20 mm high and half a millimetre thick, as far from one another.
v1::ControlMesh make_comb(std::uint32_t walls);

/// A block without channels.
v1::ControlMesh make_plain_block(std::uint32_t n, double size_mm);

/// With other channels: "channel 0" is 0 everywhere, "channel 1" is 1.
v1::ControlMesh with_channels(v1::ControlMesh mesh, int channels);

}  // namespace ccslice::server
