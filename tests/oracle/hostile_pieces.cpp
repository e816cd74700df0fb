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

/// As a share of the channel's tolerance.
double rounding_of(const LimitSolid& solid, const ChannelTolerance& channel) {
  const ChannelRange& range = solid.summary().channels[channel.channel];
  return kRoundingOfPieces * std::max(std::abs(range.min), std::abs(range.max)) / channel.tolerance;
}

class PieceSearch {
 public:
  PieceSearch(const HostileRun& run, HostileFinding& finding)
      : solid_(run.solid),
        finding_(finding),
        spec_(interpolation_spec_of(run.job.job, run.solid->summary().channels)),
        voxel_of_mesh_(voxel_of_mesh(spec_.placement, spec_.grid)),
        blocks_(*solid_, spec_),
        fitter_(solid_, spec_),
        evaluator_(*solid_),
        values_(solid_->channel_count()) {}

  /// Of these cells, `most` pieces.
  void search(const std::vector<LimitCellId>& cells, std::size_t most) {
    for (const LimitCellId cell : cells) {
      std::vector<CellNode> nodes(1);
      nodes[0].bounds = Box3(Vec3::Constant(-1e9), Vec3::Constant(1e9));
      for (std::uint32_t n = 0; n < nodes.size() && n < kMostNodes; ++n) fitter_.examine(cell, nodes, n);
      for (const CellNode& node : nodes) {
        if (node.kind != CellNode::Kind::kPiece) continue;
        if (most-- == 0) return;
        for (std::size_t c = 0; c < spec_.channels.size(); ++c) search(cell, node, c);
      }
    }
  }

 private:
  void search(LimitCellId cell, const CellNode& node, std::size_t c) {
    const auto& [channel, tolerance] = spec_.channels[c];
    const Vec3 size = node.parameters.high - node.parameters.low;
    const auto error = [&](const Vec3& share) {
      const Vec3 uvw = node.parameters.low + share.cwiseProduct(size);
      const Vec3 place = node.piece->frame(voxel_of_mesh_ * evaluator_.geo_and_mat({cell, uvw}, values_));
      return std::abs(value_at(node.piece->polynomials[c], place) - values_[channel]) / tolerance;
    };
    const auto [largest, at] = find_largest(error);
    const bool is_bounded =
        blocks_.is_in_one_patch(cell, node.parameters) || solid_->cell_class(cell) == CellClass::kLine;
    const double allowed =
        (is_bounded ? node.piece->error * (1 + kRoundingOfTheirBounds) : 1) + rounding_of(*solid_, spec_.channels[c]);
    ++finding_.compared;
    finding_.worst = std::max(largest, finding_.worst);
    if (largest <= allowed || ++finding_.failed > 1) return;
    finding_.where = "cell " + std::to_string(cell) + " channel " + solid_->summary().channels[channel].name + ", " +
                     (is_bounded ? "bounded" : "sampled") + " piece from " + vector_text(node.parameters.low) +
                     " of size " + vector_text(size) + ": " + number(largest) + " of the tolerance at " +
                     vector_text(at) + " of it, at most " + number(node.piece->error) + " by itself";
  }

  std::shared_ptr<const LimitSolid> solid_;
  HostileFinding& finding_;
  InterpolationSpec spec_;
  Placement voxel_of_mesh_;
  VoxelBlocks blocks_;
  CellFitter fitter_;
  LimitEvaluator evaluator_;
  std::vector<double> values_;
};

/// Of tiles that are put anywhere.
class TileSearch {
 public:
  TileSearch(const HostileRun& run, HostileFinding& finding)
      : solid_(run.solid),
        finding_(finding),
        spec_(interpolation_spec_of(run.job.job, run.solid->summary().channels)),
        voxel_of_mesh_(voxel_of_mesh(spec_.placement, spec_.grid)),
        fitter_(solid_, spec_),
        evaluator_(*solid_),
        values_(solid_->channel_count()) {}

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
    const LimitCellId cell{static_cast<std::uint32_t>(random.bits() % solid_->cell_count())};
    const Vec3 middle = voxel_of_mesh_ * evaluator_.geo({cell, Vec3::Constant(0.5) + random.in_cube(0.5)});
    const Vec3 half(random.log_between(0.5, 32), random.log_between(0.5, 32), random.log_between(0.5, 32));
    return {middle - half, middle + half};
  }

  void search(const Box3& box) {
    if (solid_->index().is_ambiguous(box.transformed(voxel_of_mesh_.inverse(Eigen::Affine)))) return;
    TileParticles& particles = fitter_.particles();
    particles.clear();
    const TileParticles::Range range = particles.enter(box, kManyVoxels, {});
    if (fitter_.fit(range, box, kManyVoxels, kFewVoxels) != TileFitter::Outcome::kFits) return;
    const std::span<const std::uint32_t> members = particles.members(range);
    for (const std::uint32_t m : members.first(std::min(members.size(), kMostParticles))) {
      for (std::size_t c = 0; c < spec_.channels.size(); ++c) search(box, particles[m], c);
    }
  }

  void search(const Box3& box, const TileParticle& particle, std::size_t c) {
    const auto& [channel, tolerance] = spec_.channels[c];
    const Vec3 size = particle.parameters.high - particle.parameters.low;
    const auto error = [&](const Vec3& share) {
      const Vec3 uvw = particle.parameters.low + share.cwiseProduct(size);
      const Vec3 voxel = voxel_of_mesh_ * evaluator_.geo_and_mat({particle.cell, uvw}, values_);
      if (!box.contains(voxel)) return 0.0;
      return std::abs(value_at(fitter_.polynomials()[c], fitter_.frame()(voxel)) - values_[channel]) / tolerance;
    };
    const double largest = find_largest(error).first;
    ++finding_.compared;
    finding_.worst = std::max(largest, finding_.worst);
    if (largest <= 1 + rounding_of(*solid_, spec_.channels[c]) || ++finding_.failed > 1) return;
    finding_.where = "tile " + vector_text(box.min()) + " to " + vector_text(box.max()) + " channel " +
                     solid_->summary().channels[channel].name + ": " + number(largest) + " of the tolerance in cell " +
                     std::to_string(particle.cell);
  }

  std::shared_ptr<const LimitSolid> solid_;
  HostileFinding& finding_;
  InterpolationSpec spec_;
  Placement voxel_of_mesh_;
  TileFitter fitter_;
  LimitEvaluator evaluator_;
  std::vector<double> values_;
};

}  // namespace

void compare_pieces(const HostileRun& run, HostileFinding& finding) {
  constexpr std::size_t kMostOfVertices = 300, kMostOfOthers = 60;
  constexpr int kTiles = 25;
  const SliceJob& job = run.job.job;
  if (job.material_tolerance == 0) return;
  if (interpolation_spec_of(job, run.solid->summary().channels).channels.empty()) return;
  std::vector<LimitCellId> at_vertices, others;
  for (const LimitCellId cell : run.solid->cells()) {
    (run.solid->cell_class(cell) == CellClass::kVertex ? at_vertices : others).push_back(cell);
  }
  PieceSearch search(run, finding);
  std::mt19937_64 random(run.seed);
  for (std::vector<LimitCellId>* cells : {&at_vertices, &others}) {
    std::shuffle(cells->begin(), cells->end(), random);
    search.search(*cells, cells == &at_vertices ? kMostOfVertices : kMostOfOthers);
  }
  TileSearch(run, finding).search(kTiles, run.seed);
}

}  // namespace ccslice::oracle
