// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/cell_fitter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/limit/solid_data.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using Kind = CellNode::Kind;
using Parts = std::vector<CellNode>;
using Function = std::function<double(const Vec3&)>;

constexpr std::uint32_t kSeed = 20261123;

/// 3 x 3 x 3 cubes of 10 mm, exactly: edges and corners are sharp.
ControlMesh sharp_box(double jitter_mm = 0) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::jitter(mesh, jitter_mm, kSeed);
  return mesh;
}

void grade(ControlMesh& mesh, const std::vector<Function>& channels) {
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  for (std::size_t c = 0; c < channels.size(); ++c) mesh.channel_names.push_back("channel " + std::to_string(c));
  for (const Vec3& p : mesh.positions) {
    for (const Function& channel : channels) mesh.channel_values.push_back(static_cast<float>(channel(p)));
  }
}

Function noise(std::uint32_t seed) {
  return [random = std::mt19937(seed)](const Vec3&) mutable {
    return std::uniform_real_distribution<double>(0, 1)(random);
  };
}

Vec3 random_in(const ParamBox& box, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  const Vec3 at(share(random), share(random), share(random));
  return box.low + at.cwiseProduct(box.high - box.low);
}

/// The n-th of 5 x 5 x 5 nodes, first axis first.
Vec3 node_at(const ParamBox& box, std::size_t n) {
  const Vec3 share(static_cast<double>(n % 5), static_cast<double>(n / 5 % 5), static_cast<double>(n / 25));
  return box.low + (share / 4).cwiseProduct(box.high - box.low);
}

/// How many times errors grow at this share of the thickness beyond: the fourth Chebyshev polynomial at 1 + 2 share.
double grown_by(double share) { return std::cosh(4 * std::acosh(1 + 2 * share)); }

double volume(const ParamBox& box) { return (box.high - box.low).prod(); }

class CellFitterTest : public testing::Test {
 protected:
  struct Options {
    Vec3 pitch_mm = {0.4, 0.5, 0.3};
    double tolerance = 1e-3;
    double outside_mm = 1e-5;
  };

