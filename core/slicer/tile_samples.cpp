// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which voxels of a node are inverted: the part of MaterialTiles that chooses samples.

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/lanes.h"
#include "core/slicer/material_tiles.h"

namespace ccslice {
namespace {

constexpr std::size_t kSamples = 40;
constexpr std::size_t kFewestSolved = 28;    // Of the samples.
constexpr std::size_t kFeatureSamples = 16;  // More of them, at irregular lines.
constexpr std::size_t kFewestSpread = 12;    // Of the samples: spread over the node, however many it inherits.
constexpr double kFeatureSpacing = 4;        // Voxels.
constexpr std::size_t kCandidates = 92;      // From which they are chosen: spread ones, and as many ends of runs.
constexpr double kMostLeverage = 2;          // Of voxels that are not samples: beyond, a fit guesses.
constexpr std::size_t kMostParts = 8;        // Connected parts of a node.
constexpr double kGoldenRatio = 0.6180339887498949;

/// A tile's diagonals and axes, by coordinate, four at a time, and two that lead nowhere: what a run's first and last
/// voxel count.
constexpr std::size_t kDirections = 14, kDirectionLanes = 4;
constexpr std::array<Lanes, kDirectionLanes> kAlongFirst{{{-1, 0, -1, 0}, {-1, 0, -1, 0}, {-1, 0, 0, 0}, {}}};
constexpr std::array<Lanes, kDirectionLanes> kAlongLast{{{0, 1, 0, 1}, {0, 1, 0, 1}, {0, 1, 0, 0}, {}}};
constexpr std::array<Lanes, kDirectionLanes> kAlongRows{{{-1, -1, 1, 1}, {-1, -1, 1, 1}, {0, 0, -1, 1}, {}}};
constexpr std::array<Lanes, kDirectionLanes> kAlongLayers{{{-1, -1, -1, -1}, {1, 1, 1, 1}, {}, {-1, 1, 0, 0}}};

}  // namespace

bool MaterialTiles::choose_samples(const VoxelBox& box, std::size_t first_run, std::uint64_t voxels) {
  if (!features_collected_) collect_features();
  if (!features_loaded_) load_features();
  frame_ = frame_of(first_run);
  clear_candidates();
  add_feature_candidates(box);
  if (!add_part_candidates(first_run)) return false;
  if (!candidates_.empty()) choose_farthest(chosen_.size() + kFeatureSamples);
  clear_candidates();
  add_corner_candidates(first_run);
  choose_farthest(chosen_.size() + candidates_.size());
  clear_candidates();
  add_spread_candidates(first_run, voxels);
  add_end_candidates(first_run);
  choose_farthest(std::max(kSamples, chosen_.size() + kFewestSpread));
  return chosen_.size() >= kFewestSolved;
}

void MaterialTiles::clear_candidates() {
  candidates_.clear();
  candidate_distances_.clear();
  for (std::vector<float>& coordinate : candidate_places_) coordinate.clear();
}

void MaterialTiles::choose_farthest(std::size_t wanted) {
  for (const std::size_t s : chosen_) move_away_from(pool_[s].voxel);
  while (chosen_.size() < wanted) {
    const auto farthest = std::max_element(candidate_distances_.begin(), candidate_distances_.end());
    if (*farthest <= 0) break;
    const Voxel voxel = candidates_[static_cast<std::size_t>(farthest - candidate_distances_.begin())];
    add_sample(voxel);
    move_away_from(voxel);
  }
}

void MaterialTiles::collect_features() {
  features_collected_ = true;
  const Voxel low{0, 0, first_layer_}, high{grid_.extent.columns, grid_.extent.rows, end_layer_};
  const double spacing = kFeatureSpacing * std::min({grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm});
  irregular_points_.clear();
  field_->append_irregular_points(world_box({low, high}), spacing, irregular_points_);
  features_.clear();
  const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
  for (const Vec3& point : irregular_points_) {
    const Vec3 voxel = (point - grid_.origin_mm).cwiseQuotient(pitch);
    if (voxel.z() < first_layer_ - 1.0 || voxel.z() > end_layer_ + 1.0) continue;
    const auto tile = [&](int a, std::uint32_t size, std::uint32_t count) {
      return static_cast<std::size_t>(std::clamp(std::floor(voxel[a] / size), 0.0, count - 1.0));
    };
    features_.emplace_back(tile(1, tile_size_[1], tile_rows_) * tile_columns_ + tile(0, tile_size_[0], tile_columns_),
                           point);
  }
  std::stable_sort(features_.begin(), features_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
}

void MaterialTiles::load_features() {
  features_loaded_ = true;
  tile_features_.clear();
  const auto begin = std::lower_bound(features_.begin(), features_.end(), tile_,
                                      [](const auto& feature, std::size_t t) { return feature.first < t; });
  for (auto feature = begin; feature != features_.end() && feature->first == tile_; ++feature) {
    if (const std::optional<Voxel> voxel = nearest_inside(feature->second)) tile_features_.push_back(*voxel);
  }
  std::sort(tile_features_.begin(), tile_features_.end());
  tile_features_.erase(std::unique(tile_features_.begin(), tile_features_.end()), tile_features_.end());
}

/// Among the voxel that holds the point and its neighbours.
std::optional<MaterialTiles::Voxel> MaterialTiles::nearest_inside(const Vec3& world) const {
  const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
  const Vec3 at = (world - grid_.origin_mm).cwiseQuotient(pitch);
  std::optional<Voxel> nearest;
  double nearest_distance = std::numeric_limits<double>::infinity();
  for (int n = 0; n < 27; ++n) {
    const Vec3 index = at.array().floor().matrix() + Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if ((index.array() < 0).any()) continue;
    const Voxel voxel{static_cast<std::uint32_t>(index.x()), static_cast<std::uint32_t>(index.y()),
                      static_cast<std::uint32_t>(index.z())};
    const double distance = (centre(voxel) - world).squaredNorm();
    if (distance >= nearest_distance || !is_inside(voxel)) continue;
    nearest = voxel;
    nearest_distance = distance;
  }
  return nearest;
}

/// The tile's runs come by layer, by row, by column.
bool MaterialTiles::is_inside(const Voxel& voxel) const {
  const auto order = [](const Run& run) { return std::array{run.layer, run.row, run.begin}; };
  const std::array key{voxel[2], voxel[1], voxel[0]};
  const std::span<const Run> runs = std::span(runs_).first(tile_runs_);
  const auto after =
      std::upper_bound(runs.begin(), runs.end(), key, [&](const auto& k, const Run& run) { return k < order(run); });
  if (after == runs.begin()) return false;
  const Run& run = *std::prev(after);
  return run.layer == voxel[2] && run.row == voxel[1] && voxel[0] < run.end;
}

void MaterialTiles::add_feature_candidates(const VoxelBox& box) {
  for (const Voxel& voxel : tile_features_) {
    if (box.holds(voxel)) add_candidate(voxel);
  }
}

/// The voxels that lie farthest along the tile's axes and diagonals.
void MaterialTiles::add_corner_candidates(std::size_t first_run) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  std::array<Lanes, kDirectionLanes> best{}, best_run{};
  best.fill(Lanes{kNone, kNone, kNone, kNone});
  const Vec3 scale = frame_.scale;
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    const double first = run.begin * scale.x(), last = (run.end - 1) * scale.x();
    const double y = run.row * scale.y(), z = run.layer * scale.z();
    const Lanes number = Lanes{} + static_cast<double>(r);
    for (std::size_t d = 0; d < kDirectionLanes; ++d) {
      const Lanes score = kAlongFirst[d] * first + kAlongLast[d] * last + kAlongRows[d] * y + kAlongLayers[d] * z;
      const auto better = score > best[d];
      best[d] = better ? score : best[d];
      best_run[d] = better ? number : best_run[d];
    }
  }
  for (std::size_t d = 0; d < kDirections; ++d) {
    const std::size_t group = d / kLanes, lane = d % kLanes;
    const Run& run = runs_[static_cast<std::size_t>(best_run[group][lane])];
    add_candidate({kAlongLast[group][lane] > 0 ? run.end - 1 : run.begin, run.row, run.layer});
  }
}

