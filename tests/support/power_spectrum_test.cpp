// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/power_spectrum.h"

#include <gtest/gtest.h>

#include <random>

namespace ccslice {
namespace {

TEST(PowerSpectrum, OfWhiteNoiseIsOneEverywhere) {
  VoxelPattern noise{{32, 64, 32}, {0.1, 0.05, 0.1}, std::vector<float>(32 * 64 * 32)};
  std::mt19937 random(5);
  for (float& value : noise.values) value = random() % 10 < 3 ? 1 : 0;
  EXPECT_NEAR(mean_power_below(noise, 3), 1, 0.1);
  for (const SpectrumShell& shell : radial_spectrum(noise, 1)) {
    if (shell.frequencies <= 1000) continue;
    EXPECT_NEAR(shell.mean, 1, 0.15);
  }
}

TEST(PowerSpectrum, OfStripesIsAtTheirFrequency) {
  VoxelPattern stripes{{32, 16, 8}, {0.25, 0.25, 0.25}, {}};
  for (std::size_t i = 0; i < 32 * 16 * 8; ++i) stripes.values.push_back(i % 4 < 2 ? 1 : 0);
  const std::vector<SpectrumShell> shells = radial_spectrum(stripes, 0.25);
  for (std::size_t i = 0; i < shells.size(); ++i) {
    const double total = shells[i].mean * static_cast<double>(shells[i].frequencies);
    EXPECT_NEAR(total, i == 4 ? 4096 : 0, 1e-6) << "shell " << i;  // 1 / (4 * 0.25 mm).
  }
}

TEST(PowerSpectrum, OfPlanesDoesNotSeeWhatIsAcrossThem) {
  VoxelPattern layers{{8, 8, 8}, {1, 1, 1}, {}};
  for (std::size_t i = 0; i < 512; ++i) layers.values.push_back((i + i / 8 + i / 64) % 2 == 0 ? 1 : 0);
  const std::vector<SpectrumShell> shells = planar_spectrum(layers, 0.1);
  EXPECT_NEAR(shells.back().mean * static_cast<double>(shells.back().frequencies), 8 * 64, 1e-6);
}

}  // namespace
}  // namespace ccslice