  void take(ControlMesh mesh, const std::vector<Function>& channels, const Options& options) {
    grade(mesh, channels);
    solid_ = LimitSolid::prepare(mesh);
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

  /// Half way between the first two and the last two of five nodes of each edge, as a share of the tolerance.
  double worst_on_edges(LimitCellId cell, const CellNode& part) {
    double worst = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 8; ++k) {
        Vec3 share;
        share[axis] = k % 2 == 0 ? 0.125 : 0.875;
        share[(axis + 1) % 3] = k / 2 % 2;
        share[(axis + 2) % 3] = k / 4;
        const auto& [low, high] = part.parameters;
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

  Solid solid_;
  InterpolationSpec spec_;
  std::optional<LimitEvaluator> evaluator_;
  std::vector<double> channels_;
  Placement voxel_of_mesh_;
};

/// The children of each halved part are its box halved, each half once; all others have none.
void expect_halves_tile(const Parts& parts) {
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

TEST_F(CellFitterTest, AGradientOverACubeIsOnePieceThatReproducesIt) {
  // Exact as floats.
  take(sharp_box(), {[](const Vec3& p) { return p.x() / 8 - p.y() / 16 + p.z() / 64; }, [](const Vec3&) { return 3; }});
  std::mt19937 random(kSeed);
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    ASSERT_EQ(parts.size(), 1u);
    ASSERT_EQ(parts[0].kind, Kind::kPiece);
    const CellPiece& piece = *parts[0].piece;
    // Far outside of the cell, too: there are no terms of higher degree. A coordinate of the frame is 5 mm.
    const double in_middle = value_at(piece.polynomials[0], Vec3::Zero());
    for (int k = 0; k < 20; ++k) {
      const Vec3 place = random_in({Vec3::Constant(-10), Vec3::Constant(10)}, random);
      const double expected = in_middle + Vec3(5.0 / 8, -5.0 / 16, 5.0 / 64).dot(place);
      EXPECT_NEAR(value_at(piece.polynomials[0], place), expected, 1e-5);
      EXPECT_NEAR(value_at(piece.polynomials[1], place), 3, 1e-5);
    }
    EXPECT_LT(piece.error, 1e-6);
    EXPECT_NEAR(piece.reach, std::min(0.1 * 10 / 0.4, 8.0), 1e-9);
    EXPECT_EQ(piece.at_boundary, solid_->data().cells[cell].boundary_sides != 0);
    for (int k = 0; k < 20; ++k) {
      const Vec3 uvw = random_in({}, random);
      EXPECT_LE(error_at(cell, piece, uvw), piece.error);
      EXPECT_LT((piece.parameters(voxel_at(cell, uvw)) - uvw).norm(), 1e-12);
    }
  }
}

TEST_F(CellFitterTest, ACellsParametersStayWithinTheCell) {
  const ParameterMap map{Vec3(10, 20, 30), Vec3::Constant(0.5), 0.1 * Mat3::Identity()};
  EXPECT_EQ(map(Vec3(10, 20, 30)), Vec3::Constant(0.5));
  EXPECT_LT((map(Vec3(12, 19, 30)) - Vec3(0.7, 0.4, 0.5)).norm(), 1e-15);
  EXPECT_EQ(map(Vec3(16, 14, 30)), Vec3(1, 0, 0.5));
}

// Regular cells, cells beside irregular lines and vertices, at the boundary and not; tolerances from loose to tight.
TEST_F(CellFitterTest, PiecesKeepTheToleranceAtRandomParameters) {
  struct Case {
    std::string name;
    ControlMesh mesh;
  };
  std::vector<Case> cases{{"box", sharp_box(1)}};
  for (const int sectors : {3, 5, 6}) {
    cases.push_back({"fan of " + std::to_string(sectors), oracle::fan_mesh(sectors, 2, 2)});
    oracle::jitter(cases.back().mesh, 0.8, kSeed);
  }
  for (const char* name : {"vertex_link_icosahedron", "boundary_edge_3_hexes", "sharp_2_hexes_turn"}) {
    cases.push_back({name, oracle::tiny_mesh(name)});
  }
  const auto smooth = [](const Vec3& p) { return 0.5 + 0.2 * std::sin(0.1 * p.x()) * std::cos(0.08 * p.y()); };
  std::mt19937 random(kSeed);
  for (const auto& [name, mesh] : cases) {
    for (const double tolerance : {0.05, 5e-3}) {
      SCOPED_TRACE(name + ", tolerance " + std::to_string(tolerance) + ", seed " + std::to_string(kSeed));
      take(mesh, {smooth, noise(3)}, {.tolerance = tolerance});
      double in_pieces = 0;
      for (LimitCellId cell; cell < solid_->cell_count(); cell += 5) {
        const Parts parts = examined(cell);
        expect_halves_tile(parts);
        for (const CellNode& part : parts) {
          const bool regular = solid_->cell_class(cell) == CellClass::kRegular;
          for (int k = 0; k < 40; ++k) {
            const Vec3 uvw = random_in(part.parameters, random), voxel = voxel_at(cell, uvw);
            ASSERT_TRUE(part.bounds.contains(voxel));
            if (part.kind != Kind::kPiece) continue;
            ASSERT_LE(error_at(cell, *part.piece, uvw), regular ? part.piece->error : 1) << cell;
          }
          if (part.kind == Kind::kPiece) in_pieces += volume(part.parameters);
        }
      }
      EXPECT_GT(in_pieces, 0.5 * (solid_->cell_count() / 5)) << "of " << solid_->cell_count() / 5;
    }
  }
}

TEST_F(CellFitterTest, PiecesAreMadeOfTheirNodes) {
  ControlMesh mesh = oracle::fan_mesh(5, 2, 2);
  oracle::jitter(mesh, 0.5, kSeed);
  take(mesh, {noise(4)}, {.tolerance = 0.03});
  std::size_t pieces = 0;
  for (const LimitCellId cell : solid_->cells()) {
    for (const CellNode& part : examined(cell)) {
      if (part.kind != Kind::kPiece) continue;
      ++pieces;
      const CellPiece& piece = *part.piece;
      const BlockPoints nodes = nodes_of(cell, part.parameters);
      Box3 box;
      for (std::size_t n = 0; n < nodes.size(); ++n) {
        ASSERT_LT((piece.points[n] - nodes[n]).norm(), 1e-9);
        box.extend(nodes[n]);
      }
      EXPECT_LT((piece.frame(box.min()) + Vec3::Ones()).norm(), 1e-9);
      EXPECT_LT((piece.frame(box.max()) - Vec3::Ones()).norm(), 1e-9);
      const BlockShape shape = shape_of(nodes);
      EXPECT_EQ(shape.bent_axes(), 0u);
      EXPECT_EQ(piece.step, shape.step);
      // Exact in the middle, and to first order about it.
      const Vec3 size = part.parameters.high - part.parameters.low, middle = part.parameters.low + 0.5 * size;
      EXPECT_LT((piece.parameters(nodes[62]) - middle).norm(), 1e-9);
      for (const std::size_t n : {61u, 63u, 57u, 67u, 37u, 87u}) {
        const Vec3 share(static_cast<double>(n % 5), static_cast<double>(n / 5 % 5), static_cast<double>(n / 25));
        const Vec3 off = piece.parameters(nodes[n]) - (part.parameters.low + 0.25 * share.cwiseProduct(size));
        EXPECT_LT(off.cwiseQuotient(size).norm(), 0.1);
      }
    }
  }
  EXPECT_GT(pieces, 20u);
}

// Most of a ring, of three cells.
TEST_F(CellFitterTest, HalvesWhatBulgesHoweverWellCubicsFit) {
  ControlMesh mesh = sharp_box();
  for (Vec3& p : mesh.positions) {
    const double angle = p.x() / 7, radius = 30 + 0.4 * p.y();
    p = Vec3(radius * std::cos(angle), radius * std::sin(angle), p.z());
  }
  take(mesh, {[](const Vec3&) { return 1; }});
  std::size_t halved = 0;
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    expect_halves_tile(parts);
    for (const CellNode& part : parts) {
      const unsigned bent = shape_of(nodes_of(cell, part.parameters)).bent_axes();
      EXPECT_EQ(part.kind, bent == 0 ? Kind::kPiece : Kind::kHalved);
      if (part.kind != Kind::kHalved) continue;
      ++halved;
      EXPECT_EQ(part.end_child - part.first_child, 1u << std::popcount(bent));
    }
  }
  EXPECT_GT(halved, 0u);
}

// Errors of the fifth degree don't show at five nodes.
TEST_F(CellFitterTest, PiecesBesideIrregularLinesAreGoodBetweenTheirNodesToo) {
  std::size_t pieces = 0;
  for (const char* name : {"vertex_link_icosahedron", "edge_valence_8", "vertex_link_gyroelongated_6"}) {
    for (const std::uint32_t seed : {1u, 2u, 3u}) {
      for (const double tolerance : {0.2, 0.1, 0.05, 0.02}) {
        take(oracle::tiny_mesh(name), {noise(seed)}, {.pitch_mm = Vec3::Constant(0.1), .tolerance = tolerance});
        const VoxelBlocks blocks(*solid_, spec_);
        for (LimitCellId cell; cell < solid_->cell_count(); cell += 3) {
          for (const CellNode& part : examined(cell)) {
            if (part.kind != Kind::kPiece || blocks.is_in_one_patch(cell, part.parameters)) continue;
            ++pieces;
            EXPECT_LE(worst_on_edges(cell, part), 0.7 + 1e-9) << name << ", cell " << cell;
          }
        }
      }
    }
  }
  EXPECT_GT(pieces, 100u);
}

// Where there is no bound, nodes and places between them are all that is known.
TEST_F(CellFitterTest, TheErrorOfAPieceBesideAVertexIsNoLessThanAtItsSamples) {
  std::size_t pieces = 0;
  for (const char* name : {"vertex_link_icosahedron", "vertex_link_gyroelongated_6"}) {
    for (const double tolerance : {0.2, 0.1, 0.05, 0.02}) {
      take(oracle::tiny_mesh(name), {noise(1)}, {.pitch_mm = Vec3::Constant(0.1), .tolerance = tolerance});
      const VoxelBlocks blocks(*solid_, spec_);
      for (const LimitCellId cell : solid_->cells()) {
        if (solid_->cell_class(cell) != CellClass::kVertex) continue;
        for (const CellNode& part : examined(cell)) {
          if (part.kind != Kind::kPiece || blocks.is_in_one_patch(cell, part.parameters)) continue;
          ++pieces;
          EXPECT_LE(worst_on_edges(cell, part), part.piece->error + 1e-9) << name << ", cell " << cell;
          // An error grows that much as far off as triangles miss the faces.
          const double miss = shape_of(nodes_of(cell, part.parameters)).miss;
          const double grown = grown_by(miss) * worst_at_nodes(cell, part);
          EXPECT_LE(grown, part.piece->error + 1e-9) << name << ", cell " << cell;
          EXPECT_LE(part.piece->error, 1);
        }
      }
    }
  }
  EXPECT_GT(pieces, 100u);
}

// A channel that rises and falls from vertex to vertex along x and y alone.
TEST_F(CellFitterTest, HalvesAlongAxesThatHelpAlone) {
  const auto chessboard = [](const Vec3& p) { return std::lround((p.x() + p.y()) / 10) % 2; };
  take(sharp_box(), {chessboard}, {.pitch_mm = Vec3::Constant(0.2), .tolerance = 1e-3});
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    expect_halves_tile(parts);
    EXPECT_EQ(parts[0].kind, Kind::kHalved);
    Vec3 least = Vec3::Constant(50);
    for (const CellNode& part : parts) {
      Box3 place;
      for (const Vec3& point : nodes_of(cell, part.parameters)) place.extend(point);
      least = least.cwiseMin(place.diagonal());
    }
    EXPECT_LT(least.x(), 26) << cell;
    EXPECT_LT(least.y(), 26) << cell;
    EXPECT_NEAR(least.z(), 50, 1e-9) << cell;
  }
}

