// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of cells (core/interpolation/pieces/cell_fitter.h) if all is to be proved.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/interpolation/samples/voxel_blocks.h"
#include "tests/core/interpolation/cell_fitter_fixture.h"

namespace ccslice {
namespace {

class ProvedPieces : public CellFitterTest {
 protected:
  ProvedPieces() { spec_.proved = true; }

  static double height(const Vec3& p) { return p.z() / 50; }
};

// Beside vertices, too. What isn't painted is a small hole at the vertex, or is too bent for a cubic.
TEST_F(ProvedPieces, AreInOnePatchOrBesideALineAndKeepTheirBounds) {
  std::mt19937 random(kSeed);
  std::size_t in_patches = 0, beside_lines = 0;
  for (const char* name : {"vertex_link_icosahedron", "vertex_link_gyroelongated_6", "boundary_edge_3_hexes"}) {
    for (const double tolerance : {0.2, 0.05}) {
      SCOPED_TRACE(name + std::string(", tolerance ") + std::to_string(tolerance));
      take(oracle::tiny_mesh(name), {noise(1)}, {.pitch_mm = Vec3::Constant(0.1), .tolerance = tolerance});
      const VoxelBlocks blocks(*solid_, spec_);
      double in_pieces = 0, in_cells = 0;
      for (const LimitCellId cell : solid_->cells()) {
        if (solid_->cell_class(cell) != CellClass::kVertex) continue;
        const Parts parts = examined(cell);
        expect_halves_tile(parts);
        ++in_cells;
        for (const CellNode& part : parts) {
          if (part.kind != Kind::kPiece) continue;
          in_pieces += volume(part.parameters);
          const bool in_patch = blocks.is_in_one_patch(cell, part.parameters);
          ASSERT_TRUE(in_patch || blocks.is_beside_line(cell, part.parameters));
          ++(in_patch ? in_patches : beside_lines);
          EXPECT_EQ(part.piece->reach, 0);
          for (int k = 0; k < 20; ++k) {
            const Vec3 uvw = random_in(part.parameters, random);
            ASSERT_LE(error_at(cell, *part.piece, uvw), part.piece->error + 1e-9) << cell << " " << uvw.transpose();
          }
        }
      }
      EXPECT_GT(in_pieces, 0.9 * in_cells);
    }
  }
  EXPECT_GT(in_patches, 100u);
  EXPECT_GT(beside_lines, 100u);
}

// A material so curved that a corner of a piece is steeper than the places where slopes are looked at by samples.
TEST_F(ProvedPieces, KnowTheAirWhereTheyMayBeSteepAnywhere) {
  const auto pieces_beside_air = [&](bool proved) {
    spec_.proved = proved;
    std::size_t count = 0;
    for (const CellNode& part : examined(LimitCellId{26})) count += part.piece && !part.piece->beyond.empty();
    return count;
  };
  const auto cubic = [](const Vec3& p) { return std::pow(p.x() / 30, 3) * p.y() / 30; };
  std::size_t as_samples_say = 0, as_is_proved = 0;
  for (double outside_mm = 1e-3; outside_mm < 10; outside_mm *= 1.2) {
    take(sharp_box(), {cubic}, {.tolerance = 0.01, .outside_mm = outside_mm});
    const std::size_t sampled = pieces_beside_air(false), proved = pieces_beside_air(true);
    EXPECT_LE(sampled, proved) << outside_mm;
    as_samples_say += sampled;
    as_is_proved += proved;
  }
  EXPECT_GT(as_samples_say, 0u);
  EXPECT_GT(as_is_proved, as_samples_say);
}

// A polynomial says what is beyond a face: positive outside of it, and before it as far as it may be off.
TEST_F(ProvedPieces, MissNothingBeyondAFaceByThePolynomialThatPutsIt) {
  std::mt19937 random(kSeed);
  std::size_t faces = 0;
  for (const char* name : {"vertex_link_icosahedron", "vertex_link_gyroelongated_6", "edge_valence_8"}) {
    // Exact in whatever piece, so that pieces are as large as their bulge allows.
    take(oracle::tiny_mesh(name), {height}, {.pitch_mm = Vec3::Constant(0.1), .tolerance = 1e-7, .outside_mm = 0.01});
    for (const LimitCellId cell : solid_->cells()) {
      for (const CellNode& part : examined(cell)) {
        if (part.kind != Kind::kPiece) continue;
        const Vec3 size = part.parameters.high - part.parameters.low;
        std::vector<std::pair<Vec3, Vec3>> places;  // Shares of the piece, and where they are in its frame.
        for (int k = 0; k < 60; ++k) {
          const Vec3 uvw = random_in(part.parameters, random);
          places.emplace_back((uvw - part.parameters.low).cwiseQuotient(size), part.piece->frame(voxel_at(cell, uvw)));
        }
        for (const CubicPolynomial& beyond : part.piece->beyond) {
          const auto misses_nothing_of = [&](std::size_t side) {
            return std::ranges::all_of(places, [&](const std::pair<Vec3, Vec3>& place) {
              const double share = place.first[static_cast<Eigen::Index>(side / 2)];
              return value_at(beyond, place.second) >= (side % 2 != 0 ? share - 1 : -share);
            });
          };
          ++faces;
          const std::array<std::size_t, 6> sides = {0, 1, 2, 3, 4, 5};
          EXPECT_TRUE(std::ranges::any_of(sides, misses_nothing_of)) << name << ", cell " << cell;
        }
      }
    }
  }
  EXPECT_GT(faces, 1000u);
}

// Where no side of theirs is their cell's, only the next patch may be what they mustn't paint.
TEST_F(ProvedPieces, KnowWhatIsBeyondThemInTheNextPatchOfTheirCell) {
  take(oracle::tiny_mesh("vertex_link_icosahedron"), {height},
       {.pitch_mm = Vec3::Constant(0.1), .tolerance = 1e-7, .outside_mm = 1e-9});
  std::size_t inner = 0, knowing = 0;
  for (const LimitCellId cell : solid_->cells()) {
    for (const CellNode& part : examined(cell)) {
      if (part.kind != Kind::kPiece || own_sides(part.parameters) != 0) continue;
      ++inner;
      knowing += !part.piece->beyond.empty();
    }
  }
  EXPECT_GT(inner, 50u);
  EXPECT_GT(knowing, 5u);
}

}  // namespace
}  // namespace ccslice
