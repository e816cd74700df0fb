// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What hostile meshes and jobs are drawn from. The same everywhere for the same seed.

#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <span>

#include "core/base/types.h"

namespace ccslice::oracle {

class HostileRandom {
 public:
  /// `stream`: draws of one stream don't move those of another.
  HostileRandom(std::uint64_t seed, std::uint64_t stream) : engine_((seed << 8) + stream) { engine_.discard(16); }

  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  double log_between(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  bool chance(double probability) { return unit() < probability; }
  std::uint64_t bits() { return engine_(); }
  /// Of least, ..., most.
  int pick(int least, int most) {
    return least + static_cast<int>(engine_() % static_cast<std::uint64_t>(most - least + 1));
  }
  /// The index of one of so many, as likely as its weight says.
  std::size_t weighted(std::span<const double> weights) {
    double left = 0;
    for (const double weight : weights) left += weight;
    left *= unit();
    std::size_t i = 0;
    while (i + 1 < weights.size() && left >= weights[i]) left -= weights[i++];
    return i;
  }
  Vec3 in_cube(double half) { return {between(-half, half), between(-half, half), between(-half, half)}; }
  Mat3 rotation() {
    Eigen::Quaterniond q(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1));
    return q.normalized().toRotationMatrix();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace ccslice::oracle