// Faces of cubes don't bulge.
TEST_F(CellFitterTest, TheErrorOfAPieceGrowsToItsToleranceWithinItsReach) {
  std::size_t within = 0, at_most = 0;
  for (const double tolerance : {0.02, 0.5, 2.0}) {
    take(sharp_box(), {noise(5)}, {.pitch_mm = Vec3::Constant(0.05), .tolerance = tolerance});
    for (const LimitCellId cell : solid_->cells()) {
      for (const CellNode& part : examined(cell)) {
        if (part.kind != Kind::kPiece) continue;
        const double columns = 2 / part.piece->frame.scale.x(), most = std::min(8.0, 0.1 * columns);
        // By the fourth Chebyshev polynomial beyond [-1, 1].
        const double grown_error = part.piece->error * grown_by(part.piece->reach / columns);
        if (std::abs(part.piece->reach - most) < 1e-9) {
          ++at_most;
          EXPECT_LE(grown_error, 1 + 1e-9);
        } else {
          ++within;
          EXPECT_LT(part.piece->reach, most);
          EXPECT_NEAR(grown_error, 1, 1e-9);
        }
      }
    }
  }
  EXPECT_GT(within, 10u);
  EXPECT_GT(at_most, 10u);
}

TEST_F(CellFitterTest, PiecesHaveNoMoreRowsThanTrianglesOfRowsAllow) {
  take(sharp_box(), {[](const Vec3& p) { return p.x(); }}, {.pitch_mm = {0.1, 10.0 / 1030, 0.1}});
  const Parts parts = examined(LimitCellId{0});
  ASSERT_EQ(parts.size(), 9u);  // Halved along all axes.
  for (std::size_t k = 1; k < parts.size(); ++k) {
    ASSERT_EQ(parts[k].kind, Kind::kPiece);
    EXPECT_NEAR(2 / parts[k].piece->frame.scale.y(), 515, 1e-6);
  }
  take(sharp_box(), {[](const Vec3& p) { return p.x(); }}, {.pitch_mm = {0.1, 10.0 / 1020, 0.1}});
  EXPECT_EQ(examined(LimitCellId{0}).size(), 1u);
}

