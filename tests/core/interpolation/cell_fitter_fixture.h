// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells of small meshes, examined to their last part, and what their pieces miss.

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/interpolation/pieces/cell_fitter.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {

class CellFitterTest : public testing::Test {
 protected:
  using Kind = CellNode::Kind;
  using Parts = std::vector<CellNode>;
  using Function = std::function<double(const Vec3&)>;

  static constexpr std::uint32_t kSeed = 20261123;

  /// 3 x 3 x 3 cubes of 10 mm, exactly: edges and corners are sharp.
  static ControlMesh sharp_box(double jitter_mm = 0) {
    ControlMesh mesh = oracle::box_mesh(3, 3, 3);
    oracle::sharpen_by_cells(mesh, 1);
    oracle::jitter(mesh, jitter_mm, kSeed);
    return mesh;
  }

  static void grade(ControlMesh& mesh, const std::vector<Function>& channels) {
    mesh.channel_names.clear();
    mesh.channel_values.clear();
    for (std::size_t c = 0; c < channels.size(); ++c) mesh.channel_names.push_back("channel " + std::to_string(c));
    for (const Vec3& p : mesh.positions) {
      for (const Function& channel : channels) mesh.channel_values.push_back(static_cast<float>(channel(p)));
    }
  }

  static Function noise(std::uint32_t seed) {
    return [random = std::mt19937(seed)](const Vec3&) mutable {
      return std::uniform_real_distribution<double>(0, 1)(random);
    };
  }

  static Vec3 random_in(const ParamBox& box, std::mt19937& random) {
    std::uniform_real_distribution<double> share(0, 1);
    const Vec3 at(share(random), share(random), share(random));
    return box.low + at.cwiseProduct(box.high - box.low);
  }

  /// The n-th of 5 x 5 x 5 nodes, first axis first.
  static Vec3 node_at(const ParamBox& box, std::size_t n) {
    const Vec3 share(static_cast<double>(n % 5), static_cast<double>(n / 5 % 5), static_cast<double>(n / 25));
    return box.low + (share / 4).cwiseProduct(box.high - box.low);
  }

  /// How many times errors grow at this share of the thickness beyond: the fourth Chebyshev polynomial at 1 + 2 share.
  static double grown_by(double share) { return std::cosh(4 * std::acosh(1 + 2 * share)); }

  /// Tells which sides of the box are on its cell's, a bit each.
  static unsigned own_sides(const ParamBox& box) {
    unsigned sides = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      sides |= (box.low[axis] == 0 ? 1u : 0u) << (2 * axis) | (box.high[axis] == 1 ? 2u : 0u) << (2 * axis);
    }
    return sides;
  }

  static double volume(const ParamBox& box) { return (box.high - box.low).prod(); }

  struct Options {
    Vec3 pitch_mm = {0.4, 0.5, 0.3};
    double tolerance = 1e-3;
    double outside_mm = 1e-5;
  };

  void take(ControlMesh mesh, const std::vector<Function>& channels, const Options& options) {
    grade(mesh, channels);
    solid_ = prepare_solid(mesh);
    evaluator_.emplace(*solid_);
    GridRequest request;
    request.pitch = {options.pitch_mm.x(), options.pitch_mm.y(), options.pitch_mm.z()};
    spec_.grid = plan_grid(*solid_, spec_.placement, request);
    spec_.outside_mm = options.outside_mm;
    spec_.channels.clear();
    for (std::uint32_t c = 0; c < channels.size(); ++c) spec_.channels.push_back({c, options.tolerance});
    channels_.resize(channels.size());
    voxel_of_mesh_ = voxel_of_mesh(spec_.placement, spec_.grid);
  }
  void take(const ControlMesh& mesh, const std::vector<Function>& channels) { take(mesh, channels, Options{}); }

  /// Of a cell that may lie anywhere, none of them unknown.
  Parts examined(LimitCellId cell) {
    CellFitter fitter(solid_, spec_);
    Parts parts(1);
    parts[0].bounds = Box3(Vec3::Constant(-1e6), Vec3::Constant(1e6));
    for (std::uint32_t part = 0; part < parts.size(); ++part) fitter.examine(cell, parts, part);
    return parts;
  }

  /// Fills channels_.
  Vec3 voxel_at(LimitCellId cell, const Vec3& uvw) {
    return voxel_of_mesh_ * evaluator_->geo_and_mat({cell, uvw}, channels_);
  }

  /// At a parameter, of a piece's polynomials, as a share of the tolerance.
  double error_at(LimitCellId cell, const CellPiece& piece, const Vec3& uvw) {
    const Vec3 place = piece.frame(voxel_at(cell, uvw));
    double worst = 0;
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const double error = std::abs(value_at(piece.polynomials[c], place) - channels_[c]);
      worst = std::max(worst, error / spec_.channels[c].tolerance);
    }
    return worst;
  }

  /// On edges, a 32nd and three of them from their ends, and on faces, three from both sides; as a share of the
  /// tolerance.
  double worst_between_nodes(LimitCellId cell, const CellNode& part) {
    const auto& [low, high] = part.parameters;
    double worst = 0;
    for (const Vec3& corner : {Vec3(1, 0, 0), Vec3(3, 0, 0), Vec3(0, 3, 3)}) {
      for (int place = 0; place < 24; ++place) {
        Vec3 share;
        for (int a = 0; a < 3; ++a) {
          const double near = corner[(a + place / 8) % 3] / 32;
          share[a] = place >> a & 1 ? 1 - near : near;
        }
        worst = std::max(worst, error_at(cell, *part.piece, low + share.cwiseProduct(high - low)));
      }
    }
    return worst;
  }

  /// As a share of the tolerance.
  double worst_at_nodes(LimitCellId cell, const CellNode& part) {
    double worst = 0;
    for (std::size_t n = 0; n < kBlockPoints; ++n) {
      worst = std::max(worst, error_at(cell, *part.piece, node_at(part.parameters, n)));
    }
    return worst;
  }

  BlockPoints nodes_of(LimitCellId cell, const ParamBox& box) {
    BlockPoints points;
    for (std::size_t n = 0; n < kBlockPoints; ++n) points[n] = voxel_at(cell, node_at(box, n));
    return points;
  }

  bool is_ambiguous(LimitCellId cell, const ParamBox& box) {
    Box3 place;
    for (const Vec3& point : nodes_of(cell, box)) place.extend(point);
    return solid_->data().is_ambiguous(place.transformed(voxel_of_mesh_.inverse(Eigen::Affine)));
  }

  /// The children of each halved part are its box halved, each half once; all others have none.
  static void expect_halves_tile(const Parts& parts) {
    double sum = 0;
    for (const CellNode& part : parts) {
      EXPECT_NE(part.kind, Kind::kUnknown);
      EXPECT_EQ(part.kind == Kind::kPiece, part.piece != nullptr);
      EXPECT_FALSE(part.map && part.kind != Kind::kHole);
      const std::uint32_t children = part.end_child - part.first_child;
      if (part.kind != Kind::kHalved) {
        EXPECT_EQ(children, 0u);
        sum += volume(part.parameters);
        continue;
      }
      ASSERT_LE(part.end_child, parts.size());
      EXPECT_TRUE(children == 2 || children == 4 || children == 8) << children;
      double in_children = 0;
      for (std::uint32_t child = part.first_child; child < part.end_child; ++child) {
        const ParamBox& half = parts[child].parameters;
        in_children += volume(half);
        for (int a = 0; a < 3; ++a) {
          const double low = part.parameters.low[a], high = part.parameters.high[a], middle = 0.5 * (low + high);
          EXPECT_TRUE((half.low[a] == low && (half.high[a] == middle || half.high[a] == high)) ||
                      (half.low[a] == middle && half.high[a] == high));
        }
        for (std::uint32_t other = part.first_child; other < child; ++other) {
          EXPECT_FALSE(half.low == parts[other].parameters.low && half.high == parts[other].parameters.high);
        }
        EXPECT_TRUE(part.bounds.contains(parts[child].bounds));
      }
      EXPECT_EQ(in_children, volume(part.parameters));
    }
    EXPECT_EQ(sum, 1);
  }

  Solid solid_;
  InterpolationSpec spec_;
  std::optional<LimitEvaluator> evaluator_;
  std::vector<double> channels_;
  Placement voxel_of_mesh_;
};

}  // namespace ccslice
