// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/line_residuals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// A dyadic box, often on a side of the cell.
ParamBox random_box(std::mt19937& random) {
  ParamBox box;
  for (int a = 0; a < 3; ++a) {
    const int level = std::uniform_int_distribution<int>(0, 3)(random);
    const double size = std::ldexp(1.0, -level);
    const int last = (1 << level) - 1, at = std::uniform_int_distribution<int>(-last, 2 * last)(random);
    box.low[a] = size * std::clamp(at, 0, last);
    box.high[a] = box.low[a] + size;
  }
  return box;
}

/// In [0,1], often near an end.
Vec3 random_share(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1);
  Vec3 share;
  for (double& s : share) {
    s = std::ldexp(u(random), -std::uniform_int_distribution<int>(0, 12)(random));
    if (u(random) < 0.5) s = 1 - s;
  }
  return share;
}

/// Position and channels.
Eigen::VectorXd sample(LimitEvaluator& evaluator, LimitCellId cell, const ParamBox& box, const Vec3& share) {
  std::vector<double> channels(evaluator.solid().channel_count());
  Eigen::VectorXd all(3 + channels.size());
  all.head<3>() = evaluator.geo_and_mat({cell, box.low + share.cwiseProduct(box.high - box.low)}, channels);
  std::copy(channels.begin(), channels.end(), all.data() + 3);
  return all;
}

double lagrange(std::size_t node, double share) {
  double weight = 1;
  for (std::size_t k = 0; k < kBlockNodes; ++k) {
    if (k != node)
      weight *= (4 * share - static_cast<double>(k)) / (static_cast<double>(node) - static_cast<double>(k));
  }
  return weight;
}

/// What interpolation at the nodes leaves out, by evaluating all of them.
class Interpolated {
 public:
  Interpolated(LimitEvaluator& evaluator, LimitCellId cell, const ParamBox& box)
      : evaluator_(evaluator), cell_(cell), box_(box) {
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      const Vec3 share(n % kBlockNodes, n / kBlockNodes % kBlockNodes, n / kBlockNodes / kBlockNodes);
      nodes_[n] = sample(evaluator, cell, box, share / 4);
    }
  }
  Eigen::VectorXd residual(const Vec3& share) const {
    Eigen::VectorXd left = sample(evaluator_, cell_, box_, share);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      left -= lagrange(n % kBlockNodes, share[0]) * lagrange(n / kBlockNodes % kBlockNodes, share[1]) *
              lagrange(n / kBlockNodes / kBlockNodes, share[2]) * nodes_[n];
    }
    return left;
  }

 private:
  LimitEvaluator& evaluator_;
  LimitCellId cell_;
  ParamBox box_;
  std::array<Eigen::VectorXd, std::tuple_size_v<BlockPoints>> nodes_;
};

/// Of one number: the largest that parts which hold this place allow.
double allowed_at(const BlockResiduals& residuals, const std::vector<BlockResiduals::AlongLine>& number,
                  const Vec3& share) {
  std::array<double, 3> along;
  std::array<std::size_t, 3> interval;
  for (std::size_t a = 0; a < 3; ++a) {
    const double s = share[residuals.box.axis[a]];
    along[a] = 4 * (residuals.box.mirrored[a] ? 1 - s : s);
    interval[a] = std::min<std::size_t>(static_cast<std::size_t>(along[a]), 3);
    along[a] -= static_cast<double>(interval[a]);
  }
  if (number.empty()) return 0;  // Of bicubic schemes nothing is left out.
  double allowed = -1;
  for (const PlanarResiduals::Part& part : residuals.planar->parts()) {
    if (part.i != interval[0] || part.k != interval[1]) continue;
    if (along[0] < part.low[0] || along[0] > part.high[0] || along[1] < part.low[1] || along[1] > part.high[1])
      continue;
    double most = 0;
    for (std::size_t j = 0; j < number.size(); ++j) {
      const Lanes bezier = number[j][interval[2]];
      most += part.most[j] * largest(bezier < 0 ? -bezier : bezier);
    }
    allowed = std::max(allowed, most);
  }
  return allowed;
}

struct Found {
  std::size_t boxes = 0, counts = 0, tight = 0, loose = 0;
};

/// Nothing sampled in the box is larger than it may be.
void expect_bounded(LimitEvaluator& evaluator, LineResiduals& line_residuals, LimitCellId cell, const ParamBox& box,
                    std::mt19937& random, Found& found) {
  BlockResiduals residuals;
  if (!line_residuals.find(cell, box, residuals)) return;
  const Interpolated interpolated(evaluator, cell, box);
  const std::size_t numbers = 3 + residuals.values.size();
  std::vector<double> sampled(numbers, 0.0), bounds(numbers, 0.0);
  for (int n = 0; n < 60; ++n) {
    const Vec3 share = random_share(random);
    const Eigen::VectorXd left = interpolated.residual(share);
    for (std::size_t d = 0; d < numbers; ++d) {
      const double allowed = allowed_at(residuals, d < 3 ? residuals.position[d] : residuals.values[d - 3], share);
      ASSERT_LE(std::abs(left[static_cast<Eigen::Index>(d)]), allowed + 1e-10) << "cell " << cell << " number " << d;
      sampled[d] = std::max(sampled[d], std::abs(left[static_cast<Eigen::Index>(d)]));
      bounds[d] = std::max(bounds[d], allowed);
    }
  }
  ++found.boxes;
  found.counts = std::max(found.counts, residuals.planar->count());
  for (std::size_t d = 0; d < numbers; ++d) {
    if (sampled[d] > 1e-9) ++(bounds[d] <= 12 * sampled[d] ? found.tight : found.loose);
  }
}

TEST(LineResiduals, AreNoLargerThanTheirBounds) {
  std::mt19937 random(5);
  Found in_lines, in_vertices;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    SCOPED_TRACE(name);
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() != 2) continue;
    LimitEvaluator evaluator(*solid);
    LineResiduals residuals(solid->data(), {0, 1});
    std::map<std::pair<CellClass, std::uint32_t>, int> seen;  // A few cells of each neighbourhood.
    for (const LimitCellId cell : solid->cells()) {
      const LimitCell& limit_cell = solid->data().cells[cell];
      if (limit_cell.cell_class == CellClass::kRegular || ++seen[{limit_cell.cell_class, limit_cell.op}] > 2) continue;
      Found& found = limit_cell.cell_class == CellClass::kLine ? in_lines : in_vertices;
      for (int n = 0; n < 4; ++n) expect_bounded(evaluator, residuals, cell, random_box(random), random, found);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(in_lines.boxes, 100u);
  EXPECT_GT(in_vertices.boxes, 100u);
  EXPECT_GE(in_lines.counts, 6u);
  for (const Found& found : {in_lines, in_vertices}) EXPECT_GT(found.tight, 4 * found.loose) << found.loose;
}

TEST(LineResiduals, OfBoxesAcrossSubCellsAreNotKnown) {
  const auto solid = prepare_solid(oracle::tiny_mesh("plate_4x4x1"));
  LineResiduals line_residuals(solid->data(), {});
  BlockResiduals residuals;
  std::size_t vertex_cells = 0;
  for (const LimitCellId cell : solid->cells()) {
    const CellClass cell_class = solid->cell_class(cell);
    EXPECT_EQ(line_residuals.find(cell, {}, residuals), cell_class == CellClass::kLine) << cell;
    vertex_cells += cell_class == CellClass::kVertex;
  }
  EXPECT_GT(vertex_cells, 0u);
}

}  // namespace
}  // namespace ccslice
