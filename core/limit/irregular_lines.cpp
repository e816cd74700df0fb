// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/irregular_lines.h"

#include <algorithm>
#include <cmath>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr double kMostPieces = 256;  // Of a line.

/// The parameter at distance t from the frame's origin along its axis.
Vec3 along_axis(const Frame& frame, std::size_t axis, double t) {
  Vec3 uvw;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = frame.axis[a];
    const double framed = a == axis ? t : 0;
    uvw[b] = frame.origin >> b & 1 ? 1 - framed : framed;
  }
  return uvw;
}

}  // namespace

std::vector<IrregularLine> irregular_lines(const LimitSolid& solid) {
  std::vector<IrregularLine> lines;
  for (std::uint32_t cell = 0; cell < solid.cell_count(); ++cell) {
    const LimitCell& data = solid.data().cells[cell];
    if (data.cell_class == CellClass::kRegular) continue;
    // A line cell's frame has its line along the third axis.
    for (std::size_t axis = data.cell_class == CellClass::kLine ? 2 : 0; axis < 3; ++axis) {
      lines.push_back({cell, along_axis(data.frame, axis, 0), along_axis(data.frame, axis, 1)});
    }
  }
  return lines;
}

void append_points(const IrregularLine& line, double spacing_mm, LimitEvaluator& evaluator, std::vector<Vec3>& points) {
  const auto at = [&](double t) { return evaluator.geo({line.cell, line.from + t * (line.to - line.from)}); };
  const Vec3 begin = at(0), middle = at(0.5), end = at(1);
  const double length = (middle - begin).norm() + (end - middle).norm();
  const double pieces = std::clamp(std::ceil(length / spacing_mm), 1.0, kMostPieces);
  points.push_back(begin);
  for (double k = 1; k < pieces; ++k) points.push_back(at(k / pieces));
  points.push_back(end);
}

}  // namespace ccslice
