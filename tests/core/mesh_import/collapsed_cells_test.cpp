// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/collapsed_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/mesh/connected_parts.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/join_points.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

/// The cube from 0 to 2, its middle, and a second cube on top.
const std::vector<Vec3> kPositions = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
                                      {0, 2, 2}, {1, 1, 1}, {0, 0, 4}, {2, 0, 4}, {2, 2, 4}, {0, 2, 4}, {1, 1, 5}};

using Corners = std::vector<std::uint32_t>;

MeshFile file_of(const std::vector<std::pair<CellKind, Corners>>& cells) {
  MeshFile file;
  file.mesh.positions = kPositions;
  for (const auto& [kind, corners] : cells) {
    file.mesh.cell_kinds.push_back(kind);
    file.mesh.cell_vertices.insert(file.mesh.cell_vertices.end(), corners.begin(), corners.end());
    file.numbers.cells.push_back(100 + file.numbers.cells.size());
  }
  return file;
}

double volume_of_tet(const ControlMesh& mesh, std::size_t first) {
  const auto at = [&](std::size_t i) { return mesh.positions[mesh.cell_vertices[first + i]]; };
  return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6;
}

/// The hexahedron's corners as seen from another of its faces and corners: all 24 ways that keep its orientation.
std::vector<std::array<std::size_t, 8>> rotations() {
  const std::array<std::size_t, 8> turn_z = {1, 2, 3, 0, 5, 6, 7, 4}, turn_x = {3, 2, 6, 7, 0, 1, 5, 4};
  std::set<std::array<std::size_t, 8>> known = {{0, 1, 2, 3, 4, 5, 6, 7}};
  for (std::size_t before = 0; before != known.size();) {
    before = known.size();
    for (const auto& way : std::set(known)) {
      for (const auto& turn : {turn_z, turn_x}) {
        std::array<std::size_t, 8> turned{};
        for (std::size_t i = 0; i < 8; ++i) turned[i] = way[turn[i]];
        known.insert(turned);
      }
    }
  }
  return {known.begin(), known.end()};
}

Corners turned(const Corners& corners, const std::array<std::size_t, 8>& way) {
  Corners result;
  for (const std::size_t i : way) result.push_back(corners[i]);
  return result;
}

TEST(CollapsedCells, HexahedraAreWedgesInEveryRotation) {
  ASSERT_EQ(rotations().size(), 24u);
  for (const auto& way : rotations()) {
    MeshFile file = file_of({{CellKind::kHex, turned({0, 1, 2, 2, 4, 5, 6, 6}, way)}});
    resolve_collapsed_cells(file);
    ASSERT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kWedge));
    EXPECT_THAT(file.warnings, ElementsAre("cells with repeated corners are read as what they are: 1 wedge"));
    // Its triangles are those of the corners 0 1 2 and 4 5 6, above each other.
    const Corners& corners = file.mesh.cell_vertices;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(std::max(corners[i], corners[i + 3]) - std::min(corners[i], corners[i + 3]), 4u);
    file.mesh.positions = {kPositions[0], kPositions[1], kPositions[2], kPositions[4], kPositions[5], kPositions[6]};
    for (std::uint32_t& corner : file.mesh.cell_vertices) corner -= corner > 2 ? 1 : 0;
    const Corners as_read = file.mesh.cell_vertices;
    EXPECT_NO_THROW(validate(file.mesh));
    EXPECT_EQ(file.mesh.cell_vertices, as_read) << "the orientation is kept";
  }
}

TEST(CollapsedCells, AreTetrahedraAsEachProgramWritesThem) {
  const Corners ansys = {0, 1, 2, 2, 5, 5, 5, 5}, ls_dyna = {0, 1, 2, 5, 5, 5, 5, 5};
  for (const Corners& corners : {ansys, ls_dyna}) {
    for (const auto& way : rotations()) {
      MeshFile file = file_of({{CellKind::kHex, turned(corners, way)}});
      resolve_collapsed_cells(file);
      ASSERT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet));
      EXPECT_THAT(std::set(file.mesh.cell_vertices.begin(), file.mesh.cell_vertices.end()), ElementsAre(0, 1, 2, 5));
      EXPECT_NEAR(std::abs(volume_of_tet(file.mesh, 0)), 8. / 6, 1e-15);
    }
  }
  for (const Corners& corners : {Corners{0, 1, 2, 5, 5, 5}, Corners{0, 1, 2, 0, 1, 5}}) {
    MeshFile file = file_of({{CellKind::kWedge, corners}});
    resolve_collapsed_cells(file);
    ASSERT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet)) << "wedges can be tetrahedra, too";
    EXPECT_THAT(std::set(file.mesh.cell_vertices.begin(), file.mesh.cell_vertices.end()), ElementsAre(0, 1, 2, 5));
  }
}

