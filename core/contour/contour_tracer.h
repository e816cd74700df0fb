// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours of one layer after the other, with the memory of the last. contour.h describes the method.

#pragma once

#include <memory>

#include "core/contour/contour.h"
#include "core/contour/contour_index.h"

namespace ccslice {

/// One solid, one thread. A layer's contours depend on nothing that the tracer did before.
class ContourTracer {
 public:
  /// REQUIRES: `index` is the solid's; the solid outlives the tracer.
  ContourTracer(const LimitSolid& solid, std::shared_ptr<const ContourIndex> index);
  ~ContourTracer();
  ContourTracer(ContourTracer&&) noexcept;
  ContourTracer& operator=(ContourTracer&&) noexcept;

  /// Goes on with planes of another normal or placement, with the memory of before. REQUIRES: as the constructor.
  void follow(std::shared_ptr<const ContourIndex> index);

  /// REQUIRES: the plane's normal is the index's; tolerance and feature size positive. Throws Error{kCancelled}.
  Contours trace(const SlicePlane& plane, const ContourOptions& options);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
