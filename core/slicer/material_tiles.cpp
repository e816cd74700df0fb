// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ccslice {
namespace {

constexpr double kTileMm = 11.2;  // Tiles are at most this long each way, powers of two of voxels,
constexpr std::uint32_t kMostColumns = 4 * kRowsTogether, kMostRows = kRowsTogether;  // and of at most so many.
constexpr std::uint64_t kSmallestTile = 128;  // Tiles of fewer voxels are inverted voxel by voxel.
constexpr double kShareOfTolerance = 0.125;   // What leave-one-out errors may take of it,
constexpr double kShareAtMiddles = 0.1;       // errors at cells' middles, which are up to ten times that at corners,
constexpr double kShareOutside = 0.5;         // and what following a fit off the solid may.

std::uint32_t tile_voxels(double pitch_mm, std::uint32_t most) {
  std::uint32_t size = 1;
  while (size < most && 2 * size * pitch_mm <= kTileMm) size *= 2;
  return size;
}

bool is_before(const Span& a, const Span& b) { return a.y != b.y ? a.y < b.y : a.begin < b.begin; }

std::uint32_t tiles_over(std::uint32_t voxels, std::uint32_t size) { return (voxels + size - 1) / size; }

}  // namespace

struct MaterialTiles::PaintJob {
  const LayerTarget& target;
  std::uint32_t layer;
  CubicPainter painter;
  Span inside;                          // That the voxels at hand are of.
  Span exact_run;                       // To be inverted, across nodes; empty if begin == end,
  std::optional<CellParam> exact_hint;  // and a hint for its first voxel.
};

MaterialTiles::MaterialTiles(MaterialField& field, const InterpolationSpec& spec)
    : field_(&field),
      grid_(spec.grid),
      channels_(spec.channels),
      outside_mm_(spec.outside_mm),
      tile_size_{tile_voxels(grid_.pitch.x_mm, kMostColumns), tile_voxels(grid_.pitch.y_mm, kMostRows), kSlabLayers},
      tile_columns_(tiles_over(grid_.extent.columns, tile_size_[0])),
      tile_rows_(tiles_over(grid_.extent.rows, tile_size_[1])),
      buckets_(tile_columns_),
      values_(field.channel_count()),
      exact_(field) {}

void MaterialTiles::solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers,
                          const CancellationToken& cancel) {
  cancel_ = cancel;
  first_layer_ = first_layer;
  end_layer_ = first_layer + static_cast<std::uint32_t>(layers.size());
  tiles_.assign(std::size_t{tile_columns_} * tile_rows_, Node{});
  children_.clear();
  fits_.clear();
  polynomials_.clear();
  cubics_.clear();
  hints_.clear();
  max_residual_mm_ = 0;
  cursors_.assign(layers.size(), 0);
  features_collected_ = false;
  for (std::uint32_t row = 0; row < tile_rows_; ++row) {
    bucket_row(row, layers);
    first_hint_.reset();
    for (std::uint32_t column = 0; column < tile_columns_; ++column) {
      if (buckets_[column].empty()) continue;
      members_.clear();
      runs_.swap(buckets_[column]);
      pool_.clear();
      pool_values_.clear();
      features_loaded_ = false;
      tile_runs_ = runs_.size();
      tile_ = std::size_t{tile_columns_} * row + column;
      tiles_[tile_] = build(tile_box(column, row), 0, 0);
      if (!pool_.empty()) first_hint_ = pool_.back().at;
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

MaterialTiles::Node MaterialTiles::build(const VoxelBox& box, std::size_t first_run, std::size_t first_member) {
  if (first_run == runs_.size()) return {};
  cancel_.throw_if_cancelled();
  chosen_.clear();
  for (std::size_t m = first_member; m < members_.size(); ++m) {
    if (box.holds(pool_[members_[m]].voxel)) chosen_.push_back(members_[m]);
  }
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
  const std::size_t end_run = runs_.size(), first_member = members_.size();
  members_.insert(members_.end(), chosen_.begin(), chosen_.end());
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
    const Node built = build(part, end_run, first_member);
    children_[node.index + child] = built;
    runs_.resize(end_run);
  }
  members_.resize(first_member);
  return node;
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
  if (!agrees_with_cells(first_polynomial)) {
    polynomials_.resize(first_polynomial);
    return std::nullopt;
  }
  fits_.push_back({frame_, first_polynomial, is_steep(first_polynomial)});
  return Node{Node::Kind::kPolynomial, 0, static_cast<std::uint32_t>(fits_.size() - 1)};
}

/// At the middles of all cells there: samples may lie farther apart than what one control point holds is wide. Along
/// axes of three voxels or fewer a cubic says nothing between them, where middles are: there samples have to do.
bool MaterialTiles::agrees_with_cells(std::size_t first_polynomial) const {
  constexpr double kThin = 1.25;  // Half of three voxels' distances is 1, of four 1.5.
  const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
  const Vec3 half = frame_.scale.cwiseInverse();
  if (half.minCoeff() < kThin) return true;
  const auto world = [&](const Vec3& voxel) {
    return (grid_.origin_mm + (voxel + Vec3::Constant(0.5)).cwiseProduct(pitch)).eval();
  };
  const auto differs = [&](const Vec3& middle, std::span<const double> channels) {
    const Vec3 place = frame_((middle - grid_.origin_mm).cwiseQuotient(pitch) - Vec3::Constant(0.5));
    if ((place.cwiseAbs().array() > 1).any()) return false;
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const double error = value_at(polynomials_[first_polynomial + c], place) - channels[channels_[c].channel];
      if (!(std::abs(error) <= kShareAtMiddles * channels_[c].tolerance)) return true;
    }
    return false;
  };
  return !field_->any_middle(Box3(world(frame_.centre - half), world(frame_.centre + half)), differs);
}

/// At some sample, over as far as voxels may lie off the solid.
bool MaterialTiles::is_steep(std::size_t first_polynomial) const {
  const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double most = kShareOutside * channels_[c].tolerance / outside_mm_;
    for (const Vec3& place : places_) {
      const Vec3 per_voxel = gradient_at(polynomials_[first_polynomial + c], place).cwiseProduct(frame_.scale);
      if (!(per_voxel.cwiseQuotient(pitch).norm() <= most)) return true;
    }
  }
  return false;
}

