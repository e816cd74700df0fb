// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What printers take: their voxels, their trays, how many materials at once. Figures as publicly known, not
// certified by the makers: a warning of PlanSlices is a hint, no refusal.

#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/base/types.h"
#include "core/job/grid.h"

namespace ccslice {

struct PrinterProfile {
  std::string name;   // "j750-hq".
  std::string title;  // For people.
  VoxelPitch pitch;
  Vec3 tray_mm = Vec3::Zero();      // 0: no bound.
  std::uint32_t max_materials = 0;  // Besides the background. 0: no bound.
  std::uint32_t min_layers = 0;
  double smallest_feature_mm = 0;  // 0: two voxels. We know of none that is published for those below.
};

/// All profiles, by name.
std::span<const PrinterProfile> printer_profiles();

/// Null if there is none of that name.
const PrinterProfile* find_printer_profile(std::string_view name);

}  // namespace ccslice
