// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/cell_fitter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/core/interpolation/cell_fitter_fixture.h"

namespace ccslice {
namespace {

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
            EXPECT_LE(worst_between_nodes(cell, part), 0.7 + 1e-9) << name << ", cell " << cell;
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
          EXPECT_LE(worst_between_nodes(cell, part) / 0.75, part.piece->error + 1e-9) << name << ", cell " << cell;
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

/// Of a cell in one patch, of so many columns, rows and layers.
class PartsOfFewVoxels : public CellFitterTest {
 protected:
  Parts of(const Vec3& voxels, double tolerance, std::size_t channels = 1) {
    take(sharp_box(), std::vector(channels, noise(6)),
         {.pitch_mm = 10 * voxels.cwiseInverse(), .tolerance = tolerance});
    return examined(LimitCellId{13});
  }
  Parts of(double n, double tolerance) { return of(Vec3::Constant(n), tolerance); }
};

TEST_F(PartsOfFewVoxels, AreHolesWithAMapOfTheirParametersIfNoCubicFits) {
  std::mt19937 random(kSeed);
  for (const double n : {3.9, 10.0, 35.0}) {
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

TEST_F(PartsOfFewVoxels, ArePiecesIfACubicFits) {
  const Parts parts = of(3.9, 1);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].kind, Kind::kPiece);
}

TEST_F(PartsOfFewVoxels, AreHalvedIfTheirPiecesTakeLessThanInvertingTheirRows) {
  // The tolerance that just isn't kept: one piece at 1.1 of it.
  double tolerance = 1;
  while (of(12, tolerance)[0].kind == Kind::kPiece) tolerance /= 1.1;
  EXPECT_EQ(of(3.9, tolerance)[0].kind, Kind::kHole);
  EXPECT_EQ(of(4.2, tolerance)[0].kind, Kind::kHalved);
  // A piece takes as long as 14 rows. Those of a third of the voxels keep a fifth of the tolerance,
  EXPECT_EQ(of(5, tolerance / 5)[0].kind, Kind::kHole);
  EXPECT_EQ(of(8, tolerance / 5)[0].kind, Kind::kHalved);
  // and those of a twelfth a 25th.
  EXPECT_EQ(of(10, tolerance / 25)[0].kind, Kind::kHole);
  EXPECT_EQ(of(15, tolerance / 25)[0].kind, Kind::kHalved);
  // There are more rows to invert where they are short,
  EXPECT_EQ(of(Vec3(4, 21, 21), tolerance / 25)[0].kind, Kind::kHalved);
  EXPECT_EQ(of(Vec3(21, 4, 21), tolerance / 25)[0].kind, Kind::kHole);
  // and pieces take longer with more channels.
  EXPECT_EQ(of(Vec3::Constant(12), tolerance / 25, 4)[0].kind, Kind::kHole);
  EXPECT_EQ(of(Vec3::Constant(20), tolerance / 25, 4)[0].kind, Kind::kHalved);
}

// Inverting a hundred voxels of a long run takes about as long as examining a node.
TEST_F(CellFitterTest, ExaminesFewNodesForItsVoxelsAtAnyTolerance) {
  constexpr double kVoxelsOfCell = 35 * 35 * 35, kVoxelsANode = 150;
  std::size_t most = 0;
  for (double tolerance = 0.3; tolerance > 1e-10; tolerance /= 3) {
    take(sharp_box(), {noise(6)}, {.pitch_mm = Vec3::Constant(10 / 35.0), .tolerance = tolerance});
    std::size_t nodes = 0;
    for (const LimitCellId cell : solid_->cells()) nodes += examined(cell).size();
    const auto cells = static_cast<double>(solid_->cell_count());
    EXPECT_LE(static_cast<double>(nodes) * kVoxelsANode, kVoxelsOfCell * cells) << tolerance;
    if (tolerance < 1e-6) {
      EXPECT_EQ(nodes, solid_->cell_count()) << tolerance;
    }
    most = std::max(most, nodes);
  }
  EXPECT_GT(most, 10u * solid_->cell_count()) << "some tolerance is worth the halving";
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