Vec3 MaterialTiles::centre(const Voxel& voxel) const {
  return grid_.lattice().centre(voxel[0], voxel[1], grid_.layer_z_mm(voxel[2]));
}

Box3 MaterialTiles::world_box(const VoxelBox& box) const {
  return Box3(centre(box.low), centre({box.high[0] - 1, box.high[1] - 1, box.high[2] - 1}));
}

bool MaterialTiles::paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans,
                          std::span<const HintedRun> alone, std::span<const Span> inside) {
  PaintJob job{target, layer, {target, layer, channels_}, {}, {}, {}};
  auto around = inside.begin();
  exact_.start_layer();
  if (!spans.empty()) target.stats.max_residual_mm = std::max(target.stats.max_residual_mm, max_residual_mm_);
  for (const Span& span : spans) {
    if (span.y >= target.window.end_row()) break;
    for (; !alone.empty() && is_before(alone.front().run, span); alone = alone.subspan(1))
      paint_alone(job, alone.front());
    while (around->y != span.y || around->end <= span.begin) ++around;
    job.inside = *around;
    paint_tiles(job, span);
  }
  for (const HintedRun& each : alone) paint_alone(job, each);
  finish_exact_run(job);
  return exact_.finish_layer(target, inside);
}

void MaterialTiles::paint_tiles(PaintJob& job, const Span& span) {
  const std::uint32_t tile_row = span.y / tile_size_[1];
  for (std::uint32_t column = span.begin / tile_size_[0]; column * tile_size_[0] < span.end; ++column) {
    const Node& node = tiles_[std::size_t{tile_columns_} * tile_row + column];
    paint_piece(job, node, tile_box(column, tile_row), span.y, span.begin, span.end);
  }
}

void MaterialTiles::paint_alone(PaintJob& job, const HintedRun& alone) {
  finish_exact_run(job);
  exact_.solve_from(job.target, alone);
}

void MaterialTiles::paint_fit(PaintJob& job, std::uint32_t index, Span run) {
  const Fit& fit = fits_[index];
  if (fit.steep && run.begin == job.inside.begin) {
    paint_exactly(job, {}, {run.y, run.begin, run.begin + 1});
    ++run.begin;
  }
  const bool ends = fit.steep && run.end == job.inside.end && run.begin < run.end;
  if (ends) --run.end;
  const auto polynomials = std::span(polynomials_).subspan(fit.first_polynomial, channels_.size());
  job.painter.paint(fit.frame, cubics_.of(index, fit.frame, polynomials, job.layer), run.y, run.begin, run.end);
  if (ends) paint_exactly(job, {}, {run.y, run.end, run.end + 1});
}

void MaterialTiles::paint_piece(PaintJob& job, const Node& node, const VoxelBox& box, std::uint32_t row,
                                std::uint32_t begin, std::uint32_t end) {
  begin = std::max(begin, box.low[0]);
  end = std::min(end, box.high[0]);
  if (begin >= end) return;
  switch (node.kind) {
    case Node::Kind::kEmpty: return;
    case Node::Kind::kPolynomial: return paint_fit(job, node.index, {row, begin, end});
    case Node::Kind::kExact: return paint_exactly(job, hints_[node.index], {row, begin, end});
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

/// Neighbouring pieces of a row are inverted together.
void MaterialTiles::paint_exactly(PaintJob& job, const std::optional<CellParam>& hint, const Span& run) {
  if (job.exact_run.y == run.y && job.exact_run.end == run.begin && job.exact_run.begin < job.exact_run.end) {
    job.exact_run.end = run.end;
    return;
  }
  finish_exact_run(job);
  job.exact_run = run;
  job.exact_hint = hint;
}

void MaterialTiles::finish_exact_run(PaintJob& job) {
  if (job.exact_run.begin < job.exact_run.end) exact_.solve(job.target, job.exact_run, job.exact_hint);
  job.exact_run = {};
}

}  // namespace ccslice
