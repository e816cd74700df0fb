// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ccslice {
namespace {

constexpr double kTileMm = 2.8;             // Tiles of whole jobs: at most this long each way, powers of two of voxels.
constexpr std::uint32_t kLargestTile = 64;  // Voxels.
constexpr std::size_t kSamples = 40;
constexpr std::size_t kFeatureSamples = 16;  // More of them, at irregular lines.
constexpr std::size_t kFewestSpread = 12;    // Of the samples: spread over the node, however many it inherits.
constexpr double kFeatureSpacing = 4;        // Voxels.
constexpr std::size_t kCandidates = 92;      // From which they are chosen: spread ones, and as many ends of runs.
constexpr double kMostLeverage = 2;          // Of voxels that are not samples: beyond, a fit guesses.
constexpr std::size_t kMostParts = 8;        // Connected parts of a node.
constexpr double kGoldenRatio = 0.6180339887498949;
constexpr std::size_t kFewestSolved = 28;      // Of the samples.
constexpr std::uint64_t kSmallestTile = 128;   // Tiles of fewer voxels are inverted voxel by voxel.
constexpr double kShareOfTolerance = 0.125;    // What leave-one-out errors may take of it.
constexpr std::uint32_t kVoxelsPerPoll = 256;  // Some hundred microseconds of inversion.

std::uint32_t tile_voxels(double pitch_mm) {
  std::uint32_t size = 1;
  while (size < kLargestTile && 2 * size * pitch_mm <= kTileMm) size *= 2;
  return size;
}

std::uint32_t tiles_over(std::uint32_t voxels, std::uint32_t size) { return (voxels + size - 1) / size; }

template <typename Array>
Vec3 to_vec3(const Array& voxel) {
  return {static_cast<double>(voxel[0]), static_cast<double>(voxel[1]), static_cast<double>(voxel[2])};
}

}  // namespace

struct MaterialTiles::PaintJob {
  std::uint32_t layer;
  LayerLattice lattice;
  double z_mm;
  std::span<ContonePlane> planes;
  std::vector<std::size_t> polynomial_of_plane;  // Which of a fit's polynomials each plane shows.
  LayerStats& stats;
  const CancellationToken& cancel;
};

MaterialTiles::MaterialTiles(MaterialField& field, const Grid& grid, std::vector<ChannelTolerance> channels)
    : field_(&field),
      grid_(grid),
      channels_(std::move(channels)),
      tile_size_{tile_voxels(grid.pitch.x_mm), tile_voxels(grid.pitch.y_mm), kSlabLayers},
      tile_columns_(tiles_over(grid.extent.columns, tile_size_[0])),
      tile_rows_(tiles_over(grid.extent.rows, tile_size_[1])),
      buckets_(tile_columns_),
      values_(field.channel_count()) {}

void MaterialTiles::solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers,
                          const CancellationToken& cancel) {
  first_layer_ = first_layer;
  end_layer_ = first_layer + static_cast<std::uint32_t>(layers.size());
  tiles_.assign(std::size_t{tile_columns_} * tile_rows_, Node{});
  children_.clear();
  fits_.clear();
  polynomials_.clear();
  hints_.clear();
  max_residual_mm_ = 0;
  cursors_.assign(layers.size(), 0);
  collect_features();
  tile_hints_.assign(tile_columns_, std::nullopt);
  for (std::uint32_t row = 0; row < tile_rows_; ++row) {
    bucket_row(row, layers);
    first_hint_.reset();
    for (std::uint32_t column = 0; column < tile_columns_; ++column) {
      if (buckets_[column].empty()) continue;
      cancel.throw_if_cancelled();
      runs_.swap(buckets_[column]);
      pool_.clear();
      pool_values_.clear();
      if (tile_hints_[column]) first_hint_ = tile_hints_[column];
      load_features(std::size_t{tile_columns_} * row + column);
      tiles_[std::size_t{tile_columns_} * row + column] = build(tile_box(column, row), 0);
      if (!pool_.empty()) tile_hints_[column] = first_hint_ = pool_.back().at;
    }
  }
}

