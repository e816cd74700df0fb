// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of cells (interpolation/cell_fitter.h) and tiles (interpolation/tile_fitter.h) searched for where they are off
// most, which voxels hit by chance alone: the largest of 9 x 9 x 9 parameters and what is reached uphill from the
// largest few. Samples come from LimitEvaluator, one at a time; what is searched is made of other ones, in blocks.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/interpolation/cell_fitter.h"
#include "core/interpolation/tile_fitter.h"
#include "core/interpolation/voxel_blocks.h"
#include "core/limit/limit_evaluator.h"
#include "core/slicer/channel_tolerances.h"
#include "tests/oracle/hostile_comparisons.h"
#include "tests/oracle/hostile_random.h"
#include "tests/oracle/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr double kRoundingOfPieces = 1e-11;  // Of the channel's largest value.
constexpr double kRoundingOfTheirBounds = 1e-6;
constexpr std::size_t kMostNodes = 2000;  // Of a cell.

/// The largest value of a function over the unit cube, or nearly, and where it is.
template <typename Function>
std::pair<double, Vec3> find_largest(Function function) {
  constexpr int kSteps = 8;
  constexpr std::size_t kStarts = 4;
  constexpr double kFirstStep = 0.06, kLastStep = 0.003;
  std::vector<std::pair<double, Vec3>> starts;
  for (int n = 0; n < (kSteps + 1) * (kSteps + 1) * (kSteps + 1); ++n) {
    const Vec3 at = Vec3(n % (kSteps + 1), n / (kSteps + 1) % (kSteps + 1), n / ((kSteps + 1) * (kSteps + 1))) / kSteps;
    starts.emplace_back(function(at), at);
  }
  std::partial_sort(starts.begin(), starts.begin() + kStarts, starts.end(),
                    [](const auto& a, const auto& b) { return a.first > b.first; });
  std::pair<double, Vec3> largest = starts.front();
  for (std::size_t start = 0; start < kStarts; ++start) {
    auto [value, at] = starts[start];
    for (double step = kFirstStep; step > kLastStep;) {
      bool higher = false;
      for (int way = 0; way < 6; ++way) {
        Vec3 next = at;
        next[way / 2] = std::clamp(next[way / 2] + (way % 2 == 0 ? step : -step), 0.0, 1.0);
        const double found = function(next);
        if (!(found > value)) continue;
        value = found, at = next, higher = true;
      }
      if (!higher) step /= 2;
    }
    if (value > largest.first) largest = {value, at};
  }
  return largest;
}

std::string vector_text(const Vec3& v) {
  return "(" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + ")";
}

/// What polynomials are compared with.
struct Evaluated {
  explicit Evaluated(const HostileRun& run)
      : solid(run.solid),
        spec(interpolation_spec_of(run.job.job, run.solid->summary().channels)),
        voxel_of_mesh(ccslice::voxel_of_mesh(spec.placement, spec.grid)),
        evaluator(*solid),
        values(solid->channel_count()) {}

  /// The largest error of a polynomial of spec.channels[c] over a box of a cell's parameters, as a share of the
  /// tolerance, and where in the box that is. It counts at voxels for which counts(voxel) is true.
  template <typename Counts>
  std::pair<double, Vec3> find_worst(LimitCellId cell, const ParamBox& box, std::size_t c, const VoxelFrame& frame,
                                     const CubicPolynomial& polynomial, Counts counts) {
    const auto& [channel, tolerance] = spec.channels[c];
    return find_largest([&](const Vec3& share) {
      const Vec3 uvw = box.low + share.cwiseProduct(box.high - box.low);
      const Vec3 voxel = voxel_of_mesh * evaluator.geo_and_mat({cell, uvw}, values);
      return counts(voxel) ? std::abs(value_at(polynomial, frame(voxel)) - values[channel]) / tolerance : 0.0;
    });
  }

  const ChannelRange& range(std::size_t c) const { return solid->summary().channels[spec.channels[c].channel]; }
  /// As a share of the channel's tolerance.
  double rounding(std::size_t c) const {
    return kRoundingOfPieces * std::max(std::abs(range(c).min), std::abs(range(c).max)) / spec.channels[c].tolerance;
  }