Corners pyramid(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, std::uint32_t apex) {
  return {a, b, c, d, apex, apex, apex, apex};
}

// Four pyramids and a fifth one as a collapsed wedge and a sixth one turned; what the cells had comes along.
TEST(CollapsedCells, PyramidsBecomeTwoTetrahedraWithAllThatTheyHad) {
  MeshFile file = file_of({{CellKind::kHex, pyramid(0, 1, 2, 3, 8)},
                           {CellKind::kHex, pyramid(4, 7, 6, 5, 8)},
                           {CellKind::kHex, pyramid(0, 4, 5, 1, 8)},
                           {CellKind::kHex, pyramid(1, 5, 6, 2, 8)},
                           {CellKind::kWedge, {8, 2, 6, 8, 3, 7}},
                           {CellKind::kHex, {8, 8, 8, 8, 3, 7, 4, 0}}});
  file.mesh.positions.resize(9);
  file.cell_numbers = {{"side", {1, 2, 3, 4, 5, 6}}};
  file.cell_sets = {{"even", {1, 3, 5}}};
  file.cell_materials = {{"all", {0, 1, 2, 3, 4, 5}}};
  resolve_collapsed_cells(file);
  EXPECT_EQ(file.mesh.cell_kinds, std::vector(12, CellKind::kTet));
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6));
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(2, 3, 6, 7, 10, 11));
  EXPECT_EQ(file.cell_materials[0].cells.size(), 12u);
  EXPECT_THAT(file.numbers.cells, ElementsAre(100, 100, 101, 101, 102, 102, 103, 103, 104, 104, 105, 105));
  EXPECT_THAT(file.warnings, ElementsAre("6 pyramids are read as two tetrahedra each"));
  EXPECT_NO_THROW(validate(file.mesh)) << "they fit together";
  double volume = 0;
  for (std::size_t cell = 0; cell < 12; ++cell) volume += std::abs(volume_of_tet(file.mesh, 4 * cell));
  EXPECT_DOUBLE_EQ(volume, 8);
}

TEST(CollapsedCells, PyramidsThatShareAQuadrilateralAreHalvedAlike) {
  for (std::size_t shift = 0; shift < 4; ++shift) {
    Corners above = {4, 5, 6, 7};
    std::rotate(above.begin(), above.begin() + static_cast<std::ptrdiff_t>(shift), above.end());
    MeshFile file = file_of({{CellKind::kHex, pyramid(4, 7, 6, 5, 8)},
                             {CellKind::kHex, pyramid(above[0], above[1], above[2], above[3], 13)}});
    file.mesh.positions[6].x() = 1.5;  // The diagonal from 4 to 6 is the shorter one.
    resolve_collapsed_cells(file);
    std::vector<std::uint32_t> in_all = {0, 0};
    for (std::size_t cell = 0; cell < 4; ++cell) {
      const auto begin = file.mesh.cell_vertices.begin() + static_cast<std::ptrdiff_t>(4 * cell);
      in_all[0] += static_cast<std::uint32_t>(std::count(begin, begin + 4, 4u));
      in_all[1] += static_cast<std::uint32_t>(std::count(begin, begin + 4, 6u));
    }
    EXPECT_THAT(in_all, ElementsAre(4, 4)) << "all four have the diagonal";
  }
}

// The longer diagonal, where the shorter one lies outside of the quadrilateral.
TEST(CollapsedCells, PyramidsAreHalvedWithinTheirQuadrilateral) {
  MeshFile file = file_of({{CellKind::kHex, pyramid(0, 1, 2, 3, 8)}});
  const std::array<Vec3, 4> dart = {Vec3(0, 0.1, 0), Vec3(0.5, 0, 0), Vec3(0, 4, 0), Vec3(-0.5, 0, 0)};
  std::ranges::copy(dart, file.mesh.positions.begin());
  resolve_collapsed_cells(file);
  EXPECT_GT(volume_of_tet(file.mesh, 0), 0);
  EXPECT_GT(volume_of_tet(file.mesh, 4), 0);
}

