// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The figures of [Luu19, 4], Tables 1 to 3: an Intel Core i7-7700K, 4 cores of 4.2 GHz; 600 x 300 dpi, 30 um.

#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace ccslice::bench {

/// Table 1: one slice of the coyote, one thread (its caption names none; Table 2's times per slice are a quarter).
struct PaperSlice {
  double full_share = 0;  // Of voxels for which the whole Algorithm 1 was called.
  double contour_s = 0, raster_s = 0, material_s = 0;
};
inline constexpr std::uint64_t kPaperSliceVoxels = 364'768;
inline constexpr PaperSlice kPaperWithoutCoherence = {1, 0.064, 5.62, 50.70};
inline constexpr PaperSlice kPaperWithCoherence = {0.002273, 0.064, 5.62, 9.38};

/// Table 2: four threads.
struct PaperModel {
  std::string_view name;  // Of our sample.
  int control_cells = 0, cells = 0, extraordinary_edges = 0, extraordinary_vertices = 0;
  int columns = 0, rows = 0, layers = 0;
  double million_voxels = 0, total_hours = 0;
  std::uint64_t voxels_a_layer = 0;
  double seconds_a_layer = 0;
  double full_share = 0;
};
inline constexpr int kPaperThreads = 4;
inline constexpr std::array<PaperModel, 5> kPaperModels = {{
    {"coyote", 48, 2832, 177, 8, 1494, 991, 738, 218.87, 1.17, 295'608, 5.71, 0.004398},
    {"engine", 301, 19328, 360, 8, 1090, 547, 688, 138.31, 0.68, 200'902, 3.54, 0.012775},
    {"ring", 512, 512, 0, 0, 1975, 987, 576, 506.77, 1.65, 876'759, 10.31, 0.000755},
    {"bracket", 163, 1304, 76, 7, 3397, 478, 142, 57.12, 0.68, 400'615, 17.08, 0.003586},
    {"grid", 1000, 8000, 5040, 1539, 1335, 357, 866, 156.01, 2.34, 180'022, 9.73, 0.021766},
}};

/// Table 3: what the paper compares itself with, trimmed trivariate splines by Ezair, Dikovsky and Elber (its [11]).
struct PaperPeer {
  std::string_view name;
  int cells = 0;
  std::uint64_t voxels_a_layer = 0;
  double seconds_a_layer = 0;
};
inline constexpr std::array<PaperPeer, 3> kPaperPeers = {{
    {"Chalice [11]", 5, 235'110, 5.75},
    {"Utah teapot [11]", 6, 255'924, 3.14},
    {"Duck [11]", 1, 921'864, 10.4},
}};

}  // namespace ccslice::bench