/// Of cubes of n^3 voxels.
class PartsOfFewVoxels : public CellFitterTest {
 protected:
  Parts of(double n, double tolerance) {
    take(sharp_box(), {noise(6)}, {.pitch_mm = Vec3::Constant(10 / n), .tolerance = tolerance});
    return examined(LimitCellId{13});
  }
};

TEST_F(PartsOfFewVoxels, AreHolesWithAMapOfTheirParametersIfNoCubicFits) {
  std::mt19937 random(kSeed);
  for (const double n : {3.9, 9.0, 10.0}) {
    const Parts parts = of(n, 1e-9);
    ASSERT_EQ(parts.size(), 1u);
    ASSERT_EQ(parts[0].kind, Kind::kHole);
    ASSERT_TRUE(parts[0].map);
    for (int k = 0; k < 10; ++k) {
      const Vec3 uvw = random_in({}, random);
      EXPECT_LT(((*parts[0].map)(voxel_at(LimitCellId{13}, uvw)) - uvw).norm(), 1e-12);
    }
  }
}

TEST_F(PartsOfFewVoxels, HaveNoMapIfTheyAreTooManyToInvertOneByOne) {
  const Parts parts = of(10.1, 1e-9);  // 1030 voxels.
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].kind, Kind::kHole);
  EXPECT_FALSE(parts[0].map);
}

