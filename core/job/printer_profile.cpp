// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/printer_profile.h"

#include <algorithm>
#include <array>

namespace ccslice {
namespace {

constexpr double k600Dpi = 25.4 / 600, k300Dpi = 25.4 / 300;  // mm.
constexpr std::uint32_t kVoxelPrintLayers = 30;               // GrabCAD Voxel Print takes no fewer.

Vec3 large_tray() { return {490, 390, 200}; }

}  // namespace

std::span<const PrinterProfile> printer_profiles() {
  static const std::array<PrinterProfile, 8> profiles = {{
      {"j55", "Stratasys J55, 18.75 um layers", {k300Dpi, k300Dpi, 0.01875}, Vec3(140, 200, 190), 5, kVoxelPrintLayers},
      {"j750-hm",
       "Stratasys J750, High Mix, 27 um layers",
       {k600Dpi, k300Dpi, 0.027},
       large_tray(),
       6,
       kVoxelPrintLayers},
      {"j750-hq",
       "Stratasys J750, High Quality, 14 um layers",
       {k600Dpi, k300Dpi, 0.014},
       large_tray(),
       6,
       kVoxelPrintLayers},
      {"j750-hs",
       "Stratasys J750, High Speed, 27 um layers",
       {k600Dpi, k300Dpi, 0.027},
       large_tray(),
       3,
       kVoxelPrintLayers},
      {"j850-hm",
       "Stratasys J850, High Mix, 27 um layers",
       {k600Dpi, k300Dpi, 0.027},
       large_tray(),
       6,
       kVoxelPrintLayers},
      {"j850-hq",
       "Stratasys J850, High Quality, 14 um layers",
       {k600Dpi, k300Dpi, 0.014},
       large_tray(),
       6,
       kVoxelPrintLayers},
      {"j850-hs",
       "Stratasys J850, High Speed, 27 um layers",
       {k600Dpi, k300Dpi, 0.027},
       large_tray(),
       3,
       kVoxelPrintLayers},
      {"paper",
       "The grid of [Luu19, 4]: 600 x 300 dpi, 30 um layers",
       {k600Dpi, k300Dpi, 0.03},
       large_tray(),
       6,
       kVoxelPrintLayers},
  }};
  return profiles;
}

const PrinterProfile* find_printer_profile(std::string_view name) {
  const auto profiles = printer_profiles();
  const auto found = std::find_if(profiles.begin(), profiles.end(), [&](const auto& p) { return p.name == name; });
  return found == profiles.end() ? nullptr : &*found;
}

}  // namespace ccslice