void MaterialTiles::add_spread_candidates(std::size_t first_run, std::uint64_t voxels) {
  std::size_t run = first_run;
  std::uint64_t passed = 0;  // Voxels of the runs before.
  for (std::size_t k = 0; k < kCandidates; ++k) {
    const double jitter = static_cast<double>(k) * kGoldenRatio - std::floor(static_cast<double>(k) * kGoldenRatio);
    const double share = (static_cast<double>(k) + jitter) / kCandidates;
    const auto target = std::min(voxels - 1, static_cast<std::uint64_t>(share * static_cast<double>(voxels)));
    while (target - passed >= runs_[run].end - runs_[run].begin) {
      passed += runs_[run].end - runs_[run].begin;
      ++run;
    }
    const auto column = static_cast<std::uint32_t>(runs_[run].begin + (target - passed));
    add_candidate({column, runs_[run].row, runs_[run].layer});
  }
}

/// Ends of runs: there a polynomial goes wrong first.
void MaterialTiles::add_end_candidates(std::size_t first_run) {
  const std::size_t runs = runs_.size() - first_run;
  const std::size_t count = std::min(runs, kCandidates);
  for (std::size_t k = 0; k < count; ++k) {
    const Run& run = runs_[first_run + k * runs / count];
    add_candidate({k % 2 ? run.end - 1 : run.begin, run.row, run.layer});
  }
}

