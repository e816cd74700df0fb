// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/region_colours.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace ccslice {
namespace {

constexpr std::array<std::uint32_t, 8> kOkabeIto = {0xe69f00ff, 0x56b4e9ff, 0x009e73ff, 0xf0e442ff,
                                                    0x0072b2ff, 0xd55e00ff, 0xcc79a7ff, 0x808080ff};

/// `turn` in [0,1): a fully saturated hue; `light` in (0,1].
std::uint32_t hue(double turn, double light) {
  std::uint32_t colour = 0;
  for (const double offset : {0.0, 2.0 / 3, 1.0 / 3}) {
    const double along = 6 * std::fmod(turn + offset, 1.0);
    const double share = std::clamp(std::abs(along - 3) - 1, 0.0, 1.0);
    colour = colour << 8 | static_cast<std::uint32_t>(std::lround(255 * light * share));
  }
  return colour << 8 | 0xff;
}

}  // namespace

std::vector<std::uint32_t> region_palette(std::size_t regions) {
  constexpr double kGoldenTurn = 0.6180339887498949;
  constexpr std::array kLights = {1.0, 0.6, 0.8};
  std::vector<std::uint32_t> palette{0};
  for (std::size_t i = 0; i < regions; ++i) {
    const double turn = std::fmod(kGoldenTurn * static_cast<double>(i), 1.0);
    palette.push_back(i < kOkabeIto.size() ? kOkabeIto[i] : hue(turn, kLights[i % kLights.size()]));
  }
  return palette;
}

}  // namespace ccslice
