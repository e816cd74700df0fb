// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// OpenSubdiv's boundary surface of a subject, with the way back to the core's parameters. Meshes with tets or wedges
// are refined once first.

#pragma once

#include "tests/oracle/subject.h"
#include "tests/support/bfr_surface.h"

namespace ccslice::oracle {

class SurfaceView {
 public:
  explicit SurfaceView(const Subject& subject);

  const BfrSurface& surface() const { return surface_; }
  /// The core's parameter of a point of a face.
  CellParam param(std::uint32_t face, double s, double t) const;

 private:
  const Subject& subject_;
  BruteMesh mesh_;
  BfrSurface surface_;
};

}  // namespace ccslice::oracle
