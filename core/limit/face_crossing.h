// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether one of two boundary faces reaches into the cell of the other one. Two pieces of surface whose boxes can't
// cross are done with; of two others the larger one is quartered. The corners of those that are left at last are looked
// for in the other face's cell.
//
// Private to core/limit.

#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/limit/cell_probe.h"
#include "core/limit/surface_pieces.h"
#include "core/subdivision/operator_table.h"

namespace ccslice {

/// A face of a cell reaches into another cell.
struct FaceReach {
  LimitCellId cell, other;
  Vec3 position;    // On the face, mm.
  double depth_mm;  // There.
};

/// One solid, one thread.
class FaceCrossing {
 public:
  /// REQUIRES: all outlive this.
  FaceCrossing(const BoundarySurface& surface, CellProbe& probe) : surface_(surface), probe_(probe), of_a_(surface) {
    kept_.reserve(kKept);
    while (kept_.size() < kKept) kept_.emplace_back(surface);
  }

  /// Pairs of pieces compared so far: some fifty nanoseconds each.
  std::uint64_t work() const noexcept { return work_; }
  /// A place where one does, if there is any: unless it reaches in less far than the pieces that are left are long.
  /// Takes less time for faces that it was asked about before.
  [[nodiscard]] std::optional<FaceReach> find(BoundaryFaceId a, BoundaryFaceId b);

 private:
  /// A piece of each face.
  using Pair = std::pair<std::uint32_t, std::uint32_t>;

  /// A face and what was made of it.
  struct KeptPieces {
    explicit KeptPieces(const BoundarySurface& surface) : pieces(surface) {}

    SurfacePieces& of(BoundaryFaceId wanted) {
      if (face != wanted || pieces.size() > kMostPieces) pieces.start(face = wanted);
      return pieces;
    }

    static constexpr std::uint32_t kMostPieces = 256;  // 0.2 MB.
    SurfacePieces pieces;
    BoundaryFaceId face{kNone};
  };
  static constexpr std::size_t kKept = 16;

  void keep(const SurfacePieces& of_a, std::uint32_t a, const SurfacePieces& of_b, std::uint32_t b);
  void quarter_larger_ones(SurfacePieces& of_a, SurfacePieces& of_b);
  std::optional<FaceReach> reach_of(const SurfacePieces& pieces, LimitCellId cell, LimitCellId other);

  const BoundarySurface& surface_;
  CellProbe& probe_;
  KeptPieces of_a_;
  std::vector<KeptPieces> kept_;          // Of faces b, by number modulo kKept.
  std::vector<Pair> pairs_, last_pairs_;  // That may cross.
  std::vector<std::uint32_t> used_;       // Pieces of one face.
  std::uint64_t work_ = 0;
};

}  // namespace ccslice