TEST(CollapsedCells, PyramidsBesideHexahedraAreRefusedByTheFilesNumbers) {
  const std::pair<CellKind, Corners> cube = {CellKind::kHex, {4, 5, 6, 7, 9, 10, 11, 12}};
  MeshFile file = file_of({{CellKind::kHex, pyramid(0, 1, 2, 3, 8)}, cube, {CellKind::kHex, pyramid(4, 7, 6, 5, 8)}});
  file.numbers.cell_noun = "element";
  expect_error([&] { resolve_collapsed_cells(file); }, ErrorCode::kMeshUnsupportedCell,
               "the cell beyond its quadrilateral: pyramid 102 at element 101 near (1, 1, 2) mm; mesh the part without "
               "pyramids");
  MeshFile tet = file_of({cube, {CellKind::kHex, {4, 5, 6, 7, 7, 7, 7, 7}}});
  expect_error([&] { resolve_collapsed_cells(tet); }, ErrorCode::kMeshUnsupportedCell,
               "collapsed tetrahedron 101 at cell 100");
  MeshFile wedge = file_of({{CellKind::kHex, {0, 1, 2, 3, 4, 5, 5, 4}}, {CellKind::kHex, pyramid(0, 3, 2, 1, 13)}});
  expect_error([&] { resolve_collapsed_cells(wedge); }, ErrorCode::kMeshUnsupportedCell, "pyramid 101 at cell 100");
  const auto again = std::pair(CellKind::kHex, pyramid(4, 7, 6, 5, 0));
  MeshFile three = file_of({{CellKind::kHex, pyramid(4, 7, 6, 5, 8)}, again, again});
  expect_error([&] { resolve_collapsed_cells(three); }, ErrorCode::kMeshUnsupportedCell, "pyramid 100 at cell 102");
}

/// How many faces are of one cell only.
std::size_t boundary_faces(const MeshFile& file) {
  ControlMesh mesh = file.mesh;
  mesh.positions.clear();
  std::map<std::uint32_t, std::uint32_t> used;
  for (std::uint32_t& corner : mesh.cell_vertices) {
    const auto [place, is_new] = used.try_emplace(corner, mesh.positions.size());
    if (is_new) mesh.positions.push_back(file.mesh.positions[corner]);
    corner = place->second;
  }
  const ConnectedMesh connected = validate_and_connect(mesh, {}, {});
  const CellComplex& complex = connected.complex;
  std::size_t count = 0;
  for (const FaceId face : complex.faces()) count += complex.face_on_boundary(face);
  return count;
}

TEST(CollapsedCells, PyramidsAreHalvedAsTetrahedraBeyondAre) {
  const auto tets = [](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    return std::array{std::pair(CellKind::kTet, Corners{a, b, c, 13}), std::pair(CellKind::kTet, Corners{a, c, d, 13})};
  };
  for (const bool turned : {false, true}) {
    const auto above = turned ? tets(5, 6, 7, 4) : tets(4, 5, 6, 7);
    MeshFile file = file_of({above[0], {CellKind::kHex, pyramid(4, 7, 6, 5, 8)}, above[1]});
    resolve_collapsed_cells(file);
    ASSERT_EQ(file.mesh.cell_count(), 4u);
    EXPECT_EQ(boundary_faces(file), 8u) << "four of the pyramid, four above";
  }
  MeshFile torn = file_of({tets(4, 5, 6, 7)[0], {CellKind::kHex, pyramid(4, 7, 6, 5, 8)}, tets(5, 6, 7, 4)[0]});
  expect_error([&] { resolve_collapsed_cells(torn); }, ErrorCode::kMeshUnsupportedCell,
               "pyramid 101 at cell 102 near (1, 1, 2) mm");
}

/// Cells as they come of one file, whose repeated corners are points of their own.
MeshFile collapsed_by_place(const MeshFile& by_id, double apart) {
  MeshFile file = by_id;
  std::size_t begin = 0;
  for (const CellKind kind : by_id.mesh.cell_kinds) {
    const auto end = begin + static_cast<std::size_t>(corner_count(kind));
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = begin; k < i; ++k) {
        if (file.mesh.cell_vertices[k] != by_id.mesh.cell_vertices[i]) continue;
        file.mesh.cell_vertices[i] = static_cast<std::uint32_t>(file.mesh.positions.size());
        file.mesh.positions.push_back(file.mesh.positions[by_id.mesh.cell_vertices[i]] + Vec3(apart, 0, 0));
        break;
      }
    }
    begin = end;
  }
  return file;
}

