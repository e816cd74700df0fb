// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of cells (interpolation/pieces/cell_fitter.h) and tiles (interpolation/tiles/tile_fitter.h) searched for where
// they are off most, which voxels hit by chance alone.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/interpolation/tiles/tile_fitter.h"
#include "core/limit/cell_bricks.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_evaluated.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_shells.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr double kRoundingOfTheirBounds = 1e-6;
constexpr std::size_t kMostNodes = 2000;  // Of a cell.

class PieceSearch {
 public:
  PieceSearch(Evaluated& evaluated, ShellSearch& shells, HostileFinding& finding)
      : evaluated_(evaluated),
        shells_(shells),
        finding_(finding),
        blocks_(*evaluated.solid, evaluated.spec),
        fitter_(evaluated.solid, evaluated.spec) {}

  /// Searches at most so many pieces of these cells, and the shells of so many of them.
  void search(const std::vector<LimitCellId>& cells, std::size_t most, std::size_t most_shells) {
    for (const LimitCellId cell : cells) {
      std::vector<CellNode> nodes(1);
      nodes[0].bounds = Box3(Vec3::Constant(-1e9), Vec3::Constant(1e9));
      for (std::uint32_t n = 0; n < nodes.size() && n < kMostNodes; ++n) fitter_.examine(cell, nodes, n);
      for (const CellNode& node : nodes) {
        if (node.kind != CellNode::Kind::kPiece) continue;
        if (most-- == 0) return;
        for (std::size_t c = 0; c < evaluated_.spec.channels.size(); ++c) search(cell, node, c);
        if (most_shells == 0) continue;
        --most_shells;
        shells_.search(cell, *node.piece);
      }
    }
  }

 private:
  void search(LimitCellId cell, const CellNode& node, std::size_t c) {
    const auto [largest, at] = evaluated_.find_worst(cell, node.parameters, c, node.piece->frame,
                                                     node.piece->polynomials[c], [](const Vec3&) { return true; });
    const bool is_bounded = evaluated_.spec.proved || blocks_.is_in_one_patch(cell, node.parameters) ||
                            evaluated_.solid->cell_class(cell) == CellClass::kLine;
    const double allowed = (is_bounded ? node.piece->error * (1 + kRoundingOfTheirBounds) : 1) + evaluated_.rounding(c);
    ++finding_.compared;
    finding_.worst = std::max(largest, finding_.worst);
    if (largest <= allowed || ++finding_.failed > 1) return;
    finding_.where = "cell " + std::to_string(cell) + " channel " + evaluated_.range(c).name + ", " +
                     (is_bounded ? "bounded" : "sampled") + " piece from " + vector_text(node.parameters.low) +
                     " of size " + vector_text(node.parameters.high - node.parameters.low) + ": " + number(largest) +
                     " of the tolerance at " + vector_text(at) + " of it, at most " + number(node.piece->error) +
                     " by itself";
  }

  Evaluated& evaluated_;
  ShellSearch& shells_;
  HostileFinding& finding_;
  VoxelBlocks blocks_;
  CellFitter fitter_;
};

/// Puts tiles anywhere and searches them.
class TileSearch {
 public:
  TileSearch(Evaluated& evaluated, HostileFinding& finding)
      : evaluated_(evaluated), finding_(finding), fitter_(evaluated.solid, evaluated.spec) {}

  /// Tries so many boxes of voxels.
  void search(int boxes, std::uint64_t seed) {
    HostileRandom random(seed, kTileStream);
    for (; boxes > 0; --boxes) search(random_box(random));
  }

 private:
  static constexpr std::uint64_t kTileStream = 23;
  static constexpr std::size_t kMostParticles = 8;  // Of a tile.
  static constexpr std::size_t kMostParts = 8;      // Of a particle.
  static constexpr std::uint64_t kManyVoxels = 1 << 20;

  Box3 random_box(HostileRandom& random) {
    const LimitCellId cell{static_cast<std::uint32_t>(random.bits() % evaluated_.solid->cell_count())};
    const Vec3 uvw = Vec3::Constant(0.5) + random.in_cube(0.5);
    const Vec3 middle = evaluated_.voxel_of_mesh * evaluated_.evaluator.geo({cell, uvw});
    const Vec3 half(random.log_between(0.5, 32), random.log_between(0.5, 32), random.log_between(0.5, 32));
    return {middle - half, middle + half};
  }

