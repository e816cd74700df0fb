// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The distance from the part's boundary, or from where its cell regions meet, as the values of a channel.

#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/distance/boundary_distance.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// The surfaces that a solid has.
enum class SurfaceKind { kBoundary, kInterfaces };

/// All is made for the first value, from triangles that are within a hundredth of the reach of the surface, but no
/// finer than 2 um and no coarser than 5. If that takes more than kManyTriangles, they are coarser, but within a tenth
/// of the reach if kMostTriangles allow. Distances that were made last are kept for jobs that ask for the same.
class DistanceSource final : public ChannelSource {
 public:
  static constexpr std::size_t kManyTriangles = 500'000, kMostTriangles = 2'000'000;

  /// Values are clamped to the range, and distances beyond the reach have that. `placed` turns and sizes the mesh.
  /// Throws Error{kTooManyTriangles} of no field where the faces alone take more; Error{kFieldInvalid} of none if there
  /// is no such surface. REQUIRES: reach_mm > 0; as FormulaSource of the range.
  DistanceSource(ChannelRange range, std::shared_ptr<const LimitSolid> solid, const Mat3& placed, SurfaceKind surface,
                 double reach_mm);

  ~DistanceSource() override;
  DistanceSource(const DistanceSource&) = delete;
  DistanceSource& operator=(const DistanceSource&) = delete;

  const ChannelRange& range() const noexcept override { return range_; }
  void sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                  std::span<float> values) const override;
  bool follows_part() const noexcept override { return true; }
  double memory_bytes(const CancellationToken& cancel = {}) const override;

 private:
  struct Surface;

  const Surface& surface(const CancellationToken& cancel) const;
  const BoundaryDistance& distance(const CancellationToken& cancel) const;

  ChannelRange range_;
  std::shared_ptr<const LimitSolid> solid_;
  Mat3 placed_;
  SurfaceKind kind_;
  double reach_mm_;
  Vec3 origin_;         // Floats are counted from it: placed_ times the middle of the mesh.
  double farthest_mm_;  // A corner of the part's box is so far from it.
  mutable std::once_flag bounded_, made_;
  mutable std::shared_ptr<const Surface> surface_;
  mutable std::shared_ptr<const BoundaryDistance> distance_;
};

}  // namespace ccslice
