// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_shells.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/field/material_field.h"
#include "core/interpolation/pieces/block_faces.h"
#include "core/limit/cell_index.h"

namespace ccslice::oracle {
namespace {

// Triangles may be off by this share of the tolerance, unless proof is asked for. Where a cell's map degenerates, at a
// vertex or along a smooth edge of the boundary, the slopes of its materials have no bound, and errors peak between all
// places that are looked at. Of 10,000 random jobs two had such a peak beyond 1, up to 1.06; both were narrower than a
// tenth of a voxel.
constexpr double kMostOfSampled = 1.1;

/// A place of the triangles of a side, each quadrilateral cut along its shorter diagonal. 0 <= s, t <= 1.
Vec3 on_triangles(const CellPiece& piece, std::size_t side, double s, double t) {
  const BlockFace face(side / 2, side % 2);
  const std::size_t quads = (kBlockNodes - 1) / piece.step;
  const double along_s = s * static_cast<double>(quads), along_t = t * static_cast<double>(quads);
  const std::size_t i = std::min(static_cast<std::size_t>(along_s), quads - 1),
                    j = std::min(static_cast<std::size_t>(along_t), quads - 1);
  const double u = along_s - static_cast<double>(i), v = along_t - static_cast<double>(j);
  const auto corner = [&](std::size_t a, std::size_t b) {
    return piece.points[face.node((i + a) * piece.step, (j + b) * piece.step)];
  };
  const Vec3 a = corner(0, 0), b = corner(1, 0), c = corner(0, 1), d = corner(1, 1);
  if ((a - d).squaredNorm() <= (b - c).squaredNorm()) {
    return u > v ? a + (u - v) * (b - a) + v * (d - a) : a + (v - u) * (c - a) + u * (d - a);
  }
  return u + v < 1 ? a + u * (b - a) + v * (c - a) : d + (1 - u) * (c - d) + (1 - v) * (b - d);
}

}  // namespace

ShellSearch::ShellSearch(const Evaluated& evaluated, HostileFinding& finding)
    : evaluated_(evaluated),
      finding_(finding),
      mesh_of_voxel_(evaluated.voxel_of_mesh.inverse(Eigen::Affine)),
      inverter_(*evaluated.solid, inversion_options_of(scales_of(evaluated.spec.placement), evaluated.spec.outside_mm)),
      truths_(evaluated.solid, evaluated.spec.placement, evaluated.spec.outside_mm),
      values_(evaluated.solid->channel_count()),
      no_slack_(values_.size()) {}

void ShellSearch::search(LimitCellId cell, const CellPiece& piece) {
  constexpr double kLeastSize = 10;  // As a share of how far voxels may lie off the solid.
  const VoxelPitch& pitch = evaluated_.spec.grid.pitch;
  Box3 box;
  for (const Vec3& point : piece.points) box.extend(point);
  const double size_mm = box.diagonal().cwiseProduct(Vec3(pitch.x_mm, pitch.y_mm, pitch.z_mm)).norm();
  if (size_mm < kLeastSize * evaluated_.spec.outside_mm) return;
  for (std::size_t side = 0; side < 6; ++side) search(cell, piece, side);
}

void ShellSearch::search(LimitCellId cell, const CellPiece& piece, std::size_t side) {
  outside_ = false;
  const auto [largest, at] = find_largest<2>(
      [&](const Vec3& place) { return find_error(cell, piece, on_triangles(piece, side, place.x(), place.y())); });
  finding_.compared += outside_;
  const bool holds = largest <= (evaluated_.spec.proved ? 1 : kMostOfSampled);
  if (!holds && truths_.overlaps_another(cell)) {
    ++finding_.excused;
    ++finding_.overlapped;
    return;
  }
  finding_.worst = std::max(largest, finding_.worst);
  if (holds || ++finding_.failed > 1) return;
  const Vec3 voxel = on_triangles(piece, side, at.x(), at.y());
  finding_.where = "cell " + std::to_string(cell) + ", triangles of side " + std::to_string(side) +
                   " of the piece about " + vector_text(piece.parameters.uvw) + ": " + number(largest) +
                   " of the tolerance at voxel " + vector_text(voxel) + ", " +
                   place_text(truths_.find(evaluated_.spec.placement * (mesh_of_voxel_ * voxel)));
}

/// The error of the channel that is off most is returned, as a share of its tolerance. It is 0 where the piece doesn't
/// paint, or nobody does.
double ShellSearch::find_error(LimitCellId cell, const CellPiece& piece, const Vec3& voxel) {
  constexpr double kSurely = 0.9;   // Whatever inversion is off by. What it may be off by is known where this is more.
  constexpr double kInside = 1e-6;  // mm.
  const bool is_left = std::any_of(piece.beyond.begin(), piece.beyond.end(), [&](const CubicPolynomial& beyond) {
    return value_at(beyond, piece.frame(voxel)) > 0;
  });
  if (is_left) return 0;
  const Vec3 point = mesh_of_voxel_ * voxel;
  if (evaluated_.solid->index().is_ambiguous(Box3(point, point))) return 0;
  const std::optional<InversionResult> found = inverter_.invert(point, CellParam{cell, piece.parameters(voxel)});
  if (!found) return 0;
  outside_ = outside_ || found->at.cell != cell || found->residual_mm > kInside;
  inverter_.evaluator().mat(found->at, values_);
  const double seen = error(piece, voxel, values_, no_slack_);
  return seen <= kSurely ? seen : true_error(piece, voxel);
}

/// Off the solid voxels lie by the contours' tolerance at most.
double ShellSearch::true_error(const CellPiece& piece, const Vec3& voxel) {
  const Placement& placement = evaluated_.spec.placement;
  const Vec3 point = mesh_of_voxel_ * voxel, world = placement * point;
  const std::optional<VoxelTruth> truth = truths_.find(world);
  if (!truth || is_ambiguous(truth->place) || truth->place == VoxelPlace::kNowhere) return 0;
  if (truth->place == VoxelPlace::kOff) {
    const double off_mm = (placement.linear() * (inverter_.evaluator().geo(truth->at) - point)).norm();
    if (off_mm > evaluated_.spec.outside_mm - kOutsideSlackMm) return 0;
  }
  const std::vector<double> slack = truths_.slack(*truth);
  double least = error(piece, voxel, truth->values, slack);
  if (least <= 1) return least;
  for (const VoxelTruth& as_good : truths_.places_beyond_interfaces(world, *truth)) {
    least = std::min(least, error(piece, voxel, as_good.values, slack));
  }
  return least;
}

double ShellSearch::error(const CellPiece& piece, const Vec3& voxel, std::span<const double> values,
                          std::span<const double> slack) const {
  const Vec3 at = piece.frame(voxel);
  double most = 0;
  for (std::size_t c = 0; c < evaluated_.spec.channels.size(); ++c) {
    const auto& [channel, tolerance] = evaluated_.spec.channels[c];
    const double off = std::abs(value_at(piece.polynomials[c], at) - values[channel]) - slack[channel];
    most = std::max(most, off / tolerance - evaluated_.rounding(c));
  }
  return most;
}

}  // namespace ccslice::oracle
