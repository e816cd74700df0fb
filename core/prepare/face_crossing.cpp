// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/face_crossing.h"

#include <algorithm>

namespace ccslice {

namespace {

constexpr int kFirstRounds = 8;
constexpr std::size_t kManyPairs = 64;  // More than surfaces leave that cross along a curve.
constexpr int kMoreRounds = 8;
constexpr std::size_t kMostPairs = 2048;  // To be quartered.

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

/// By place: the numbers of pieces depend on what was quartered before.
std::optional<FaceReach> FaceCrossing::reach_of_corners(LimitCellId cell, LimitCellId other) {
  std::ranges::sort(corners_);
  corners_.erase(std::unique(corners_.begin(), corners_.end()), corners_.end());
  for (const std::array<double, 3>& corner : corners_) {
    const Vec3 position(corner[0], corner[1], corner[2]);
    if (const auto in = probe_.find(other, position)) return FaceReach{cell, other, position, in->depth_mm};
  }
  return std::nullopt;
}

std::optional<FaceReach> FaceCrossing::reach_of_pairs(const SurfacePieces& of_a, LimitCellId cell_a,
                                                      const SurfacePieces& of_b, LimitCellId cell_b) {
  const auto add_corners = [this](const SurfacePiece& piece) {
    for (const Vec3& corner : piece.corners) corners_.push_back({corner.x(), corner.y(), corner.z()});
  };
  corners_.clear();
  for (const auto& [a, b] : pairs_) add_corners(of_a[a]);
  if (const auto found = reach_of_corners(cell_a, cell_b)) return found;
  corners_.clear();
  for (const auto& [a, b] : pairs_) add_corners(of_b[b]);
  return reach_of_corners(cell_b, cell_a);
}

std::optional<FaceReach> FaceCrossing::find(SurfacePieces& of_a, LimitCellId cell_a, SurfacePieces& of_b,
                                            LimitCellId cell_b) {
  pairs_.clear();
  for (std::uint32_t i = 0; i < of_a.roots(); ++i) {
    for (std::uint32_t j = 0; j < of_b.roots(); ++j) keep(of_a, i, of_b, j);
  }
  for (int round = 0; round < kFirstRounds && pairs_.size() <= kManyPairs; ++round) quarter_larger_ones(of_a, of_b);
  if (const auto found = reach_of_pairs(of_a, cell_a, of_b, cell_b)) return found;
  if (pairs_.size() <= kManyPairs) return std::nullopt;
  for (int round = 0; round < kMoreRounds && pairs_.size() <= kMostPairs; ++round) quarter_larger_ones(of_a, of_b);
  return reach_of_pairs(of_a, cell_a, of_b, cell_b);
}

std::optional<FaceReach> FaceCrossing::find(BoundaryFaceId a, BoundaryFaceId b) {
  KeptPieces& kept = kept_[b % kKept];
  const auto found = find(of_a_.of(a), surface_.faces()[a].cell, kept.of(b), surface_.faces()[b].cell);
  of_a_.forget_many();
  kept.forget_many();
  return found;
}

}  // namespace ccslice
