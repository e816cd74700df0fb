// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/power_spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

namespace ccslice {
namespace {

using Complex = std::complex<double>;

/// Radix 2, in place.
void transform(std::vector<Complex>& line) {
  const std::size_t n = line.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; (j & bit) != 0; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(line[i], line[j]);
  }
  for (std::size_t half = 1; half < n; half *= 2) {
    for (std::size_t k = 0; k < half; ++k) {
      const Complex turn = std::polar(1.0, -std::numbers::pi * static_cast<double>(k) / static_cast<double>(half));
      for (std::size_t i = k; i < n; i += 2 * half) {
        const Complex odd = line[i + half] * turn;
        line[i + half] = line[i] - odd;
        line[i] += odd;
      }
    }
  }
}

void transform_axis(std::vector<Complex>& block, const std::array<std::size_t, 3>& size, std::size_t axis) {
  std::size_t stride = 1;
  for (std::size_t a = 0; a < axis; ++a) stride *= size[a];
  std::vector<Complex> line(size[axis]);
  for (std::size_t first = 0; first < block.size(); ++first) {
    if (first / stride % size[axis] != 0) continue;
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = block[first + i * stride];
    transform(line);
    for (std::size_t i = 0; i < line.size(); ++i) block[first + i * stride] = line[i];
  }
}

double frequency(std::size_t index, std::size_t size, double pitch_mm) {
  const double signed_index =
      index <= size / 2 ? static_cast<double>(index) : static_cast<double>(index) - static_cast<double>(size);
  return signed_index / (static_cast<double>(size) * pitch_mm);
}

/// Calls visit(|f|, P / (mean (1 - mean))) for every frequency but 0.
template <typename Visit>
void for_each_frequency(const VoxelPattern& pattern, const Visit& visit) {
  const double count = static_cast<double>(pattern.values.size());
  const double mean = std::accumulate(pattern.values.begin(), pattern.values.end(), 0.0) / count;
  std::vector<Complex> block(pattern.values.begin(), pattern.values.end());
  for (Complex& value : block) value -= mean;
  for (std::size_t axis = 0; axis < 3; ++axis) transform_axis(block, pattern.size, axis);
  const auto [nx, ny, nz] = pattern.size;
  for (std::size_t i = 1; i < block.size(); ++i) {
    const double f =
        std::hypot(frequency(i % nx, nx, pattern.pitch_mm[0]), frequency(i / nx % ny, ny, pattern.pitch_mm[1]),
                   frequency(i / nx / ny, nz, pattern.pitch_mm[2]));
    visit(f, std::norm(block[i]) / count / (mean * (1 - mean)));
  }
}

/// Sums that become means.
class Shells {
 public:
  explicit Shells(double width) : width_(width) {}
  void add(double f, double power) {
    const auto shell = static_cast<std::size_t>(f / width_);
    if (shell >= shells_.size()) shells_.resize(shell + 1);
    shells_[shell].mean += power;
    ++shells_[shell].frequencies;
  }
  std::vector<SpectrumShell> take() {
    for (SpectrumShell& shell : shells_) {
      shell.mean /= static_cast<double>(std::max<std::size_t>(shell.frequencies, 1));
    }
    return std::move(shells_);
  }

 private:
  double width_;
  std::vector<SpectrumShell> shells_;
};

}  // namespace

std::vector<SpectrumShell> radial_spectrum(const VoxelPattern& pattern, double shell_width) {
  Shells shells(shell_width);
  for_each_frequency(pattern, [&](double f, double power) { shells.add(f, power); });
  return shells.take();
}

double mean_power_below(const VoxelPattern& pattern, double limit) {
  double sum = 0;
  std::size_t frequencies = 0;
  for_each_frequency(pattern, [&](double f, double power) {
    if (f >= limit) return;
    sum += power;
    ++frequencies;
  });
  return sum / static_cast<double>(frequencies);
}

std::vector<SpectrumShell> planar_spectrum(const VoxelPattern& pattern, double shell_width) {
  const std::size_t plane_voxels = pattern.size[0] * pattern.size[1];
  Shells shells(shell_width);
  for (std::size_t z = 0; z < pattern.size[2]; ++z) {
    const auto begin = pattern.values.begin() + static_cast<std::ptrdiff_t>(z * plane_voxels);
    const VoxelPattern plane{{pattern.size[0], pattern.size[1], 1},
                             pattern.pitch_mm,
                             {begin, begin + static_cast<std::ptrdiff_t>(plane_voxels)}};
    for_each_frequency(plane, [&](double f, double power) { shells.add(f, power); });
  }
  return shells.take();
}

}  // namespace ccslice