  std::shared_ptr<const LimitSolid> solid;
  InterpolationSpec spec;
  Placement voxel_of_mesh;
  LimitEvaluator evaluator;
  std::vector<double> values;
};

class PieceSearch {
 public:
  PieceSearch(Evaluated& evaluated, HostileFinding& finding)
      : evaluated_(evaluated),
        finding_(finding),
        blocks_(*evaluated.solid, evaluated.spec),
        fitter_(evaluated.solid, evaluated.spec) {}

  /// Searches at most so many pieces of these cells.
  void search(const std::vector<LimitCellId>& cells, std::size_t most) {
    for (const LimitCellId cell : cells) {
      std::vector<CellNode> nodes(1);
      nodes[0].bounds = Box3(Vec3::Constant(-1e9), Vec3::Constant(1e9));
      for (std::uint32_t n = 0; n < nodes.size() && n < kMostNodes; ++n) fitter_.examine(cell, nodes, n);
      for (const CellNode& node : nodes) {
        if (node.kind != CellNode::Kind::kPiece) continue;
        if (most-- == 0) return;
        for (std::size_t c = 0; c < evaluated_.spec.channels.size(); ++c) search(cell, node, c);
      }
    }
  }

 private:
  void search(LimitCellId cell, const CellNode& node, std::size_t c) {
    const auto [largest, at] = evaluated_.find_worst(cell, node.parameters, c, node.piece->frame,
                                                     node.piece->polynomials[c], [](const Vec3&) { return true; });
    const bool is_bounded =
        blocks_.is_in_one_patch(cell, node.parameters) || evaluated_.solid->cell_class(cell) == CellClass::kLine;
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
  static constexpr std::uint64_t kManyVoxels = 1 << 20, kFewVoxels = 128;

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
    if (fitter_.fit(range, box, kManyVoxels, kFewVoxels) != TileFitter::Outcome::kFits) return;
    const std::span<const std::uint32_t> members = particles.members(range);
    for (const std::uint32_t m : members.first(std::min(members.size(), kMostParticles))) {
      for (std::size_t c = 0; c < evaluated_.spec.channels.size(); ++c) search(box, particles[m], c);
    }
  }

  void search(const Box3& box, const TileParticle& particle, std::size_t c) {
    const auto [largest, at] =
        evaluated_.find_worst(particle.cell, particle.parameters, c, fitter_.frame(), fitter_.polynomials()[c],
                              [&box](const Vec3& voxel) { return box.contains(voxel); });
    ++finding_.compared;
    finding_.worst = std::max(largest, finding_.worst);
    if (largest <= 1 + evaluated_.rounding(c) || ++finding_.failed > 1) return;
    finding_.where = "tile " + vector_text(box.min()) + " to " + vector_text(box.max()) + " channel " +
                     evaluated_.range(c).name + ": " + number(largest) + " of the tolerance in cell " +
                     std::to_string(particle.cell) + " at " + vector_text(at) + " of a part of it";
  }

  Evaluated& evaluated_;
  HostileFinding& finding_;
  TileFitter fitter_;
};

}  // namespace

void compare_pieces(const HostileRun& run, HostileFinding& finding) {
  constexpr std::size_t kMostOfVertices = 300, kMostOfOthers = 60;
  constexpr int kTiles = 25;
  if (run.job.job.material_tolerance == 0) return;
  Evaluated evaluated(run);
  if (evaluated.spec.channels.empty()) return;
  std::vector<LimitCellId> at_vertices, others;
  for (const LimitCellId cell : run.solid->cells()) {
    (run.solid->cell_class(cell) == CellClass::kVertex ? at_vertices : others).push_back(cell);
  }
  PieceSearch search(evaluated, finding);
  std::mt19937_64 random(run.seed);
  for (std::vector<LimitCellId>* cells : {&at_vertices, &others}) {
    std::shuffle(cells->begin(), cells->end(), random);
    search.search(*cells, cells == &at_vertices ? kMostOfVertices : kMostOfOthers);
  }
  TileSearch(evaluated, finding).search(kTiles, run.seed);
}

}  // namespace ccslice::oracle
