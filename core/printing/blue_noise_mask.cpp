// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/blue_noise_mask.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <functional>
#include <list>
#include <mutex>
#include <numeric>
#include <tuple>

#include "core/printing/voxel_hash.h"

namespace ccslice {
namespace {

constexpr double kSigma = 1.5;  // Standard deviation of the Gaussian, in edges of a cube of a voxel's volume.
constexpr double kReach = 3.5;  // Where it ends, in sigmas.
constexpr std::int32_t kPeak = 1 << 24;
constexpr std::int32_t kTieSteps = 1 << 6;  // Energies differ by more than a tie's hash, or tie.
constexpr std::int32_t kBarred = 1 << 30;   // Beyond all energies: the kernel's sum is 53 peaks.
constexpr std::int64_t kBalance = 1 << 18;  // What a set voxel adds to the energy of its whole plane.
constexpr double kFirstShare = 0.1;         // Share of the voxels in the first pattern.
constexpr std::uint32_t kEdge = kMaskEdge;
constexpr std::size_t kRows = std::size_t{kEdge} * kEdge;

/// Set and clear voxels, and which of them is in the tightest cluster or the largest void.
class Pattern {
 public:
  explicit Pattern(const VoxelShape& shape) : energy_(kMaskVoxels), set_(kMaskVoxels), lows_(kRows), highs_(kRows) {
    make_kernel(shape);
    for (std::size_t voxel = 0; voxel < kMaskVoxels; ++voxel) {
      energy_[voxel] = static_cast<std::int32_t>(mix64(voxel) % kTieSteps);
    }
    for (std::size_t row = 0; row < kRows; ++row) find_extremes(row);
    for (std::uint32_t z = 0; z < kEdge; ++z) find_extremes_of_plane(z);
  }

  void set(std::size_t voxel) { change<1>(voxel); }
  void clear(std::size_t voxel) { change<-1>(voxel); }

  std::size_t largest_void() const {
    const std::size_t z = best_plane(plane_lows_, std::less<>());
    const auto lows = lows_.begin() + static_cast<std::ptrdiff_t>(z * kEdge);
    const auto row = std::min_element(lows, lows + kEdge) - lows_.begin();
    return find(static_cast<std::size_t>(row), lows_[static_cast<std::size_t>(row)]);
  }

  std::size_t tightest_cluster() const {
    const std::size_t z = best_plane(plane_highs_, std::greater<>());
    const auto highs = highs_.begin() + static_cast<std::ptrdiff_t>(z * kEdge);
    const auto row = std::max_element(highs, highs + kEdge) - highs_.begin();
    return find(static_cast<std::size_t>(row), highs_[static_cast<std::size_t>(row)] + kBarred);
  }

 private:
  struct KernelRow {
    std::uint32_t dy, dz;
    std::array<std::int32_t, 2 * kEdge> values;  // Twice the period: from kEdge - x on, those round x.
  };

  static double wrapped(std::uint32_t d) { return d <= kEdge / 2 ? d : static_cast<double>(kEdge) - d; }

  void make_kernel(const VoxelShape& shape) {
    for (std::uint32_t dz = 0; dz < kEdge; ++dz) {
      for (std::uint32_t dy = 0; dy < kEdge; ++dy) {
        KernelRow row{dy, dz, {}};
        bool any = false;
        for (std::uint32_t dx = 0; dx < kEdge; ++dx) {
          const double x = wrapped(dx) * shape.x, y = wrapped(dy) * shape.y, z = wrapped(dz) * shape.z;
          const double square = (x * x + y * y + z * z) / (kSigma * kSigma);
          if (square > kReach * kReach) continue;
          const auto steps = static_cast<std::int32_t>(std::lround(std::exp(-0.5 * square) * kPeak / kTieSteps));
          row.values[dx] = row.values[dx + kEdge] = steps * kTieSteps;
          any = true;
        }
        if (any) kernel_.push_back(row);
      }
    }
  }

  /// Each voxel's energy is the sum of the kernel over the set voxels around it, so that one voxel more or less adds or
  /// takes off one kernel. Rows that it doesn't reach keep their extremes.
  template <std::int32_t kSign>
  void change(std::size_t voxel) {
    const std::uint32_t x = voxel % kEdge, y = voxel / kEdge % kEdge, z = static_cast<std::uint32_t>(voxel / kRows);
    set_[voxel] = kSign > 0 ? kBarred : 0;
    counts_[z] += kSign;
    std::uint64_t planes = 0;
    for (const KernelRow& kernel : kernel_) {
      const std::uint32_t to_z = (z + kernel.dz) % kEdge;
      const std::size_t row = std::size_t{to_z} * kEdge + (y + kernel.dy) % kEdge;
      const std::int32_t* values = &kernel.values[kEdge - x];
      std::int32_t* energy = &energy_[row * kEdge];
      for (std::uint32_t i = 0; i < kEdge; ++i) energy[i] += kSign * values[i];
      find_extremes(row);
      planes |= std::uint64_t{1} << to_z;
    }
    for (; planes != 0; planes &= planes - 1)
      find_extremes_of_plane(static_cast<std::uint32_t>(std::countr_zero(planes)));
  }

