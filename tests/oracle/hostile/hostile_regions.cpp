// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/region_values.h"
#include "core/mesh_import/mid_nodes.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_text.h"
#include "tests/support/cell_regions.h"

namespace ccslice::oracle {
namespace {

constexpr double kShareWithRegions = 0.4;       // Some are refused: about a third remains.
constexpr std::size_t kMostCellsAtRandom = 12;  // Of more cells, some region nearly always closes round others.
constexpr std::uint64_t kCellStream = 7, kJumpStream = 8;  // Of random numbers.

enum RegionKind : std::size_t { kBands, kAboutCentres, kOneCell, kEachCell, kAllInOne };
constexpr std::array kRegionKinds = {"bands", "about centres", "one cell", "each cell", "all in one"};

/// Which region a cell is of, by the mean of its corners and by its number.
class RegionDraw {
 public:
  RegionDraw(HostileRandom& random, const ControlMesh& mesh) : random_(random), cells_(mesh.cell_count()) {
    for (const Vec3& p : mesh.positions) box_.extend(p);
    constexpr std::array weights = {0.35, 0.3, 0.12, 0.18, 0.05};
    kind_ = random.weighted(weights);
    if (kind_ == kEachCell && cells_ > kMostCellsAtRandom) kind_ = kAboutCentres;
    if (kind_ == kAllInOne) count_ = 1;
    if (kind_ != kOneCell && kind_ != kAllInOne) count_ = random.pick(2, 5);
    axis_ = random.pick(0, 2);
    only_ = random.bits() % cells_;
    for (int r = 0; r < count_; ++r) {
      centres_.push_back(box_.min() + box_.sizes().cwiseProduct(Vec3(random.unit(), random.unit(), random.unit())));
    }
  }

  const char* name() const { return kRegionKinds[kind_]; }
  int count() const { return count_; }

  int next(const Vec3& middle) {
    const std::size_t cell = next_cell_++;
    switch (kind_) {
      case kBands: return band_of(middle);
      case kAboutCentres: return nearest_centre(middle);
      case kOneCell: return cell == only_ ? 1 : 0;
      case kEachCell: return static_cast<int>(random_.bits() % static_cast<std::uint64_t>(count_));
      default: return 0;
    }
  }

 private:
  int band_of(const Vec3& middle) const {
    const double share = (middle[axis_] - box_.min()[axis_]) / std::max(box_.sizes()[axis_], 1e-300);
    return std::clamp(static_cast<int>(share * count_), 0, count_ - 1);
  }

  int nearest_centre(const Vec3& middle) const {
    const auto nearest = std::ranges::min_element(centres_, {}, [&](const Vec3& c) { return (c - middle).norm(); });
    return static_cast<int>(nearest - centres_.begin());
  }

  HostileRandom& random_;
  const std::size_t cells_;
  Box3 box_;
  std::size_t kind_ = 0, only_ = 0, next_cell_ = 0;
  int count_ = 2, axis_ = 0;
  std::vector<Vec3> centres_;
};

/// How a channel changes from region to region.
struct Jump {
  bool by_pair = false;  // Each vertex and region its own, instead of each region.
  std::uint64_t seed = 0;
  double scale = 0;

  double of(std::uint32_t vertex, std::uint8_t region) const {
    if (scale == 0) return 0;
    HostileRandom random(seed + region + (by_pair ? (std::uint64_t{vertex} + 1) << 8 : 0), 0);
    return scale * random.between(-1, 1);
  }
};

/// Of one channel: as large as its range, or far larger or smaller. None: it is continuous.
Jump draw_jump(HostileRandom& random, const ControlMesh& mesh, std::size_t channel) {
  Jump jump;
  const bool jumps = random.chance(0.7);
  jump.by_pair = random.chance(0.25);
  jump.seed = random.bits();
  const double share = random.chance(0.5) ? 1 : random.log_between(1e-3, 100);
  if (!jumps) return jump;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const double value = mesh.channel_values[v * mesh.channel_count() + channel];
    low = std::min(low, value);
    high = std::max(high, value);
  }
  jump.scale = share * (high > low ? high - low : 1);
  return jump;
}

/// The mesh with these channels, whose values in its regions are those it has, passed through `change`.
template <typename Change>
ControlMesh with_changed_values(const ControlMesh& mesh, const std::vector<std::string>& names, const Change& change) {
  ControlMesh plain = mesh;
  clear_region_values(plain);
  return with_jumping_channels(std::move(plain), names, [&](std::uint32_t vertex, std::uint8_t region) {
    const std::span<const float> values = values_in_region(mesh, vertex, region);
    std::vector<float> changed(values.begin(), values.end());
    change(vertex, region, changed);
    return changed;
  });
}

/// A channel that jumps is no longer linear in the position.
void make_channels_jump(HostileRandom& random, HostileMesh& mesh) {
  std::vector<Jump> jumps;
  mesh.description += ", jumping";
  for (std::size_t c = 0; c < mesh.mesh.channel_count(); ++c) {
    jumps.push_back(draw_jump(random, mesh.mesh, c));
    if (jumps.back().scale == 0) continue;
    mesh.linear[c].reset();
    mesh.description += " " + mesh.mesh.channel_names[c] + " by " + number(jumps.back().scale);
    if (jumps.back().by_pair) mesh.description += " a vertex";
  }
  mesh.mesh = with_changed_values(mesh.mesh, mesh.mesh.channel_names,
                                  [&](std::uint32_t vertex, std::uint8_t region, std::vector<float>& values) {
                                    for (std::size_t c = 0; c < values.size(); ++c) {
                                      values[c] += static_cast<float>(jumps[c].of(vertex, region));
                                    }
                                  });
}

}  // namespace

void add_hostile_regions(std::uint64_t seed, HostileMesh& mesh) {
  HostileRandom random(seed, kCellStream), jump_random(seed, kJumpStream);
  if (!random.chance(kShareWithRegions) || !mesh.mesh.cell_region_names.empty()) return;
  if (mesh.mesh.cell_count() == 0) return;
  RegionDraw draw(random, mesh.mesh);
  const int names = draw.count() + (random.chance(0.15) ? 1 : 0);  // Maybe one without cells.
  mesh.mesh = with_regions(std::move(mesh.mesh), names, [&](const Vec3& middle) { return draw.next(middle); });
  mesh.description += ", " + std::to_string(names) + " regions, " + draw.name();
  if (jump_random.chance(0.5)) make_channels_jump(jump_random, mesh);
}

ControlMesh with_region_channel(const ControlMesh& mesh) {
  std::vector<std::string> names = mesh.channel_names;
  names.emplace_back("cell region");
  ControlMesh marked = with_changed_values(
      mesh, names, [](std::uint32_t, std::uint8_t region, std::vector<float>& values) { values.push_back(region); });
  // Where regions meet, nodes have the means of their corners' numbers; elsewhere these are alike.
  const MidNodeCorners corners(marked);
  std::vector<float> values;
  const std::size_t channels = mesh.channel_count();
  for (std::size_t node = 0; node < mesh.mid_nodes.positions.size(); ++node) {
    const auto begin = mesh.mid_nodes.values.begin() + static_cast<std::ptrdiff_t>(node * channels);
    values.insert(values.end(), begin, begin + static_cast<std::ptrdiff_t>(channels));
    values.push_back(marked.channel_values[corners[node].front() * (channels + 1) + channels]);
  }
  marked.mid_nodes.values = std::move(values);
  return marked;
}

}  // namespace ccslice::oracle