TEST(CollapsedCells, ByPlaceAreReadAsThoseByIdOncePointsAreJoined) {
  for (const double apart : {0.0, 1e-10}) {
    const MeshFile by_id = file_of({{CellKind::kHex, {0, 1, 2, 2, 4, 5, 6, 6}},
                                    {CellKind::kWedge, {4, 5, 6, 10, 10, 10}},
                                    {CellKind::kHex, pyramid(9, 10, 11, 12, 13)}});
    MeshFile file = collapsed_by_place(by_id, apart), expected = by_id;
    ASSERT_EQ(file.mesh.vertex_count(), by_id.mesh.vertex_count() + 2 + 2 + 3);
    const double same_mm = same_place_mm(file.mesh);
    if (apart > 0) {
      expect_error([&] { join_points(same_mm, file.mesh, file.numbers); }, ErrorCode::kMeshRepeatedVertex,
                   "a corner repeated in cells 0, 1, 2");
    }
    join_points(same_mm, file.mesh, file.numbers, same_mm);
    EXPECT_EQ(file.mesh.cell_vertices, by_id.mesh.cell_vertices);
    resolve_collapsed_cells(expected);
    resolve_collapsed_cells(file);
    EXPECT_EQ(file.mesh.cell_kinds, expected.mesh.cell_kinds);
    EXPECT_EQ(file.mesh.cell_vertices, expected.mesh.cell_vertices);
    EXPECT_EQ(file.warnings, expected.warnings);
  }
}

TEST(CollapsedCells, AreMadeOfNoCellsWhoseCornersAWideDistanceJoins) {
  MeshFile file = collapsed_by_place(file_of({{CellKind::kHex, {0, 1, 2, 2, 4, 5, 6, 6}}}), 0.01);
  const double same_mm = same_place_mm(file.mesh);
  expect_error([&] { join_points(0.02, file.mesh, file.numbers, same_mm); }, ErrorCode::kMeshRepeatedVertex,
               "two of the first one's corners are 0.01 mm apart before");
}

/// The same file, each of whose cells has points of its own, the last digits of which differ.
MeshFile with_own_points(const MeshFile& file) {
  MeshFile own = file;
  own.mesh.positions.clear();
  std::size_t begin = 0;
  for (const CellKind kind : file.mesh.cell_kinds) {
    const auto end = begin + static_cast<std::size_t>(corner_count(kind));
    std::map<std::uint32_t, std::uint32_t> points;  // A cell may name one of its points twice.
    for (; begin < end; ++begin) {
      const std::uint32_t corner = file.mesh.cell_vertices[begin];
      const auto [place, is_new] = points.try_emplace(corner, own.mesh.positions.size());
      if (is_new) own.mesh.positions.push_back(file.mesh.positions[corner] * (1 + 1e-15 * static_cast<double>(begin)));
      own.mesh.cell_vertices[begin] = place->second;
    }
  }
  return own;
}

TEST(CollapsedCells, PyramidsWithPointsOfTheirOwnAreHalvedAlike) {
  const MeshFile shared =
      file_of({{CellKind::kHex, {4, 5, 6, 7, 8, 8, 8, 8}}, {CellKind::kHex, {5, 6, 7, 4, 13, 13, 13, 13}}});
  MeshFile file = with_own_points(shared);
  ASSERT_EQ(file.mesh.vertex_count(), 10u);
  resolve_collapsed_cells(file);
  join_points(same_place_mm(file.mesh), file.mesh, file.numbers);
  EXPECT_EQ(file.mesh.vertex_count(), 6u);
  ASSERT_EQ(file.mesh.cell_count(), 4u);
  EXPECT_EQ(count_parts(file.mesh).count, 1u);
  std::map<std::set<std::uint32_t>, int> triangles;  // Cells at each.
  for (std::size_t first = 0; first < 16; first += 4) {
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::set<std::uint32_t> triangle;
      for (std::size_t i = 0; i < 4; ++i) {
        if (i != left_out) triangle.insert(file.mesh.cell_vertices[first + i]);
      }
      ++triangles[triangle];
    }
  }
  EXPECT_EQ(std::ranges::count(triangles, 2, [](const auto& each) { return each.second; }), 4)
      << "two within the pyramids, two between them";
}

TEST(CollapsedCells, PyramidsBesideHexahedraWithPointsOfTheirOwnAreRefused) {
  MeshFile file = with_own_points(
      file_of({{CellKind::kHex, {0, 1, 2, 3, 4, 5, 6, 7}}, {CellKind::kHex, {4, 5, 6, 7, 13, 13, 13, 13}}}));
  expect_error([&] { resolve_collapsed_cells(file); }, ErrorCode::kMeshUnsupportedCell, "pyramid 101 at cell 100");
}