MaterialTiles::VoxelBox MaterialTiles::tile_box(std::uint32_t column, std::uint32_t row) const {
  const Voxel low{column * tile_size_[0], row * tile_size_[1], first_layer_};
  return {low, {low[0] + tile_size_[0], low[1] + tile_size_[1], first_layer_ + kSlabLayers}};
}

void MaterialTiles::bucket_row(std::uint32_t tile_row, std::span<const std::span<const Span>> layers) {
  for (std::vector<Run>& bucket : buckets_) bucket.clear();
  const std::uint32_t end_row = (tile_row + 1) * tile_size_[1];
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const std::uint32_t layer = first_layer_ + static_cast<std::uint32_t>(l);
    std::size_t& cursor = cursors_[l];
    for (; cursor < layers[l].size() && layers[l][cursor].y < end_row; ++cursor) {
      const Span& span = layers[l][cursor];
      for (std::uint32_t column = span.begin / tile_size_[0]; column * tile_size_[0] < span.end; ++column) {
        const std::uint32_t begin = std::max(span.begin, column * tile_size_[0]);
        const std::uint32_t end = std::min(span.end, (column + 1) * tile_size_[0]);
        buckets_[column].push_back({layer, span.y, begin, end});
      }
    }
  }
}

MaterialTiles::Node MaterialTiles::build(const VoxelBox& box, std::size_t first_run) {
  if (first_run == runs_.size()) return {};
  std::uint64_t voxels = 0;
  for (std::size_t r = first_run; r < runs_.size(); ++r) voxels += runs_[r].end - runs_[r].begin;
  const std::uint8_t axes = voxels >= kSmallestTile ? axes_to_halve(box) : std::uint8_t{0};
  if (axes != 0) {
    if (!field_->is_ambiguous(world_box(box)) && choose_samples(box, first_run, voxels)) {
      if (const std::optional<Node> node = fit()) return *node;
    }
    return build_split(box, axes, first_run);
  }
  const Run& run = runs_[first_run];
  hints_.push_back(hint_for({run.begin, run.row, run.layer}));
  return {Node::Kind::kExact, 0, static_cast<std::uint32_t>(hints_.size() - 1)};
}

std::uint8_t MaterialTiles::axes_to_halve(const VoxelBox& box) const {
  const std::array<double, 3> pitch{grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm};
  std::array<double, 3> length{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::uint32_t voxels = box.high[a] - box.low[a];
    if (voxels > 1) length[a] = voxels * pitch[a];
  }
  const double longest = *std::max_element(length.begin(), length.end());
  std::uint8_t axes = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (length[a] > 0.6 * longest) axes = static_cast<std::uint8_t>(axes | 1u << a);
  }
  return axes;
}

MaterialTiles::Node MaterialTiles::build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run) {
  Node node{Node::Kind::kSplit, axes, static_cast<std::uint32_t>(children_.size())};
  children_.resize(children_.size() + 8);
  const std::size_t end_run = runs_.size();
  for (std::uint32_t child = 0; child < 8; ++child) {
    if (child & ~std::uint32_t{axes}) continue;
    VoxelBox part = box;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(axes >> a & 1)) continue;
      const std::uint32_t middle = (box.low[a] + box.high[a]) / 2;
      (child >> a & 1 ? part.low : part.high)[a] = middle;
    }
    for (std::size_t r = first_run; r < end_run; ++r) {
      const Run run = runs_[r];
      if (run.layer < part.low[2] || run.layer >= part.high[2] || run.row < part.low[1] || run.row >= part.high[1]) {
        continue;
      }
      const std::uint32_t begin = std::max(run.begin, part.low[0]), end = std::min(run.end, part.high[0]);
      if (begin < end) runs_.push_back({run.layer, run.row, begin, end});
    }
    const Node built = build(part, end_run);
    children_[node.index + child] = built;
    runs_.resize(end_run);
  }
  return node;
}

