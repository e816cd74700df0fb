// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which mix of a palette gives a colour. Light adds up in linear intensity, so a mix with weights w_i of the colours
// c_i looks like sum w_i c_i, and the mixes are barycentric coordinates. Of those that give the colour t (or the point
// of the palette's convex hull that is nearest to it) the one with the least sum w_i |c_i - t|^2 is taken: that of the
// nearest colours, the simplex of their Delaunay triangulation. It has at most four colours, and is continuous in t.
//
// Eight colours have 162 subsets of at most four; all are tried. This is cold code: Mixture tabulates it.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"

namespace ccslice {

/// Linear intensity of an sRGB component in [0, 1] (IEC 61966-2-1).
double linear_intensity(double srgb) noexcept;
/// The colour 0xRRGGBBAA without its alpha.
Vec3 linear_colour(std::uint32_t rgba) noexcept;

/// Weights of the palette's colours, and how far their mix is from the colour that was asked for.
struct ColourMix {
  std::array<double, 8> weights{};
  double distance = 0;
};

class ColourGamut {
 public:
  /// REQUIRES: 1 to 8 colours, in linear intensity.
  explicit ColourGamut(std::span<const Vec3> colours);

  ColourMix mix(const Vec3& colour) const;

 private:
  /// Weights of some colours as an affine function of the colour: w = origin + slope * t; a mix if none is negative.
  struct Simplex {
    std::array<std::uint8_t, 4> members{};
    std::size_t size = 0;
    Eigen::Matrix<double, 4, 3> slope;
    Eigen::Vector4d origin;
  };
  void add_simplex(const std::array<std::uint8_t, 4>& members, std::size_t size);

  std::vector<Vec3> colours_;
  std::vector<Simplex> simplices_;
};

}  // namespace ccslice