  void search(const Box3& box) {
    const Placement mesh_of_voxel = evaluated_.voxel_of_mesh.inverse(Eigen::Affine);
    if (evaluated_.solid->index().is_ambiguous(box.transformed(mesh_of_voxel))) return;
    TileParticles& particles = fitter_.particles();
    particles.clear();
    const TileParticles::Range range = particles.enter(box, kManyVoxels, {});
    if (fitter_.fit(range, box, kManyVoxels) != TileFitter::Outcome::kFits) return;
    const std::span<const std::uint32_t> members = particles.members(range);
    for (const std::uint32_t m : members.first(std::min(members.size(), kMostParticles))) {
      for (const Part& part : parts_of(particles[m])) {
        for (std::size_t c = 0; c < evaluated_.spec.channels.size(); ++c) search(box, part, c);
      }
    }
  }

  /// A box of one cell's parameters.
  struct Part {
    LimitCellId cell;
    ParamBox box;
  };

  /// Some of the cells that a particle is of.
  std::vector<Part> parts_of(const TileParticle& particle) const {
    if (particle.brick == kNone) return {{particle.cell, particle.parameters}};
    const CellBricks& bricks = evaluated_.solid->bricks();
    const CellBrick& brick = bricks[particle.brick];
    std::vector<Part> parts;
    for (std::size_t n = 0; n < brick.cell_count(); ++n) {
      const std::size_t x = brick.cells[0], y = brick.cells[1];
      const Vec3 place(static_cast<double>(n % x), static_cast<double>(n / x % y), static_cast<double>(n / (x * y)));
      const Vec3 low = (particle.parameters.low - place).cwiseMax(0),
                 high = (particle.parameters.high - place).cwiseMin(1);
      if (!(low.array() < high.array()).all()) continue;
      const CellBricks::Cell& cell = bricks.cells(brick)[n];
      const Vec3 a = cell.frame.from_framed(low), b = cell.frame.from_framed(high);
      parts.push_back({cell.cell, {a.cwiseMin(b), a.cwiseMax(b)}});
    }
    std::vector<Part> some;
    const std::size_t step = 1 + parts.size() / kMostParts;
    for (std::size_t n = 0; n < parts.size(); n += step) some.push_back(parts[n]);
    return some;
  }

  void search(const Box3& box, const Part& part, std::size_t c) {
    const auto [largest, at] = evaluated_.find_worst(part.cell, part.box, c, fitter_.frame(), fitter_.polynomials()[c],
                                                     [&box](const Vec3& voxel) { return box.contains(voxel); });
    ++finding_.compared;
    finding_.worst = std::max(largest, finding_.worst);
    if (largest <= 1 + evaluated_.rounding(c) || ++finding_.failed > 1) return;
    finding_.where = "tile " + vector_text(box.min()) + " to " + vector_text(box.max()) + " channel " +
                     evaluated_.range(c).name + ": " + number(largest) + " of the tolerance in cell " +
                     std::to_string(part.cell) + " at " + vector_text(at) + " of a part of it";
  }

  Evaluated& evaluated_;
  HostileFinding& finding_;
  TileFitter fitter_;
};

}  // namespace

void compare_pieces(const HostileRun& run, HostileFinding& finding, HostileFinding& finding_of_shells) {
  constexpr std::size_t kMostOfVertices = 300, kMostOfOthers = 60, kMostShells = 40;
  constexpr int kTiles = 25;
  if (run.job.job.channel_tolerance == 0) return;
  Evaluated evaluated(run);
  if (evaluated.spec.channels.empty()) return;
  std::vector<LimitCellId> at_vertices, others;
  for (const LimitCellId cell : run.solid->cells()) {
    (run.solid->cell_class(cell) == CellClass::kVertex ? at_vertices : others).push_back(cell);
  }
  ShellSearch shells(evaluated, finding_of_shells);
  PieceSearch search(evaluated, shells, finding);
  std::mt19937_64 random(run.seed);
  for (std::vector<LimitCellId>* cells : {&at_vertices, &others}) {
    std::shuffle(cells->begin(), cells->end(), random);
    search.search(*cells, cells == &at_vertices ? kMostOfVertices : kMostOfOthers, kMostShells);
  }
  TileSearch(evaluated, finding).search(kTiles, run.seed);
}

}  // namespace ccslice::oracle
