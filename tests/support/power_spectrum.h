// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Power spectra of halftones over physical frequency.
//
// P(k) = |sum_v (b(v) - mean) exp(-2 pi i k v / n)|^2 / N of a periodic block of N voxels; divided by mean (1 - mean)
// it is 1 on average, and 1 everywhere for white noise. Frequencies are k / (n pitch), cycles/mm, so that shells are
// spheres in space, not in voxels.

#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace ccslice {

/// Voxels of a block by z, y, x: 1 where a material is, else 0. Edges are powers of two.
struct VoxelPattern {
  std::array<std::size_t, 3> size;  // Along x, y, z.
  std::array<double, 3> pitch_mm;
  std::vector<float> values;
};

/// A mean over the frequencies f with index * width <= |f| < (index + 1) * width, 0 left out.
struct SpectrumShell {
  double mean = 0;  // Of P / (mean (1 - mean)).
  std::size_t frequencies = 0;
};

/// REQUIRES: both materials and others there.
std::vector<SpectrumShell> radial_spectrum(const VoxelPattern& pattern, double shell_width);

/// Likewise over the frequencies |f| < limit, and those of its planes z = const, each taken for itself, on average.
double mean_power_below(const VoxelPattern& pattern, double limit);
std::vector<SpectrumShell> planar_spectrum(const VoxelPattern& pattern, double shell_width);

}  // namespace ccslice