TEST_F(PartsOfFewVoxels, ArePiecesIfACubicFits) {
  const Parts parts = of(3.9, 1);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].kind, Kind::kPiece);
}

TEST_F(PartsOfFewVoxels, AreHalvedFromSixtyFourVoxelsOn) {
  // The tolerance that just isn't kept: one piece at twice of it.
  double tolerance = 1;
  while (of(5, tolerance)[0].kind == Kind::kPiece) tolerance /= 1.5;
  EXPECT_EQ(of(3.99, tolerance)[0].kind, Kind::kHole);
  EXPECT_EQ(of(4.01, tolerance)[0].kind, Kind::kHalved);
  EXPECT_EQ(of(5, tolerance)[0].kind, Kind::kHalved);
  // Of a far tighter one that their parts couldn't keep either.
  EXPECT_EQ(of(5, tolerance / 4)[0].kind, Kind::kHalved);
  EXPECT_EQ(of(5, tolerance / 64)[0].kind, Kind::kHole);
}

TEST_F(CellFitterTest, WhatFoldsIsAHole) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  take(mesh, {[](const Vec3& p) { return p.x() / 64; }});
  ASSERT_GT(solid_->summary().folding_cells, 0u);
  std::mt19937 random(kSeed);
  std::size_t folded = 0, pieces = 0, halved = 0;
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    expect_halves_tile(parts);
    for (const CellNode& part : parts) {
      pieces += part.kind == Kind::kPiece;
      const bool ambiguous = is_ambiguous(cell, part.parameters);
      const double voxels = shape_of(nodes_of(cell, part.parameters)).voxels;
      if (ambiguous) {
        ASSERT_NE(part.kind, Kind::kPiece);
        EXPECT_EQ(part.kind == Kind::kHole, voxels <= 2048) << voxels;
        EXPECT_FALSE(part.map);
        if (part.kind == Kind::kHalved) {
          ++halved;
          EXPECT_EQ(part.end_child - part.first_child, 8u);
        }
      }
      for (int k = 0; k < 10; ++k) {
        const Vec3 uvw = random_in(part.parameters, random);
        if (evaluator_->sample({cell, uvw}).jacobian.determinant() > 0) continue;
        ++folded;
        ASSERT_NE(part.kind, Kind::kPiece) << "seed " << kSeed << ", cell " << cell << " at " << uvw.transpose();
      }
    }
  }
  EXPECT_GT(folded, 10u);
  EXPECT_GT(pieces, 10u);
  EXPECT_GT(halved, 2u);
}

