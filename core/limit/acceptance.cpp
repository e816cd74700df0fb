// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/acceptance.h"

#include <limits>

#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr double kLeastOfDiagonal = 1e-12;
constexpr double kLeastOfCoordinates = 16 * std::numeric_limits<double>::epsilon();

double reachable_mm(const Box3& box) {
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return std::max(kLeastOfDiagonal * box.diagonal().norm(), kLeastOfCoordinates * farthest);
}

}  // namespace

Acceptance::Acceptance(const LimitSolid& solid, double most_mm)
    : solid_(&solid), least_mm_(reachable_mm(solid.summary().bounding_box)), most_mm_(std::max(most_mm, least_mm_)) {}

double Acceptance::in_cell(LimitCellId cell) const noexcept {
  return at(solid_->index().cell_maps[cell].inverse_jacobian);
}

}  // namespace ccslice
