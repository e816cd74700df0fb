// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/face_surroundings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "core/interpolation/pieces/block_shell.h"
#include "core/interpolation/pieces/cell_fitter.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/channel_tolerances.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// A row of boxes, bent to an arc of 90 degrees: along x cubes of 20 mm of arc, along z one, along the radius cells
/// between these radii, without those that keep() refuses.
ControlMesh arc_of(const std::vector<double>& radii, const oracle::KeepCell& keep = {}) {
  ControlMesh mesh = oracle::box_mesh(2, static_cast<int>(radii.size()) - 1, 3, 1, keep);
  oracle::sharpen_by_cells(mesh, 1);
  for (Vec3& p : mesh.positions) {
    const double angle = std::numbers::pi / 4 * p.x();
    const double radius = radii[static_cast<std::size_t>(std::lround(p.y()))];
    p = Vec3(radius * std::sin(angle), radius * std::cos(angle), 8 * p.z());
  }
  return mesh;
}

using Material = std::function<double(const Vec3&)>;

using Question = bool (FaceSurroundings::*)(const FaceSurroundings::Piece&, std::size_t);

/// What pieces of a mesh depend on that has one channel.
struct Graded {
  Graded(ControlMesh mesh, const Material& material, double tolerance, bool proved) {
    mesh.channel_names = {"m"};
    mesh.channel_values.clear();
    for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(material(p)));
    solid = prepare_solid(mesh);
    SliceJob job = job_of(solid, {0.2, 0.2, 0.2});
    job.channel_tolerance = tolerance;
    job.prove_channels = proved;
    spec = interpolation_spec_of(job, solid->summary().channels);
  }

  Solid solid;
  InterpolationSpec spec;
};

/// Calls visit(piece) for each piece of each cell.
template <typename Visit>
void for_each_piece(const Graded& graded, Visit visit) {
  CellFitter fitter(graded.solid, graded.spec);
  for (const LimitCellId cell : graded.solid->cells()) {
    std::vector<CellNode> nodes(1);
    nodes[0].bounds = Box3(Vec3::Constant(-1e6), Vec3::Constant(1e6));
    for (std::uint32_t n = 0; n < nodes.size(); ++n) fitter.examine(cell, nodes, n);
    for (const CellNode& node : nodes) {
      if (!node.piece) continue;
      const BlockShape shape = shape_of(node.piece->points);
      FaceSurroundings::Piece piece{
          cell, node.piece->points, shape, node.piece->frame, node.piece->polynomials, node.piece->error, 0};
      for (std::size_t side = 0; side < 6; ++side) {
        const auto axis = static_cast<Eigen::Index>(side / 2);
        const bool own = side % 2 != 0 ? node.parameters.high[axis] == 1 : node.parameters.low[axis] == 0;
        if (own) piece.own_sides |= 1u << side;
      }
      visit(piece);
    }
  }
}

/// Control cells of which a piece has a side of which that is true.
std::set<std::uint32_t> cells_where(Question question, ControlMesh mesh, const Material& material, double tolerance,
                                    bool proved = false) {
  const Graded graded(std::move(mesh), material, tolerance, proved);
  FaceSurroundings surroundings(graded.solid, graded.spec);
  std::set<std::uint32_t> found;
  for_each_piece(graded, [&](const FaceSurroundings::Piece& piece) {
    for (std::size_t side = 0; side < 6; ++side) {
      if (piece.own_sides >> side & 1 && (surroundings.*question)(piece, side)) {
        found.insert(graded.solid->control_cell(piece.cell));
      }
    }
  });
  return found;
}

/// Control cells of which a piece has a side that its polynomials may be off beyond.
std::set<std::uint32_t> cells_that_may_differ(ControlMesh mesh, const Material& material,
                                              double tolerance = 1.0 / 65536) {
  return cells_where(&FaceSurroundings::may_differ, std::move(mesh), material, tolerance);
}

