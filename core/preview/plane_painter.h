// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of planes through a solid. Contours and occupancy are those of slicing, and values come from a sampler that
// is made for single planes (plane_sampler.h). What planes of one orientation share, the index of the faces by their
// heights and the tree of their boxes, is kept from picture to picture; patches of cells, whatever the orientation.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/contour.h"
#include "core/limit/limit_solid.h"
#include "core/preview/preview_job.h"

namespace ccslice {

/// How many times coarser the first picture is, each way.
inline constexpr std::uint32_t kCoarseTimes = 8;

/// One thread. A picture depends on nothing that was painted before.
class PlanePainter {
 public:
  explicit PlanePainter(std::shared_ptr<const LimitSolid> solid);
  ~PlanePainter();
  PlanePainter(PlanePainter&&) noexcept;
  PlanePainter& operator=(PlanePainter&&) noexcept;

  /// REQUIRES: validate_preview() passes. Throws Error{kCancelled, kInternal}.
  PreviewPicture paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel);

 private:
  class State;
  std::unique_ptr<State> state_;
};

/// Contours as outlines of a picture whose lower left corner is at `corner`.
std::vector<std::vector<Vec2>> outlines_of(std::span<const ContourLoop> loops, const Vec2& corner);

}  // namespace ccslice
