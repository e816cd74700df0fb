// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// geo(i,u,v,w) and mat(i,u,v,w) of [Luu19, 3], and the Jacobian of geo, exact and in bounded time for every limit cell.

#pragma once

#include <memory>
#include <span>

#include "core/limit/limit_solid.h"

namespace ccslice {

struct Patch;
struct PatchPlace;

struct LimitSample {
  Vec3 position = Vec3::Zero();  // mm, mesh frame.
  Mat3 jacobian = Mat3::Zero();  // Columns d/du, d/dv, d/dw, mm per unit parameter.
};

inline constexpr std::size_t kSmallPatchCacheBytes = 1 << 20;
/// Returns the bytes of a cache of at most `most_bytes`, once patches of a solid with so many channels fill it.
std::size_t patch_cache_bytes(std::size_t channels, std::size_t most_bytes);

/// Evaluates one solid on one thread: owns the scratch memory that irregular cells need, and a bounded cache of their
/// patches (a result never depends on what is cached). Evaluation is noexcept and allocation-free.
/// REQUIRES: the solid outlives the evaluator; cell < cell_count(), uvw in [0,1]^3.
class LimitEvaluator {
 public:
  explicit LimitEvaluator(const LimitSolid& solid, std::size_t patch_cache_bytes = kSmallPatchCacheBytes);
  ~LimitEvaluator();
  LimitEvaluator(LimitEvaluator&&) noexcept;
  LimitEvaluator& operator=(LimitEvaluator&&) noexcept;

  Vec3 geo(const CellParam& at) noexcept;
  /// On an irregular line or vertex itself the Jacobian may be singular or unbounded: the value returned there is that
  /// of the innermost sub-cell (finite, direction-dependent).
  LimitSample sample(const CellParam& at) noexcept;
  /// Writes channel_count() values. REQUIRES: out.size() == channel_count().
  void mat(const CellParam& at, std::span<double> out) noexcept;

  /// Both: returns geo. REQUIRES: channels.size() == channel_count().
  Vec3 geo_and_mat(const CellParam& at, std::span<double> channels) noexcept;

  /// The regular patch that holds a parameter, and the place in it; nothing on an irregular line or vertex itself.
  /// Valid until the next call.
  const Patch* patch_at(const CellParam& at, PatchPlace& place) noexcept;
  /// The patch at a place of the cell that find_patch() yielded. REQUIRES: on no irregular line or vertex itself.
  const Patch& patch(LimitCellId cell, const PatchPlace& place) noexcept;

  const LimitSolid& solid() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