double none(const Vec3&) { return 0; }
double along_z(const Vec3& p) { return p.z() / 24; }

TEST(FaceSurroundings, AreAirAroundASingleBody) {
  EXPECT_TRUE(cells_that_may_differ(arc_of({20, 24, 28}), none).empty());
  EXPECT_TRUE(cells_that_may_differ(arc_of({20, 24, 28}), along_z).empty());
}

// Inner faces of an arc are hollow: those on the boundary, all of whose edges are, and those of the outer layer, which
// end in edges on the boundary at either end of the arc's height.
TEST(FaceSurroundings, MayBeAirWhereTrianglesReachBeyondAnEdgeOnTheBoundary) {
  const auto reaching = [](ControlMesh mesh) {
    return cells_where(&FaceSurroundings::reaches_into_air, std::move(mesh), none, 1.0 / 65536);
  };
  EXPECT_EQ(reaching(arc_of({20, 24, 28})), (std::set<std::uint32_t>{0, 1, 2, 3, 4, 5, 8, 9, 10, 11}));
  ControlMesh flat = oracle::box_mesh(2, 2, 3);
  oracle::sharpen_by_cells(flat, 1);
  EXPECT_TRUE(reaching(flat).empty());
}

/// Between an inner lobe, of cells that are 1 mm thick, and an outer one; closed in the lowest layer.
ControlMesh slit(double width) {
  return arc_of({18 - width, 19 - width, 20 - width, 20, 24, 28}, [](int, int y, int z) { return y != 2 || z < 1; });
}

TEST(FaceSurroundings, OfALobeAreTheOneAcrossASlit) {
  EXPECT_FALSE(cells_that_may_differ(slit(0.01), none).empty());
  EXPECT_TRUE(cells_that_may_differ(slit(4), none).empty());  // Nothing reaches as far as that.
}

TEST(FaceSurroundings, AreCellsBehindThinOnes) {
  EXPECT_FALSE(cells_that_may_differ(arc_of({19.94, 19.96, 19.98, 20, 24, 28}), along_z).empty());
}

TEST(FaceSurroundings, OfALobeThatTapersAreTheOneAcrossASlit) {
  EXPECT_FALSE(cells_that_may_differ(oracle::tapered_slit(0.004), none).empty());
  EXPECT_TRUE(cells_that_may_differ(oracle::tapered_slit(2), none).empty());
}

// Every cell touches every other one.
TEST(FaceSurroundings, OfLobesThatShareAVertexAreTheOneAcrossTheSlit) {
  const auto outer = [](const Vec3& p) { return std::hypot(p.x(), p.z()) > 20.0005 ? 1.0 : 0.0; };
  EXPECT_FALSE(cells_that_may_differ(oracle::vertex_slit(0.001, 2), outer, 1e-3).empty());
  EXPECT_TRUE(cells_that_may_differ(oracle::vertex_slit(0.001, 2), none, 1e-3).empty());
  EXPECT_TRUE(cells_that_may_differ(oracle::vertex_slit(2, 2), outer, 1e-3).empty());
}

// It rises with the cube of the depth from the large cells on, in which it is constant.
TEST(FaceSurroundings, AreThinCellsInWhichAMaterialBegins) {
  const std::vector<double> coated = {19, 19.5, 20, 24, 28};
  const auto begins = [](const Vec3& p) { return p.head<2>().norm() < 19.25 ? 1.0 : 0.0; };
  EXPECT_FALSE(cells_that_may_differ(arc_of(coated), begins, 1e-6).empty());
  EXPECT_TRUE(cells_that_may_differ(arc_of(coated), along_z, 1e-6).empty());  // This one goes on.
}