// In the cubes of a box, what is beyond the boundary is beyond a plane.
TEST_F(CellFitterTest, PiecesAtASteepBoundaryKnowWhatIsBeyondIt) {
  take(sharp_box(), {[](const Vec3& p) { return p.x() / 8; }}, {.tolerance = 1e-3, .outside_mm = 0.01});
  std::mt19937 random(kSeed);
  for (const LimitCellId cell : solid_->cells()) {
    const Parts parts = examined(cell);
    ASSERT_EQ(parts.size(), 1u);
    const CellPiece& piece = *parts[0].piece;
    const unsigned sides = solid_->data().cells[cell].boundary_sides;
    std::size_t k = 0;
    for (int side = 0; side < 6; ++side) {
      if (!(sides >> side & 1)) continue;
      ASSERT_LT(k, piece.beyond.size());
      for (int n = 0; n < 20; ++n) {
        const Vec3 uvw = random_in({Vec3::Constant(-0.5), Vec3::Constant(1.5)}, random);
        // Cells of this box are cubes, so parameters are shares of it, outside too.
        const Vec3 low = voxel_at(cell, Vec3::Zero());
        Mat3 axes;
        for (int a = 0; a < 3; ++a) axes.col(a) = voxel_at(cell, Vec3::Unit(a)) - low;
        const double share = uvw[side / 2], beyond = side % 2 == 1 ? share - 1 : -share;
        const double value = value_at(piece.beyond[k], piece.frame(low + axes * uvw));
        EXPECT_NEAR(value, beyond + 1e-6, 1e-9) << "cell " << cell << ", side " << side;
      }
      ++k;
    }
    EXPECT_EQ(k, piece.beyond.size());
  }
}

TEST_F(CellFitterTest, WhatIsBeyondCountsWhereChannelsChangeByTheToleranceOutside) {
  const auto gradient = [](const Vec3& p) { return (0.75 * p.x() - p.z()) / 4; };  // 5/16 per mm.
  for (const auto& [share, steep] : {std::pair(0.99, false), {1.01, true}}) {
    take(sharp_box(), {[](const Vec3&) { return 1; }, gradient},
         {.tolerance = 1e-3, .outside_mm = share * 1e-3 / (5.0 / 16)});
    for (const LimitCellId cell : {LimitCellId{0}, LimitCellId{1}, LimitCellId{4}, LimitCellId{13}, LimitCellId{26}}) {
      const unsigned sides = solid_->data().cells[cell].boundary_sides;
      EXPECT_EQ(examined(cell)[0].piece->beyond.size(), steep ? std::popcount(sides) : 0) << cell;
    }
  }
}

