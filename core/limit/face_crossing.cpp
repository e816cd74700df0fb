// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/face_crossing.h"

#include <algorithm>
#include <tuple>

namespace ccslice {

namespace {

constexpr int kMostRounds = 8;
constexpr std::size_t kMostPairs = 64;  // To be quartered: surfaces that touch have ever more.

double size2(const SurfacePiece& piece) { return piece.box.box.diagonal().squaredNorm(); }

}  // namespace

void FaceCrossing::keep(const SurfacePieces& of_a, std::uint32_t a, const SurfacePieces& of_b, std::uint32_t b) {
  ++work_;
  if (!cannot_cross(of_a[a].box, of_b[b].box, kLeastOverlapMm)) pairs_.emplace_back(a, b);
}

void FaceCrossing::quarter_larger_ones(SurfacePieces& of_a, SurfacePieces& of_b) {
  last_pairs_.swap(pairs_);
  pairs_.clear();
  for (const auto& [a, b] : last_pairs_) {
    const bool is_a = size2(of_a[a]) >= size2(of_b[b]);
    const std::uint32_t first = is_a ? of_a.quarters(a) : of_b.quarters(b);
    for (std::uint32_t k = 0; k < 4; ++k) is_a ? keep(of_a, first + k, of_b, b) : keep(of_a, a, of_b, first + k);
  }
}

/// The pieces are those in `used_`. They are looked at by place: their numbers depend on what was quartered before.
std::optional<FaceReach> FaceCrossing::reach_of(const SurfacePieces& pieces, LimitCellId cell, LimitCellId other) {
  const auto place_of = [&](std::uint32_t piece) {
    const Vec3 &low = pieces[piece].corners[0], &high = pieces[piece].corners[2];
    return std::tuple(low.x(), low.y(), low.z(), high.x(), high.y(), high.z(), piece);
  };
  std::ranges::sort(used_, {}, place_of);
  used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
  for (const std::uint32_t piece : used_) {
    for (const Vec3& corner : pieces[piece].corners) {
      if (const auto in = probe_.find(other, corner)) return FaceReach{cell, other, corner, in->depth_mm};
    }
  }
  return std::nullopt;
}

std::optional<FaceReach> FaceCrossing::find(BoundaryFaceId a, BoundaryFaceId b) {
  SurfacePieces& of_a = of_a_.of(a);
  SurfacePieces& of_b = kept_[b % kKept].of(b);
  pairs_.clear();
  for (std::uint32_t i = 0; i < of_a.roots(); ++i) {
    for (std::uint32_t j = 0; j < of_b.roots(); ++j) keep(of_a, i, of_b, j);
  }
  for (int round = 0; round < kMostRounds && pairs_.size() <= kMostPairs; ++round) quarter_larger_ones(of_a, of_b);
  if (pairs_.empty()) return std::nullopt;
  const LimitCellId cell_a = surface_.faces()[a].cell, cell_b = surface_.faces()[b].cell;
  used_.clear();
  for (const Pair& pair : pairs_) used_.push_back(pair.first);
  if (const auto found = reach_of(of_a, cell_a, cell_b)) return found;
  used_.clear();
  for (const Pair& pair : pairs_) used_.push_back(pair.second);
  return reach_of(of_b, cell_b, cell_a);
}

}  // namespace ccslice