TEST(FaceSurroundings, AreNotSampledWhereAllIsToBeProved) {
  const auto unproved = [](const Material& material, double tolerance) {
    return cells_where(&FaceSurroundings::may_differ, arc_of({19, 19.5, 20, 24, 28}), material, tolerance, true);
  };
  EXPECT_FALSE(unproved(along_z, 1e-6).empty());  // It goes on, but samples alone would say so.
  EXPECT_TRUE(unproved(along_z, 0.1).empty()) << "third derivatives can't jump by so much";
  EXPECT_TRUE(unproved(none, 1e-6).empty()) << "constants have none";
}

/// Cubes of 20 mm in a row, as meshed, whose channel grows by 1 along the second.
ControlMesh cubes_as_meshed(int count) {
  ControlMesh mesh = oracle::box_mesh(count, 1, 1, 20);
  mesh.as_meshed = true;
  return mesh;
}

double in_the_second(const Vec3& p) { return std::max(p.x() / 20 - 1, 0.0); }

TEST(FaceSurroundings, LetPiecesAsMeshedReachNoFartherThanAKinkLeaves) {
  constexpr double kTolerance = 1e-3, kColumns = 8;
  const Graded graded(cubes_as_meshed(2), in_the_second, kTolerance, false);
  FaceSurroundings surroundings(graded.solid, graded.spec);
  const double most_columns = 20 * kTolerance / 0.2;  // There the channel has grown by the tolerance.
  std::size_t beside = 0;
  for_each_piece(graded, [&](const FaceSurroundings::Piece& piece) {
    const double reach = surroundings.reach_as_meshed(piece, kColumns);
    EXPECT_GT(reach, 0);
    EXPECT_LE(reach, most_columns);
    ++beside;
    EXPECT_EQ(surroundings.reach_as_meshed(piece, 0), 0);
  });
  EXPECT_GT(beside, 0u);
}

TEST(FaceSurroundings, LetPiecesAsMeshedReachAsFarAsTheyHoldWhereNoCellIsNear) {
  const Graded graded(cubes_as_meshed(1), in_the_second, 1e-3, false);
  FaceSurroundings surroundings(graded.solid, graded.spec);
  std::size_t pieces = 0;
  for_each_piece(graded, [&](const FaceSurroundings::Piece& piece) {
    EXPECT_DOUBLE_EQ(surroundings.reach_as_meshed(piece, 8), 8);
    ++pieces;
  });
  EXPECT_GT(pieces, 0u);
}

/// Cubes of 20 mm as meshed, with two columns of 0.2 mm between the first and the second.
ControlMesh cubes_with_a_layer_between() {
  ControlMesh mesh = cubes_as_meshed(3);
  for (Vec3& p : mesh.positions) {
    if (p.x() > 30) p.x() -= 19.6;
  }
  return mesh;
}

double in_the_last(const Vec3& p) { return std::max((p.x() - 20.4) / 20, 0.0); }

TEST(FaceSurroundings, LetPiecesAsMeshedReachNoFartherThanTheNextCell) {
  const Graded graded(cubes_with_a_layer_between(), in_the_last, 1e-3, false);
  FaceSurroundings surroundings(graded.solid, graded.spec);
  std::size_t pieces = 0;
  for_each_piece(graded, [&](const FaceSurroundings::Piece& piece) {
    if (graded.solid->control_cell(piece.cell) != 0) return;
    const double reach = surroundings.reach_as_meshed(piece, 8);
    EXPECT_GT(reach, 0.5);
    EXPECT_LE(reach, 2) << "the channel is constant in the layer alone";
    ++pieces;
  });
  EXPECT_GT(pieces, 0u);
}

/// Four cubes of 10 mm as meshed. With a slit the upper right one shares but an edge with the lower right one.
ControlMesh four_cubes(bool slit) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 1);
  mesh.as_meshed = true;
  const auto corners = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t vertex = 0; slit && vertex < corners; ++vertex) {
    const Vec3 p = mesh.positions[vertex];
    if (p.x() != 20 || p.y() != 10) continue;
    const auto copy = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(p - Vec3(0, 0.01, 0));
    std::replace(mesh.cell_vertices.begin(), mesh.cell_vertices.begin() + 16, vertex, copy);
  }
  return mesh;
}

