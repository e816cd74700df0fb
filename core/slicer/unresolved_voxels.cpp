// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/unresolved_voxels.h"

#include <optional>
#include <string>

#include "core/base/error.h"
#include "core/slicer/nearest_solved.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kVoxelsPerPoll = 256;

}  // namespace

void UnresolvedVoxels::add(std::uint32_t row, std::uint32_t column) {
  if (!runs_.empty() && runs_.back().y == row && runs_.back().end == column) {
    ++runs_.back().end;
  } else {
    runs_.push_back({row, column, column + 1});
  }
}

void UnresolvedVoxels::fill(MaterialField& field, std::span<const Span> spans, const LayerLattice& lattice, double z_mm,
                            std::span<ContonePlane> planes, LayerStats& stats, const CancellationToken& cancel) const {
  if (runs_.empty()) return;
  for (const Span& run : runs_) stats.voxels_unresolved += run.end - run.begin;
  NearestSolved solved(spans, runs_, lattice);
  if (solved.empty()) return fill_from_solid(field, lattice, z_mm, planes, cancel);
  for (const Span& run : runs_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      if ((x - run.begin) % kVoxelsPerPoll == 0) cancel.throw_if_cancelled();
      const NearestSolved::Voxel source = solved.nearest(x, run.y);
      const std::size_t from = std::size_t{lattice.width} * source.y + source.x;
      const std::size_t to = std::size_t{lattice.width} * run.y + x;
      for (ContonePlane& plane : planes) plane.copy(from, to);
    }
  }
}

void UnresolvedVoxels::fill_from_solid(MaterialField& field, const LayerLattice& lattice, double z_mm,
                                       std::span<ContonePlane> planes, const CancellationToken& cancel) const {
  std::vector<double> values(field.channel_count());
  for (const Span& run : runs_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      cancel.throw_if_cancelled();
      const std::optional<InversionResult> found = field.nearest(lattice.centre(x, run.y, z_mm));
      if (!found) {
        throw Error(ErrorCode::kInternal, "no material for voxel (" + std::to_string(x) + ", " + std::to_string(run.y) +
                                              ") at z = " + std::to_string(z_mm) + " mm, inside the contours");
      }
      field.mat(found->at, values);
      const std::size_t index = std::size_t{lattice.width} * run.y + x;
      for (ContonePlane& plane : planes) plane.set(index, values);
    }
  }
}

}  // namespace ccslice
