// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether one of two boundary faces reaches into the cell of the other one. Two pieces of surface whose boxes can't
// cross are done with; of two others the larger one is quartered. Where many are left, and at last, their corners are
// looked for in the other face's cell. Faces in contact leave many and reach nowhere: their pieces are quartered until
// they are flat enough to be told apart.
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/prepare/cell_probe.h"
#include "core/prepare/surface_pieces.h"
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
      if (face != wanted) pieces.start(face = wanted);
      return pieces;
    }
    void forget_many() {
      if (pieces.size() > kMostPieces) pieces.clear(), face = BoundaryFaceId{kNone};
    }

    static constexpr std::uint32_t kMostPieces = 256;  // 0.2 MB.
    SurfacePieces pieces;
    BoundaryFaceId face{kNone};
  };
  static constexpr std::size_t kKept = 16;

  void keep(const SurfacePieces& of_a, std::uint32_t a, const SurfacePieces& of_b, std::uint32_t b);
  void quarter_larger_ones(SurfacePieces& of_a, SurfacePieces& of_b);
  std::optional<FaceReach> find(SurfacePieces& of_a, LimitCellId cell_a, SurfacePieces& of_b, LimitCellId cell_b);
  std::optional<FaceReach> reach_of_pairs(const SurfacePieces& of_a, LimitCellId cell_a, const SurfacePieces& of_b,
                                          LimitCellId cell_b);
  std::optional<FaceReach> reach_of_corners(LimitCellId cell, LimitCellId other);

  const BoundarySurface& surface_;
  CellProbe& probe_;
  KeptPieces of_a_;
  std::vector<KeptPieces> kept_;                // Of faces b, by number modulo kKept.
  std::vector<Pair> pairs_, last_pairs_;        // That may cross.
  std::vector<std::array<double, 3>> corners_;  // Of pieces of one face.
  std::uint64_t work_ = 0;
};

}  // namespace ccslice