  /// Clear voxels only count for voids, set ones for clusters: kBarred is beyond all energies, so that with it set
  /// voxels come last among the low ones, and first among the high ones.
  void find_extremes(std::size_t row) {
    const std::int32_t* energy = &energy_[row * kEdge];
    const std::int32_t* set = &set_[row * kEdge];
    std::int32_t low = INT32_MAX, high = INT32_MIN;
    for (std::uint32_t i = 0; i < kEdge; ++i) {
      const std::int32_t barred = energy[i] + set[i];
      low = std::min(low, barred);
      high = std::max(high, barred);
    }
    lows_[row] = low;
    highs_[row] = high - kBarred;
  }

  void find_extremes_of_plane(std::uint32_t z) {
    const auto lows = lows_.begin() + z * kEdge, highs = highs_.begin() + z * kEdge;
    plane_lows_[z] = *std::min_element(lows, lows + kEdge);
    plane_highs_[z] = *std::max_element(highs, highs + kEdge);
  }

  /// The plane whose energy, with what balances the planes, comes first.
  template <typename Before>
  std::size_t best_plane(const std::array<std::int32_t, kEdge>& extremes, const Before& before) const {
    std::array<std::int64_t, kEdge> balanced;
    for (std::size_t z = 0; z < kEdge; ++z) balanced[z] = extremes[z] + kBalance * counts_[z];
    return static_cast<std::size_t>(std::min_element(balanced.begin(), balanced.end(), before) - balanced.begin());
  }

  /// The first voxel of a row with this energy, barred or not.
  std::size_t find(std::size_t row, std::int32_t energy) const {
    std::size_t voxel = row * kEdge;
    while (energy_[voxel] + set_[voxel] != energy) ++voxel;
    return voxel;
  }

  std::vector<std::int32_t> energy_;                              // By z, y, x. Of set voxels, and of ties.
  std::vector<std::int32_t> set_;                                 // kBarred or 0.
  std::vector<std::int32_t> lows_, highs_;                        // By row.
  std::array<std::int32_t, kEdge> plane_lows_{}, plane_highs_{};  // By plane of rows.
  std::array<std::int64_t, kEdge> counts_{};                      // Set voxels of each plane.
  std::vector<KernelRow> kernel_;
};

std::vector<std::size_t> first_voxels() {
  std::vector<std::size_t> voxels(kMaskVoxels);
  std::iota(voxels.begin(), voxels.end(), std::size_t{0});
  std::sort(voxels.begin(), voxels.end(), [](std::size_t a, std::size_t b) { return mix64(~a) < mix64(~b); });
  voxels.resize(static_cast<std::size_t>(kFirstShare * kMaskVoxels));
  return voxels;
}

/// Moves voxels from clusters to voids until the next one would go back to where it was, or it is even enough.
void spread(Pattern& pattern, std::size_t voxels, PeriodicPoll& poll) {
  for (std::size_t move = 0; move < 2 * voxels; ++move) {
    poll();
    const std::size_t from = pattern.tightest_cluster();
    pattern.clear(from);
    const std::size_t to = pattern.largest_void();
    pattern.set(to);
    if (from == to) return;
  }
}

/// The first pattern's voxels are ranked backwards, as the tightest cluster is taken away, and all others as the
/// largest void is filled. Ulichney has a third phase, beyond a half, which fills the tightest cluster of clear voxels.
/// That is the largest void: the energies that set voxels and clear ones would have add up to the kernel's sum
/// everywhere.
std::vector<std::uint32_t> rank_voxels(const VoxelShape& shape, const CancellationToken& cancel) {
  PeriodicPoll poll(cancel, 256);
  Pattern pattern(shape);
  const std::vector<std::size_t> first = first_voxels();
  for (const std::size_t voxel : first) {
    poll();
    pattern.set(voxel);
  }
  spread(pattern, first.size(), poll);
  std::vector<std::uint32_t> ranks(kMaskVoxels);
  std::vector<std::size_t> by_rank(first.size());
  Pattern shrinking = pattern;
  for (std::size_t rank = first.size(); rank-- > 0;) {
    poll();
    by_rank[rank] = shrinking.tightest_cluster();
    shrinking.clear(by_rank[rank]);
  }
  for (std::size_t rank = 0; rank < first.size(); ++rank) ranks[by_rank[rank]] = static_cast<std::uint32_t>(rank);
  for (std::size_t rank = first.size(); rank < kMaskVoxels; ++rank) {
    poll();
    const std::size_t voxel = pattern.largest_void();
    ranks[voxel] = static_cast<std::uint32_t>(rank);
    pattern.set(voxel);
  }
  return ranks;
}

class MaskCache {
 public:
  static MaskCache& instance() {
    static MaskCache cache;
    return cache;
  }