bool MaterialTiles::choose_samples(const VoxelBox& box, std::size_t first_run, std::uint64_t voxels) {
  chosen_.clear();
  for (std::size_t s = 0; s < pool_.size(); ++s) {
    if (box.holds(pool_[s].voxel)) chosen_.push_back(s);
  }
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

/// REQUIRES: runs_ holds the tile's.
void MaterialTiles::load_features(std::size_t tile) {
  tile_features_.clear();
  const auto begin = std::lower_bound(features_.begin(), features_.end(), tile,
                                      [](const auto& feature, std::size_t t) { return feature.first < t; });
  for (auto feature = begin; feature != features_.end() && feature->first == tile; ++feature) {
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
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), key, [&](const auto& k, const Run& run) { return k < order(run); });
  if (after == runs_.begin()) return false;
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
  constexpr std::size_t kDirections = 14;
  static constexpr std::array<std::array<int, 3>, kDirections> kDirection = {{{-1, -1, -1},
                                                                              {1, -1, -1},
                                                                              {-1, 1, -1},
                                                                              {1, 1, -1},
                                                                              {-1, -1, 1},
                                                                              {1, -1, 1},
                                                                              {-1, 1, 1},
                                                                              {1, 1, 1},
                                                                              {-1, 0, 0},
                                                                              {1, 0, 0},
                                                                              {0, -1, 0},
                                                                              {0, 1, 0},
                                                                              {0, 0, -1},
                                                                              {0, 0, 1}}};
  std::array<double, kDirections> best;
  best.fill(-std::numeric_limits<double>::infinity());
  std::array<Voxel, kDirections> corner{};
  const Vec3 scale = frame_.scale;
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    const double y = run.row * scale.y(), z = run.layer * scale.z();
    for (std::size_t d = 0; d < kDirections; ++d) {
      const auto& [along_x, along_y, along_z] = kDirection[d];
      const std::uint32_t column = along_x > 0 ? run.end - 1 : run.begin;
      const double score = along_x * (column * scale.x()) + along_y * y + along_z * z;
      if (score <= best[d]) continue;
      best[d] = score;
      corner[d] = {column, run.row, run.layer};
    }
  }
  for (const Voxel& voxel : corner) add_candidate(voxel);
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
  for (const Sample& sample : pool_) {
    const double distance = (to_vec3(sample.voxel) - to_vec3(voxel)).cwiseProduct(pitch).squaredNorm();
    if (distance >= nearest) continue;
    nearest = distance;
    hint = sample.at;
  }
  return hint;
}

std::optional<MaterialTiles::Node> MaterialTiles::fit() {
  places_.clear();
  fit_values_.clear();
  for (const std::size_t s : chosen_) {
    places_.push_back(frame_(to_vec3(pool_[s].voxel)));
    const double* values = &pool_values_[s * channels_.size()];
    fit_values_.insert(fit_values_.end(), values, values + channels_.size());
  }
  fitter_.factorize(places_);
  if (extrapolates()) return std::nullopt;
  const std::size_t first_polynomial = polynomials_.size();
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    polynomials_.emplace_back();
    const double error = fitter_.fit(&fit_values_[c], channels_.size(), polynomials_.back());
    if (error <= kShareOfTolerance * channels_[c].tolerance) continue;
    polynomials_.resize(first_polynomial);
    return std::nullopt;
  }
  fits_.push_back({frame_, first_polynomial});
  return Node{Node::Kind::kPolynomial, 0, static_cast<std::uint32_t>(fits_.size() - 1)};
}

/// Some voxel that isn't a sample lies where the samples say little.
bool MaterialTiles::extrapolates() {
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const Vec3 place(candidate_places_[0][c], candidate_places_[1][c], candidate_places_[2][c]);
    if (candidate_distances_[c] > 0 && fitter_.leverage(place) > kMostLeverage) return true;
  }
  return false;
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

Vec3 MaterialTiles::centre(const Voxel& voxel) const {
  return grid_.lattice().centre(voxel[0], voxel[1], grid_.layer_z_mm(voxel[2]));
}

Box3 MaterialTiles::world_box(const VoxelBox& box) const {
  return Box3(centre(box.low), centre({box.high[0] - 1, box.high[1] - 1, box.high[2] - 1}));
}