TEST_F(CellFitterTest, BeyondIsPositiveOnAndOutsideOfBentBoundaries) {
  take(sharp_box(1), {[](const Vec3& p) { return p.x() / 2; }, noise(7)}, {.tolerance = 0.02, .outside_mm = 0.1});
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t faces = 0, inner = 0;
  for (LimitCellId cell; cell < solid_->cell_count(); cell += 2) {
    const unsigned sides = solid_->data().cells[cell].boundary_sides;
    for (const CellNode& part : examined(cell)) {
      if (part.kind != Kind::kPiece) continue;
      std::size_t k = 0;
      for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const double place = side % 2;
        const double end = side % 2 == 1 ? part.parameters.high[axis] : part.parameters.low[axis];
        if (!(sides >> side & 1) || end != place) continue;
        ASSERT_LT(k, part.piece->beyond.size());
        const CubicPolynomial& beyond = part.piece->beyond[k++];
        ++faces;
        for (int n = 0; n < 20; ++n) {
          Vec3 uvw = random_in(part.parameters, random);
          const double depth = std::abs(uvw[axis] - place) / (part.parameters.high - part.parameters.low)[axis];
          if (depth > 0.3) {
            EXPECT_LE(value_at(beyond, part.piece->frame(voxel_at(cell, uvw))), 0) << depth;
          }
          uvw[axis] = place;
          const Vec3 outwards =
              (side % 2 == 1 ? 1 : -1) * evaluator_->sample({cell, uvw}).jacobian.col(axis).normalized();
          const Vec3 voxel = voxel_at(cell, uvw) + voxel_of_mesh_.linear() * (0.1 * unit(random) * outwards);
          EXPECT_GT(value_at(beyond, part.piece->frame(voxel_at(cell, uvw))), 0) << "seed " << kSeed;
          EXPECT_GT(value_at(beyond, part.piece->frame(voxel)), 0) << "seed " << kSeed;
        }
      }
      EXPECT_EQ(part.piece->at_boundary, k > 0);
      EXPECT_EQ(part.piece->beyond.size(), k);
      inner += k == 0;
    }
  }
  EXPECT_GT(faces, 30u);
  EXPECT_GT(inner, 0u);
}

// To the bit: workers share parts.
TEST_F(CellFitterTest, PartsAreTheSameInWhateverOrderTheyAreExamined) {
  ControlMesh mesh = oracle::tiny_mesh("vertex_link_icosahedron");
  take(mesh, {noise(8)}, {.tolerance = 5e-3});
  const auto by_box = [](const CellNode& a, const CellNode& b) {
    const auto key = [](const CellNode& part) {
      const auto& [low, high] = part.parameters;
      return std::array{low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
    };
    return key(a) < key(b);
  };
  std::mt19937 random(kSeed);
  CellFitter busy(solid_, spec_);
  std::size_t pieces = 0;
  for (LimitCellId cell; cell < solid_->cell_count(); cell += 11) {
    Parts expected = examined(cell), parts(1), elsewhere(1);
    parts[0].bounds = Box3(Vec3::Constant(-1e6), Vec3::Constant(1e6));
    elsewhere[0].bounds = parts[0].bounds;
    busy.examine(LimitCellId{(cell + 1) % solid_->cell_count()}, elsewhere, 0);
    std::vector<std::uint32_t> unknown{0};
    while (!unknown.empty()) {
      std::swap(unknown[random() % unknown.size()], unknown.back());
      const std::uint32_t part = unknown.back();
      unknown.pop_back();
      const auto before = static_cast<std::uint32_t>(parts.size());
      busy.examine(cell, parts, part);
      for (std::uint32_t k = before; k < parts.size(); ++k) unknown.push_back(k);
    }
    std::sort(parts.begin(), parts.end(), by_box);
    std::sort(expected.begin(), expected.end(), by_box);
    ASSERT_EQ(parts.size(), expected.size()) << cell;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      ASSERT_EQ(parts[k].kind, expected[k].kind);
      EXPECT_EQ(parts[k].bounds.min(), expected[k].bounds.min());
      EXPECT_EQ(parts[k].bounds.max(), expected[k].bounds.max());
      if (!parts[k].piece) continue;
      ++pieces;
      EXPECT_EQ(parts[k].piece->polynomials, expected[k].piece->polynomials);
      EXPECT_EQ(parts[k].piece->reach, expected[k].piece->reach);
      EXPECT_EQ(parts[k].piece->beyond, expected[k].piece->beyond);
    }
  }
  EXPECT_GT(pieces, 20u);
}

}  // namespace
}  // namespace ccslice