  bool has(const VoxelShape& shape) {
    std::lock_guard lock(mutex_);
    const auto entry = find_locked(shape);
    return entry != entries_.end() && entry->mask;
  }

  std::shared_ptr<const BlueNoiseMask> get(const VoxelShape& shape, const CancellationToken& cancel) {
    std::unique_lock lock(mutex_);
    for (auto entry = find_locked(shape); entry != entries_.end(); entry = find_locked(shape)) {
      if (entry->mask) {
        entries_.splice(entries_.begin(), entries_, entry);
        return entry->mask;
      }
      made_.wait_for(lock, kPollInterval);
      lock.unlock();
      cancel.throw_if_cancelled();
      lock.lock();
    }
    entries_.push_front({shape, nullptr});
    lock.unlock();
    return make(shape, cancel);
  }

 private:
  struct Entry {
    VoxelShape shape;
    std::shared_ptr<const BlueNoiseMask> mask;  // Null while it is being made.
  };
  using Entries = std::list<Entry>;

  static constexpr std::chrono::milliseconds kPollInterval{10};

  /// REQUIRES: an entry without a mask, which this thread has put there. If it fails, another one's turn comes.
  std::shared_ptr<const BlueNoiseMask> make(const VoxelShape& shape, const CancellationToken& cancel) {
    std::shared_ptr<const BlueNoiseMask> mask;
    std::exception_ptr error;
    try {
      mask = std::make_shared<const BlueNoiseMask>(shape, cancel);
    } catch (...) {
      error = std::current_exception();
    }
    {
      std::lock_guard lock(mutex_);
      const auto entry = find_locked(shape);
      if (mask) {
        entry->mask = mask;
        trim_locked();
      } else {
        entries_.erase(entry);
      }
    }
    made_.notify_all();
    if (error) std::rethrow_exception(error);
    return mask;
  }

  Entries::iterator find_locked(const VoxelShape& shape) {
    return std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return std::tie(entry.shape.x, entry.shape.y, entry.shape.z) == std::tie(shape.x, shape.y, shape.z);
    });
  }

  void trim_locked() {
    std::size_t masks = 0;
    std::erase_if(entries_, [&](const Entry& entry) { return entry.mask && ++masks > kMaskCacheSize; });
  }

  std::mutex mutex_;
  std::condition_variable made_;
  Entries entries_;  // The one used last in front.
};

double rounded_ratio(double log_edge) {
  constexpr double kSteps = 64, kMost = 3;  // 2^3 = 8.
  return std::exp2(std::clamp(std::round(log_edge * kSteps) / kSteps, -kMost, kMost));
}

}  // namespace

VoxelShape voxel_shape(double pitch_x_mm, double pitch_y_mm, double pitch_z_mm) {
  const double x = std::log2(pitch_x_mm), y = std::log2(pitch_y_mm), z = std::log2(pitch_z_mm);
  const double edge = (x + y + z) / 3;
  // Setting a voxel changes the energies of all rows that the Gaussian reaches, pi (kReach kSigma)^2 / (y z) of them,
  // and x y z = 1: so the edge along x bounds the time. Longer voxels take the mask of less slender ones.
  constexpr double kLongestRow = 1;  // 2^1 = 2: 170 rows.
  const double slenderness = std::min(1.0, kLongestRow / std::max(x - edge, kLongestRow));
  return {rounded_ratio(slenderness * (x - edge)), rounded_ratio(slenderness * (y - edge)),
          rounded_ratio(slenderness * (z - edge))};
}

BlueNoiseMask::BlueNoiseMask(const VoxelShape& shape, const CancellationToken& cancel) {
  thresholds_.reserve(kMaskVoxels);
  for (const std::uint32_t rank : rank_voxels(shape, cancel)) {
    thresholds_.push_back((static_cast<float>(rank) + 0.5f) / static_cast<float>(kMaskVoxels));
  }
}

std::shared_ptr<const BlueNoiseMask> shared_mask(const VoxelShape& shape, const CancellationToken& cancel) {
  return MaskCache::instance().get(shape, cancel);
}

bool has_shared_mask(const VoxelShape& shape) { return MaskCache::instance().has(shape); }

}  // namespace ccslice