void MaterialTiles::paint(std::uint32_t layer, std::span<const Span> spans, std::span<ContonePlane> planes,
                          LayerStats& stats, const CancellationToken& cancel) {
  PaintJob job{layer, grid_.lattice(), grid_.layer_z_mm(layer), planes, {}, stats, cancel};
  for (const ContonePlane& plane : planes) {
    const auto found = std::find_if(channels_.begin(), channels_.end(),
                                    [&](const ChannelTolerance& c) { return c.channel == plane.channel(); });
    job.polynomial_of_plane.push_back(static_cast<std::size_t>(found - channels_.begin()));
  }
  unresolved_.clear();
  stats.max_residual_mm = std::max(stats.max_residual_mm, max_residual_mm_);
  for (const Span& span : spans) {
    for (std::uint32_t column = span.begin / tile_size_[0]; column * tile_size_[0] < span.end; ++column) {
      const std::uint32_t tile_row = span.y / tile_size_[1];
      const Node& node = tiles_[std::size_t{tile_columns_} * tile_row + column];
      paint_piece(job, node, tile_box(column, tile_row), span.y, span.begin, span.end);
    }
  }
  unresolved_.fill(*field_, spans, job.lattice, job.z_mm, planes, stats, cancel);
}

void MaterialTiles::paint_piece(PaintJob& job, const Node& node, const VoxelBox& box, std::uint32_t row,
                                std::uint32_t begin, std::uint32_t end) {
  begin = std::max(begin, box.low[0]);
  end = std::min(end, box.high[0]);
  if (begin >= end) return;
  switch (node.kind) {
    case Node::Kind::kEmpty: return;
    case Node::Kind::kPolynomial: return paint_polynomial(job, fits_[node.index], row, begin, end);
    case Node::Kind::kExact: return paint_exactly(job, hints_[node.index], row, begin, end);
    case Node::Kind::kSplit: break;
  }
  VoxelBox part = box;
  std::uint32_t child = 0;
  const auto halve = [&](std::size_t a, std::uint32_t at) {
    if (!(node.split_axes >> a & 1)) return;
    const std::uint32_t middle = (box.low[a] + box.high[a]) / 2;
    (at >= middle ? part.low : part.high)[a] = middle;
    child |= (at >= middle ? 1u : 0u) << a;
  };
  halve(1, row);
  halve(2, job.layer);
  if (!(node.split_axes & 1)) return paint_piece(job, children_[node.index + child], part, row, begin, end);
  const std::uint32_t middle = (box.low[0] + box.high[0]) / 2;
  part.high[0] = middle;
  paint_piece(job, children_[node.index + child], part, row, begin, end);
  part.low[0] = middle;
  part.high[0] = box.high[0];
  paint_piece(job, children_[node.index + (child | 1)], part, row, begin, end);
}

void MaterialTiles::paint_polynomial(PaintJob& job, const Fit& fit, std::uint32_t row, std::uint32_t begin,
                                     std::uint32_t end) {
  const Vec3 at = fit.frame(Vec3(begin, row, job.layer));
  const std::size_t index = std::size_t{job.lattice.width} * row + begin;
  for (std::size_t p = 0; p < job.planes.size(); ++p) {
    const CubicPolynomial& polynomial = polynomials_[fit.first_polynomial + job.polynomial_of_plane[p]];
    job.planes[p].set_cubic(index, end - begin, at.x(), fit.frame.scale.x(), along_row(polynomial, at.y(), at.z()));
  }
  job.stats.voxels_interpolated += end - begin;
}

void MaterialTiles::paint_exactly(PaintJob& job, std::optional<CellParam> hint, std::uint32_t row, std::uint32_t begin,
                                  std::uint32_t end) {
  job.cancel.throw_if_cancelled();
  for (std::uint32_t x = begin; x < end; ++x) {
    const std::optional<InversionResult> found = field_->invert(job.lattice.centre(x, row, job.z_mm), hint);
    if (!found) {
      unresolved_.add(row, x);
      continue;
    }
    ++(found->full ? job.stats.voxels_full : job.stats.voxels_coherent);
    job.stats.max_residual_mm = std::max(job.stats.max_residual_mm, found->residual_mm);
    hint = found->at;
    field_->mat(found->at, values_);
    const std::size_t index = std::size_t{job.lattice.width} * row + x;
    for (ContonePlane& plane : job.planes) plane.set(index, values_);
  }
}

}  // namespace ccslice