/// The first and the last voxel of each connected part, and the middle of its longest run. False if there are too many
/// parts.
bool MaterialTiles::add_part_candidates(std::size_t first_run) {
  const std::size_t parts = parts_.label(std::span(runs_).subspan(first_run));
  if (parts <= 1) return true;
  if (parts > kMostParts) return false;
  part_ends_.assign(parts, {});
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    PartEnds& ends = part_ends_[parts_.of_run(r - first_run)];
    const Run& run = runs_[r];
    const std::uint32_t middle = run.begin + (run.end - run.begin) / 2;
    if (ends.voxels == 0) ends.first = {run.begin, run.row, run.layer};
    ends.last = {run.end - 1, run.row, run.layer};
    if (run.end - run.begin >= ends.longest) ends.middle = {middle, run.row, run.layer};
    ends.longest = std::max(ends.longest, run.end - run.begin);
    ends.voxels += run.end - run.begin;
  }
  for (const PartEnds& ends : part_ends_) {
    for (const Voxel& voxel : {ends.first, ends.middle, ends.last}) add_candidate(voxel);
  }
  return true;
}

void MaterialTiles::add_candidate(const Voxel& voxel) {
  const Eigen::Vector3f place = frame_(to_vec3(voxel)).cast<float>();
  candidates_.push_back(voxel);
  for (std::size_t a = 0; a < 3; ++a) candidate_places_[a].push_back(place[static_cast<Eigen::Index>(a)]);
  candidate_distances_.push_back(std::numeric_limits<float>::infinity());
}

void MaterialTiles::move_away_from(const Voxel& voxel) {
  const Eigen::Vector3f place = frame_(to_vec3(voxel)).cast<float>();
  const float* x = candidate_places_[0].data();
  const float* y = candidate_places_[1].data();
  const float* z = candidate_places_[2].data();
  float* distance = candidate_distances_.data();
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const float dx = x[c] - place.x(), dy = y[c] - place.y(), dz = z[c] - place.z();
    distance[c] = std::min(distance[c], dx * dx + dy * dy + dz * dz);
  }
}

void MaterialTiles::add_sample(const Voxel& voxel) {
  const std::optional<InversionResult> found = field_->invert(centre(voxel), hint_for(voxel));
  if (!found) return;
  max_residual_mm_ = std::max(max_residual_mm_, found->residual_mm);
  field_->mat(found->at, values_);
  chosen_.push_back(pool_.size());
  pool_.push_back({voxel, found->at});
  for (const ChannelTolerance& channel : channels_) pool_values_.push_back(values_[channel.channel]);
}

std::optional<CellParam> MaterialTiles::hint_for(const Voxel& voxel) const {
  double nearest = std::numeric_limits<double>::infinity();
  std::optional<CellParam> hint = first_hint_;
  const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
  for (const std::size_t s : chosen_) {
    const Sample& sample = pool_[s];
    const double distance = (to_vec3(sample.voxel) - to_vec3(voxel)).cwiseProduct(pitch).squaredNorm();
    if (distance >= nearest) continue;
    nearest = distance;
    hint = sample.at;
  }
  return hint;
}

/// Some voxel that isn't a sample lies where the samples say little.
bool MaterialTiles::extrapolates() {
  places_.clear();
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    if (candidate_distances_[c] <= 0) continue;
    places_.emplace_back(candidate_places_[0][c], candidate_places_[1][c], candidate_places_[2][c]);
  }
  return fitter_.largest_leverage(places_) > kMostLeverage;
}

TileFrame MaterialTiles::frame_of(std::size_t first_run) const {
  Voxel low, high;
  low.fill(std::numeric_limits<std::uint32_t>::max());
  high.fill(0);
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    const Voxel begin{run.begin, run.row, run.layer}, last{run.end - 1, run.row, run.layer};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], begin[a]);
      high[a] = std::max(high[a], last[a]);
    }
  }
  return TileFrame::of(to_vec3(low), to_vec3(high));
}

}  // namespace ccslice
