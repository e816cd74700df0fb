// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/placement.h"

#include <cmath>
#include <numbers>

#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "core/base/types.h"

namespace ccslice::cli {
namespace {

constexpr double kLeastScale = 1e-6, kMostScale = 1e6;  // As in geometry.proto.

/// Exact at multiples of 90 degrees.
double cosine(double degrees) {
  const double turned = std::abs(std::remainder(degrees, 360));
  if (turned == 90) return 0;
  return turned == 180 ? -1 : std::cos(turned * std::numbers::pi / 180);
}

double sine(double degrees) { return cosine(degrees - 90); }

Mat3 rotation(const std::string& text) {
  if (text.size() < 3 || text[0] < 'x' || text[0] > 'z' || text[1] != '=') {
    throw UsageError("--rotate takes an axis and degrees, as in x=90, not '" + text + "'");
  }
  const double degrees = parse_number("--rotate", text.substr(2));
  const int axis = text[0] - 'x', a = (axis + 1) % 3, b = (axis + 2) % 3;
  Mat3 matrix = Mat3::Identity();
  matrix(a, a) = matrix(b, b) = cosine(degrees);
  matrix(b, a) = sine(degrees);
  matrix(a, b) = -sine(degrees);
  return matrix;
}

}  // namespace

void add_placement_options(CLI::App& command, PlacementOptions& options) {
  const OptionGroup group(command, "Placement");
  command.add_option("--scale", options.scale,
                     "One factor, or one for each axis; applied first. Negative factors mirror: 1,1,-1 turns z over. "
                     "Lengths of other options are those of the scaled part");
  command
      .add_option("--rotate", options.rotate,
                  "AXIS=DEGREES about the mesh's origin, as in x=90; applied in order. May be repeated")
      ->allow_extra_args(false);
  command.add_option("--translate", options.translate, "X,Y,Z in mm; applied last");
}

Vec3 parse_scale(const PlacementOptions& options) {
  if (options.scale.empty()) return Vec3::Ones();
  const std::vector<double> factors = parse_numbers("--scale", options.scale, 1, 3);
  if (factors.size() == 2) throw UsageError("--scale takes one factor or three, not '" + options.scale + "'");
  const Vec3 scale(factors[0], factors[factors.size() == 3 ? 1 : 0], factors[factors.size() == 3 ? 2 : 0]);
  if ((scale.array() == 0).any()) throw UsageError("--scale by 0 leaves nothing");
  if (!(scale.array().abs() >= kLeastScale && scale.array().abs() <= kMostScale).all()) {
    throw UsageError("--scale takes factors from 1e-6 to 1e6, not '" + options.scale + "'");
  }
  return scale;
}

v1::Placement parse_placement(const PlacementOptions& options) {
  Mat3 linear = parse_scale(options).asDiagonal();
  for (const std::string& text : options.rotate) linear = rotation(text) * linear;
  Vec3 offset = Vec3::Zero();
  if (!options.translate.empty()) {
    const std::vector<double> numbers = parse_numbers("--translate", options.translate, 3, 3);
    offset = Vec3(numbers[0], numbers[1], numbers[2]);
  }
  v1::Placement placement;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) placement.add_matrix(linear(row, column));
    placement.add_matrix(offset[row]);
  }
  return placement;
}

}  // namespace ccslice::cli