// A tetrahedron as LS-DYNA has it leaves no choice of the diagonal.
TEST(CollapsedCells, PyramidsFollowACollapsedTetrahedron) {
  MeshFile file = file_of({{CellKind::kHex, pyramid(0, 1, 2, 3, 13)}, {CellKind::kHex, {0, 3, 2, 1, 1, 1, 1, 1}}});
  file.mesh.positions[0].z() = -1;  // The other diagonal is the shorter one.
  file.mesh.positions[2].z() = -0.5;
  resolve_collapsed_cells(file);
  ASSERT_EQ(file.mesh.cell_count(), 3u);
  EXPECT_THAT((std::vector(file.mesh.cell_vertices.begin(), file.mesh.cell_vertices.begin() + 8)),
              testing::AllOf(testing::Contains(0u).Times(2), testing::Contains(2u).Times(2)));
}

TEST(CollapsedCells, OthersStayForValidationToRefuse) {
  for (const Corners& corners :
       {Corners{0, 1, 0, 3, 4, 5, 6, 7}, Corners{0, 1, 2, 3, 4, 5, 6, 6}, Corners{0, 0, 0, 0, 0, 0, 0, 0},
        Corners{0, 1, 1, 0, 0, 1, 1, 0}, Corners{0, 1, 2, 3, 0, 1, 2, 3}, Corners{6, 1, 2, 3, 4, 5, 6, 7}}) {
    MeshFile file = file_of({{CellKind::kHex, corners}});
    resolve_collapsed_cells(file);
    EXPECT_EQ(file.mesh.cell_vertices, corners);
    EXPECT_TRUE(file.warnings.empty());
    expect_error([&] { validate(file.mesh); }, ErrorCode::kMeshRepeatedVertex, "repeated");
  }
}

TEST(CollapsedCells, KeepNodesOfTheEdgesThatAreLeft) {
  MeshFile file = file_of({{CellKind::kHex, {0, 1, 2, 2, 4, 5, 6, 6}}, {CellKind::kHex, pyramid(4, 6, 11, 9, 13)}});
  file.mesh.channel_names = {"heat"};
  file.mesh.channel_values.assign(kPositions.size(), 2);
  MidNodes& nodes = file.mesh.mid_nodes;
  nodes.edges = {{0, 1}, {4, 6}};
  nodes.faces = {{0, 1, 4, 5}};
  nodes.cells = {0};
  nodes.positions = {{1, 0.5, 0}, {1, 1, 2.5}, {1, 0, 1}, {9, 9, 9}};
  nodes.values = {1, 6, 3, 4};
  file.numbers.mid_nodes = {71, 72, 73, 74};
  resolve_collapsed_cells(file);
  // The quadrilateral's middle, of its one curved edge and three straight ones: (1, 1, 3.25) without a quarter bend.
  EXPECT_THAT(nodes.edges, ElementsAre(std::array{0u, 1u}, std::array{4u, 6u}, std::array{4u, 11u}));
  EXPECT_THAT(nodes.faces, ElementsAre(std::array{0u, 1u, 4u, 5u}));
  EXPECT_TRUE(nodes.cells.empty());
  ASSERT_EQ(nodes.positions.size(), 4u);
  EXPECT_EQ(nodes.positions[2], Vec3(1, 1, 3.25));
  EXPECT_THAT(nodes.values, ElementsAre(1, 6, 4, 3));
  EXPECT_THAT(file.numbers.mid_nodes, ElementsAre(71, 72, 72, 73)) << "the third one is in no file";
}

TEST(CollapsedCells, NodeOfAQuadrilateralBecomesItsDiagonals) {
  MeshFile file = file_of({{CellKind::kHex, pyramid(0, 1, 2, 3, 8)}});
  file.mesh.positions[2].x() = 1.5;
  file.mesh.mid_nodes.faces = {{0, 1, 2, 3}};
  file.mesh.mid_nodes.positions = {{1, 1, -0.5}};
  resolve_collapsed_cells(file);
  EXPECT_THAT(file.mesh.mid_nodes.edges, ElementsAre(std::array{0u, 2u}));
  EXPECT_TRUE(file.mesh.mid_nodes.faces.empty());
  EXPECT_THAT(file.mesh.mid_nodes.positions, ElementsAre(Vec3(1, 1, -0.5)));
}

}  // namespace
}  // namespace ccslice
