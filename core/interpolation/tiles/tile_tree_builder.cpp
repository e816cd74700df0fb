// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_tree_builder.h"

#include <algorithm>
#include <array>
#include <utility>

namespace ccslice {
namespace {

constexpr std::uint64_t kSmallestTile = 128;  // Tiles of fewer voxels are inverted voxel by voxel.
constexpr std::size_t kTrialParticles = 64;   // Where no fit is known to pay, boxes of no more are tried at first.

}  // namespace

TileTreeBuilder::TileTreeBuilder(std::shared_ptr<const LimitSolid> solid, const MaterialField& field,
                                 const InterpolationSpec& spec, bool promising, std::shared_ptr<VoxelBlocks> blocks)
    : field_(&field), grid_(spec.grid), promising_(promising), fitter_(std::move(solid), spec, std::move(blocks)) {}

void TileTreeBuilder::build(std::uint32_t first_layer, std::span<const std::span<const VoxelRun>> layers,
                            const CancellationToken& cancel, TileTree& tree) {
  tree_ = &tree;
  cancel_ = cancel;
  first_layer_ = first_layer;
  tree.clear(first_layer);
  cursors_.assign(layers.size(), 0);
  buckets_.resize(tree.tile_columns());
  for (std::uint32_t row = 0; row < tree.tile_rows(); ++row) {
    bucket_row(row, layers);
    for (std::uint32_t column = 0; column < tree.tile_columns(); ++column) {
      if (buckets_[column].empty()) continue;
      runs_.swap(buckets_[column]);
      trials_ = TileTrials(promising_);
      fitter_.particles().clear();
      tree.set_tile(column, row, build_node(tree.tile_box(column, row), 0, {}));
    }
  }
}

void TileTreeBuilder::bucket_row(std::uint32_t tile_row, std::span<const std::span<const VoxelRun>> layers) {
  for (std::vector<LayerRun>& bucket : buckets_) bucket.clear();
  const std::uint32_t columns = tree_->tile_size()[0], end_row = (tile_row + 1) * tree_->tile_size()[1];
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const std::uint32_t layer = first_layer_ + static_cast<std::uint32_t>(l);
    std::size_t& cursor = cursors_[l];
    for (; cursor < layers[l].size() && layers[l][cursor].row < end_row; ++cursor) {
      const VoxelRun& run = layers[l][cursor];
      for (std::uint32_t column = run.begin / columns; column * columns < run.end; ++column) {
        const std::uint32_t begin = std::max(run.begin, column * columns);
        const std::uint32_t end = std::min(run.end, (column + 1) * columns);
        buckets_[column].push_back({{run.row, begin, end}, layer});
      }
    }
  }
}

/// The node of a box that holds runs_ from `first_run` on. `around`: the particles of a box around it, if known.
TileTree::Node TileTreeBuilder::build_node(const VoxelBox& box, std::size_t first_run,
                                           const TileParticles::Range& around) {
  if (first_run == runs_.size()) return {};
  cancel_.throw_if_cancelled();
  std::uint64_t voxels = 0;
  Box3 centres;
  for (std::size_t r = first_run; r < runs_.size(); ++r) {
    const LayerRun& run = runs_[r];
    voxels += run.end - run.begin;
    centres.extend(Vec3(run.begin, run.row, run.layer)).extend(Vec3(run.end - 1.0, run.row, run.layer));
  }
  const std::uint8_t axes = axes_to_halve(box);
  if (voxels < kSmallestTile || axes == 0) {
    if (!around.known) trials_.note(voxels, false);
    return build_exact(first_run, around);
  }
  if (!around.known && trials_.skip(voxels)) return build_exact(first_run, around);
  // Where a point may have several parameters only inversion knows which one counts. Halving leaves less of that.
  if (is_ambiguous(centres)) return build_split(box, axes, first_run, around);
  const TileParticles::Range inside = fitter_.particles().enter(
      centres, voxels, around, around.known || trials_.are_promising() ? TileParticles::kMost : kTrialParticles);
  const std::size_t fits_before = fits_;
  Node node;
  switch (fitter_.fit(inside, centres, voxels)) {
    case TileFitter::Outcome::kFits:
      node = tree_->add_polynomials(fitter_.frame(), fitter_.polynomials());
      ++fits_;
      break;
    case TileFitter::Outcome::kHopeless: node = build_exact(first_run, inside); break;
    case TileFitter::Outcome::kHalve: node = build_split(box, axes, first_run, inside.known ? inside : around); break;
  }
  if (inside.known) fitter_.particles().leave(inside);
  if (inside.known && !around.known) trials_.note(voxels, fits_ > fits_before);
  return node;
}

bool TileTreeBuilder::is_ambiguous(const Box3& centres) const {
  const LayerLattice lattice = grid_.lattice();
  const auto world = [&](const Vec3& voxel) {
    return lattice.centre(static_cast<std::uint32_t>(voxel.x()), static_cast<std::uint32_t>(voxel.y()),
                          grid_.layer_z_mm(static_cast<std::uint32_t>(voxel.z())));
  };
  return field_->is_ambiguous(Box3(world(centres.min()), world(centres.max())));
}

TileTree::Node TileTreeBuilder::build_exact(std::size_t first_run, const TileParticles::Range& inside) {
  const LayerRun& run = runs_[first_run];
  return tree_->add_exact(fitter_.particles().near(inside, Vec3(run.begin, run.row, run.layer)));
}

/// Bit a if the box is to be halved along axis a: those along which it is about the longest, in millimetres, as
/// voxels needn't be cubes.
std::uint8_t TileTreeBuilder::axes_to_halve(const VoxelBox& box) const {
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

TileTree::Node TileTreeBuilder::build_split(const VoxelBox& box, std::uint8_t axes, std::size_t first_run,
                                            const TileParticles::Range& inside) {
  const Node node = tree_->add_split(axes);
  // runs_ is a stack: a half's runs go on top, and are dropped once its node is built.
  const std::size_t end_run = runs_.size();
  for (std::uint32_t child = 0; child < 8; ++child) {
    if (child & ~std::uint32_t{axes}) continue;
    VoxelBox half = box;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!(axes >> a & 1)) continue;
      const std::uint32_t middle = (box.low[a] + box.high[a]) / 2;
      (child >> a & 1 ? half.low : half.high)[a] = middle;
    }
    for (std::size_t r = first_run; r < end_run; ++r) {
      const LayerRun run = runs_[r];
      if (run.layer < half.low[2] || run.layer >= half.high[2] || run.row < half.low[1] || run.row >= half.high[1]) {
        continue;
      }
      const std::uint32_t begin = std::max(run.begin, half.low[0]), end = std::min(run.end, half.high[0]);
      if (begin < end) runs_.push_back({{run.row, begin, end}, run.layer});
    }
    tree_->set_child(node, child, build_node(half, end_run, inside));
    runs_.resize(end_run);
  }
  return node;
}

}  // namespace ccslice
