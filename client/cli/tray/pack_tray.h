// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A plain arrangement of rectangles on a tray: bottom-left on a skyline, which is the upper edge of what lies there so
// far. Each rectangle goes where its own upper edge comes lowest, turned by 90 degrees if that is lower, and leftmost
// among equals. That is done for several orders of the rectangles, and the arrangement that ends lowest is taken. The
// same input gives the same arrangement.

#pragma once

#include <cstddef>
#include <vector>

namespace ccslice::cli {

struct Footprint {
  double width_mm = 0, depth_mm = 0;  // Along x and y.
};

struct PackedPlace {
  double x_mm = 0, y_mm = 0;  // Of the lower left corner.
  bool turned = false;        // By 90 degrees: what was along x is along y.
};

struct PackedTray {
  std::vector<PackedPlace> places;  // Of each footprint.
  double depth_mm = 0;              // Where the highest of them ends.
};

/// Packs all of them into a tray of this width that is as deep as it takes, `clearance_mm` apart. REQUIRES: each is no
/// wider than the tray one way or the other.
PackedTray pack_tray(const std::vector<Footprint>& footprints, double width_mm, double clearance_mm);

}  // namespace ccslice::cli