TEST(FaceSurroundings, LetPiecesAsMeshedReachIntoNoCellAcrossAGap) {
  for (const bool slit : {false, true}) {
    const Graded graded(four_cubes(slit), none, 1e-3, false);
    FaceSurroundings surroundings(graded.solid, graded.spec);
    std::size_t pieces = 0;
    for_each_piece(graded, [&](const FaceSurroundings::Piece& piece) {
      const bool at_slit = slit && graded.solid->control_cell(piece.cell) % 2 == 1;
      EXPECT_DOUBLE_EQ(surroundings.reach_as_meshed(piece, 8), at_slit ? 0 : 8);
      ++pieces;
    });
    EXPECT_EQ(pieces, 4u);
  }
}

/// Pieces, proved ones, of a vertex and its surroundings. Their channel is exact in whatever piece, so they are as
/// large as their bulge allows.
class FaceSurroundingsOfPatches : public testing::Test {
 protected:
  static constexpr double kTolerance = 1e-6;

  static Graded graded(const Material& material) {
    return Graded(oracle::tiny_mesh("vertex_link_icosahedron"), material, kTolerance, true);
  }
};

TEST_F(FaceSurroundingsOfPatches, AreTheNextPatchWhereTrianglesReachFarIntoIt) {
  const auto sides_inside = [](const Material& material) {
    const Graded solid = graded(material);
    FaceSurroundings surroundings(solid.solid, solid.spec);
    std::pair<std::size_t, std::size_t> all_and_reaching{0, 0};
    for_each_piece(solid, [&](const FaceSurroundings::Piece& piece) {
      const bool regular = solid.solid->cell_class(piece.cell) == CellClass::kRegular;
      for (std::size_t side = 0; side < 6; ++side) {
        if (piece.own_sides >> side & 1) continue;
        const bool reaches = surroundings.reaches_into_patches(piece, side);
        EXPECT_FALSE(regular && reaches);
        all_and_reaching.first += !regular;
        all_and_reaching.second += reaches;
      }
    });
    return all_and_reaching;
  };
  const auto [all, reaching] = sides_inside(along_z);
  EXPECT_GT(all, 200u);
  EXPECT_GT(reaching, 10u);
  EXPECT_LT(reaching, all);
  EXPECT_EQ(sides_inside(none).second, 0u) << "constants have no third derivatives";
}

// Small pieces at vertices end at small patches of the next cells, too, although those cells are thick.
TEST_F(FaceSurroundingsOfPatches, OfSmallPiecesAreNoThickerThanTheseAre) {
  const Graded solid = graded(along_z);
  FaceSurroundings surroundings(solid.solid, solid.spec);
  std::size_t deep = 0, flat = 0;
  BlockShell shell;
  for_each_piece(solid, [&](const FaceSurroundings::Piece& piece) {
    if (solid.solid->cell_class(piece.cell) == CellClass::kRegular) return;
    const unsigned inside = piece.own_sides & ~unsigned{solid.solid->boundary_sides(piece.cell)};
    for (std::size_t side = 0; side < 6; ++side) {
      if (!(inside >> side & 1)) continue;
      shell.find(piece.points, piece.shape, side);
      // Third derivatives of a patch a third as thick jump by 8 times the range.
      const double jump = 8.0 / 6 * std::pow(3 * 1.4 * shell.depth(), 3);
      if (jump > (1 - piece.error) * kTolerance) {
        ++deep;
        EXPECT_TRUE(surroundings.may_differ(piece, side)) << piece.cell << " " << side;
      } else {
        flat += !surroundings.may_differ(piece, side);
      }
    }
  });
  EXPECT_GT(deep, 10u);
  EXPECT_GT(flat, 10u);
}

}  // namespace
}  // namespace ccslice
