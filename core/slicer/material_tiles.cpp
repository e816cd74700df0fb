// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_tiles.h"

#include <algorithm>
#include <utility>

namespace ccslice {
namespace {

constexpr double kTileMm = 11.2;  // Tiles are at most this long each way, powers of two of voxels,
constexpr std::uint32_t kMostColumns = 4 * kRowsTogether, kMostRows = kRowsTogether;  // and of at most so many.
constexpr std::uint64_t kSmallestTile = 128;  // Tiles of fewer voxels are inverted voxel by voxel.

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
  Span exact_run;                       // To be inverted, across nodes; empty if begin == end,
  std::optional<CellParam> exact_hint;  // and a hint for its first voxel.
};

MaterialTiles::MaterialTiles(std::shared_ptr<const LimitSolid> solid, MaterialField& field,
                             const InterpolationSpec& spec)
    : field_(&field),
      grid_(spec.grid),
      channels_(spec.channels),
      tile_size_{tile_voxels(grid_.pitch.x_mm, kMostColumns), tile_voxels(grid_.pitch.y_mm, kMostRows), kSlabLayers},
      tile_columns_(tiles_over(grid_.extent.columns, tile_size_[0])),
      tile_rows_(tiles_over(grid_.extent.rows, tile_size_[1])),
      fitter_(std::move(solid), spec),
      buckets_(tile_columns_),
      exact_(field) {}

void MaterialTiles::solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers,
                          const CancellationToken& cancel) {
  cancel_ = cancel;
  first_layer_ = first_layer;
  tiles_.assign(std::size_t{tile_columns_} * tile_rows_, Node{});
  children_.clear();
  fits_.clear();
  polynomials_.clear();
  cubics_.clear();
  hints_.clear();
  cursors_.assign(layers.size(), 0);
  for (std::uint32_t row = 0; row < tile_rows_; ++row) {
    bucket_row(row, layers);
    for (std::uint32_t column = 0; column < tile_columns_; ++column) {
      if (buckets_[column].empty()) continue;
      runs_.swap(buckets_[column]);
      tiles_[std::size_t{tile_columns_} * row + column] = build(tile_box(column, row), 0, {});
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

MaterialTiles::Node MaterialTiles::build(const VoxelBox& box, std::size_t first_run,
                                         const TileFitter::Particles& around) {
  if (first_run == runs_.size()) return {};
  cancel_.throw_if_cancelled();
  std::uint64_t voxels = 0;
  Box3 centres;
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    voxels += run.end - run.begin;
    centres.extend(Vec3(run.begin, run.row, run.layer)).extend(Vec3(run.end - 1.0, run.row, run.layer));
  }
  const std::uint8_t axes = axes_to_halve(box);
  if (voxels < kSmallestTile || axes == 0) return add_exact(first_run, around);
  if (is_ambiguous(centres)) return build_split(box, axes, first_run, around);
  const TileFitter::Particles inside = fitter_.enter(centres, voxels, around);
  Node node;
  switch (fitter_.fit(inside, centres, voxels, kSmallestTile)) {
    case TileFitter::Outcome::kFits: node = add_fit(); break;
    case TileFitter::Outcome::kHopeless: node = add_exact(first_run, inside); break;
    case TileFitter::Outcome::kHalve: node = build_split(box, axes, first_run, inside.known ? inside : around); break;
  }
  if (inside.known) fitter_.leave(inside);
  return node;
}

bool MaterialTiles::is_ambiguous(const Box3& centres) const {
  const LayerLattice lattice = grid_.lattice();
  const auto world = [&](const Vec3& voxel) {
    return lattice.centre(static_cast<std::uint32_t>(voxel.x()), static_cast<std::uint32_t>(voxel.y()),
                          grid_.layer_z_mm(static_cast<std::uint32_t>(voxel.z())));
  };
  return field_->is_ambiguous(Box3(world(centres.min()), world(centres.max())));
}

MaterialTiles::Node MaterialTiles::add_fit() {
  fits_.push_back({fitter_.frame(), polynomials_.size()});
  polynomials_.insert(polynomials_.end(), fitter_.polynomials().begin(), fitter_.polynomials().end());
  return {Node::Kind::kPolynomial, 0, static_cast<std::uint32_t>(fits_.size() - 1)};
}

MaterialTiles::Node MaterialTiles::add_exact(std::size_t first_run, const TileFitter::Particles& inside) {
  const Run& run = runs_[first_run];
  hints_.push_back(fitter_.near(inside, Vec3(run.begin, run.row, run.layer)));
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

MaterialTiles::Node MaterialTiles::build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run,
                                               const TileFitter::Particles& inside) {
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
    const Node built = build(part, end_run, inside);
    children_[node.index + child] = built;
    runs_.resize(end_run);
  }
  return node;
}

bool MaterialTiles::paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans,
                          std::span<const HintedRun> alone, std::span<const Span> inside) {
  PaintJob job{target, layer, {target, layer, channels_}, {}, {}};
  exact_.start_layer();
  for (const Span& span : spans) {
    if (span.y >= target.window.end_row()) break;
    for (; !alone.empty() && is_before(alone.front().run, span); alone = alone.subspan(1))
      paint_alone(job, alone.front());
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

std::uint32_t MaterialTiles::enter_part(const Node& node, const Voxel& voxel, VoxelBox& box) const {
  std::uint32_t child = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(node.split_axes >> a & 1)) continue;
    const std::uint32_t middle = (box.low[a] + box.high[a]) / 2;
    const bool high = voxel[a] >= middle;
    (high ? box.low : box.high)[a] = middle;
    child |= (high ? 1u : 0u) << a;
  }
  return child;
}

std::optional<MaterialTiles::Paint> MaterialTiles::paint_of(std::uint32_t layer, std::uint32_t row,
                                                            std::uint32_t column) const {
  const std::uint32_t tile_column = column / tile_size_[0], tile_row = row / tile_size_[1];
  VoxelBox box = tile_box(tile_column, tile_row);
  const Node* node = &tiles_[std::size_t{tile_columns_} * tile_row + tile_column];
  while (node->kind == Node::Kind::kSplit) {
    node = &children_[node->index + enter_part(*node, {column, row, layer}, box)];
  }
  if (node->kind != Node::Kind::kPolynomial) return std::nullopt;
  const Fit& fit = fits_[node->index];
  return Paint{fit.frame, polynomials_of(fit)};
}

void MaterialTiles::paint_alone(PaintJob& job, const HintedRun& alone) {
  finish_exact_run(job);
  exact_.solve_from(job.target, alone);
}

void MaterialTiles::paint_piece(PaintJob& job, const Node& node, const VoxelBox& box, std::uint32_t row,
                                std::uint32_t begin, std::uint32_t end) {
  begin = std::max(begin, box.low[0]);
  end = std::min(end, box.high[0]);
  if (begin >= end) return;
  switch (node.kind) {
    case Node::Kind::kEmpty: return;
    case Node::Kind::kPolynomial: {
      const Fit& fit = fits_[node.index];
      return job.painter.paint(fit.frame, cubics_.of(node.index, fit.frame, polynomials_of(fit), job.layer), row, begin,
                               end);
    }
    case Node::Kind::kExact: return paint_exactly(job, hints_[node.index], {row, begin, end});
    case Node::Kind::kSplit: break;
  }
  VoxelBox part = box;
  const std::uint32_t child = enter_part(node, {begin, row, job.layer}, part);
  paint_piece(job, children_[node.index + child], part, row, begin, end);
  if (part.high[0] >= end) return;
  part.low[0] = part.high[0];  // The other half of the row.
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
