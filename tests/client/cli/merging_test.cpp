// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the ccslice program does with points in one place, with meshes that touch themselves, and how it names what is
// wrong with a file.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Point = std::array<double, 3>;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A legacy VTK file of hexahedra; `values`: one of each point, or none.
std::string vtk_of(const std::vector<Point>& points, const std::vector<std::array<int, 8>>& cells,
                   const std::vector<double>& values = {}) {
  std::ostringstream text;
  text.precision(17);
  text << "# vtk DataFile Version 3.0\na test\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " << points.size()
       << " double\n";
  for (const auto& [x, y, z] : points) text << x << ' ' << y << ' ' << z << '\n';
  text << "CELLS " << cells.size() << ' ' << 9 * cells.size() << '\n';
  for (const auto& cell : cells) {
    text << 8;
    for (const int corner : cell) text << ' ' << corner;
    text << '\n';
  }
  text << "CELL_TYPES " << cells.size() << '\n';
  for (std::size_t i = 0; i < cells.size(); ++i) text << "12\n";
  if (!values.empty()) {
    text << "POINT_DATA " << values.size() << "\nSCALARS t double 1\nLOOKUP_TABLE default\n";
    for (const double value : values) text << value << '\n';
  }
  return text.str();
}

/// The cells with points of their own; point i of cell c is moved by `moved(c, i)` along x.
template <typename Moved>
std::string own_points(const std::vector<Point>& points, const std::vector<std::array<int, 8>>& cells, Moved moved) {
  std::vector<Point> own;
  std::vector<std::array<int, 8>> renumbered;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    auto& cell = renumbered.emplace_back();
    for (std::size_t i = 0; i < 8; ++i) {
      cell[i] = static_cast<int>(own.size());
      own.push_back(points[static_cast<std::size_t>(cells[c][i])]);
      own.back()[0] += moved(c, i);
    }
  }
  return vtk_of(own, renumbered);
}

struct Ring {
  std::vector<Point> points;
  std::vector<std::array<int, 8>> cells;
};

/// 24 cells round, two across and two high.
Ring ring_of_96() {
  Ring ring;
  constexpr int kRound = 24, kAcross = 2, kHigh = 2;
  const auto point = [](int i, int j, int k) { return (i % kRound * (kAcross + 1) + j) * (kHigh + 1) + k; };
  for (int i = 0; i < kRound; ++i) {
    for (int j = 0; j <= kAcross; ++j) {
      for (int k = 0; k <= kHigh; ++k) {
        const double angle = 2 * std::numbers::pi * i / kRound, radius = 8 + 2 * j;
        ring.points.push_back({radius * std::cos(angle), radius * std::sin(angle), 2.0 * k});
      }
    }
  }
  for (int i = 0; i < kRound; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      for (int k = 0; k < kHigh; ++k) {
        ring.cells.push_back({point(i, j, k), point(i, j + 1, k), point(i + 1, j + 1, k), point(i + 1, j, k),
                              point(i, j, k + 1), point(i, j + 1, k + 1), point(i + 1, j + 1, k + 1),
                              point(i + 1, j, k + 1)});
      }
    }
  }
  return ring;
}

/// Cubes of 10 mm at these places, with common points.
std::string voxels(const std::vector<std::array<int, 3>>& places) {
  std::vector<Point> points;
  for (int z = 0; z <= 3; ++z) {
    for (int y = 0; y <= 3; ++y) {
      for (int x = 0; x <= 3; ++x) points.push_back({10.0 * x, 10.0 * y, 10.0 * z});
    }
  }
  std::vector<std::array<int, 8>> cells;
  for (const auto& [x, y, z] : places) {
    const int low = x + 4 * y + 16 * z;
    cells.push_back({low, low + 1, low + 5, low + 4, low + 16, low + 17, low + 21, low + 20});
  }
  return vtk_of(points, cells);
}

class MergingCommand : public CommandLine {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    cli::write_file(path(name), text);
    return path(name);
  }
  /// The layers of a job, one after the other.
  std::string layers(const std::string& mesh, const std::string& name) {
    const ProcessResult sliced = run({"slice", mesh, "--pitch", "0.5", "--no-contact-sheet", "-o", path(name)});
    EXPECT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    std::string bytes;
    for (int layer = 0; layer < 8; ++layer) {
      bytes += content(path(name) + "/layer_000" + std::to_string(layer) + "_occupancy.png");
    }
    return bytes;
  }
};

TEST_F(MergingCommand, SlicesCellsWithOwnPointsAsThoseWithCommonOnes) {
  const Ring ring = ring_of_96();
  const std::string common = write("common.vtk", vtk_of(ring.points, ring.cells));
  const std::string own = write("own.vtk", own_points(ring.points, ring.cells, [](auto, auto) { return 0; }));
  ASSERT_EQ(run_alone({"convert", common, "-o", path("common.ccmesh")}).exit_code, cli::kExitOk);
  const ProcessResult converted = run_alone({"convert", own, "-o", path("own.ccmesh")});
  ASSERT_EQ(converted.exit_code, cli::kExitOk) << converted.err;
  EXPECT_THAT(converted.err, HasSubstr("note: 768 points lie in 216 places and become one vertex in each: they are at "
                                       "the same coordinates (--no-merge keeps points apart)"));
  const ProcessResult info = run_alone({"info", own, "--json"});
  EXPECT_EQ(json_at(info.out, "vertices").number_value(), 216);
  EXPECT_EQ(json_at(info.out, "parts").number_value(), 1);
  EXPECT_EQ(json_at(info.out, "control_volume_mm3").number_value(),
            json_at(run_alone({"info", common, "--json"}).out, "control_volume_mm3").number_value());
  const std::string sliced = layers(common, "sliced_common");
  EXPECT_FALSE(sliced.empty());
  EXPECT_EQ(layers(own, "sliced_own"), sliced);
}

TEST_F(MergingCommand, TakesSinglePrecisionAsTheFileHasIt) {
  const std::vector<Point> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {0, 1, 1}, {1, 1, 1}, {2, 1, 1}};
  const std::vector<std::array<int, 8>> cells = {{0, 1, 4, 3, 6, 7, 10, 9}, {1, 2, 5, 4, 7, 8, 11, 10}};
  // Where the cells meet those of the second are two units in the last place of a float off.
  const std::string own = write("own.vtk", own_points(points, cells, [](std::size_t cell, std::size_t i) {
                                  return cell == 1 && i % 4 % 3 == 0 ? std::ldexp(1, -22) : 0;
                                }));
  for (const std::vector<std::string>& units : {{}, std::vector<std::string>{"--units", "in"}}) {
    std::vector<std::string> arguments = {"info", own, "--json"};
    arguments.insert(arguments.end(), units.begin(), units.end());
    const ProcessResult info = run_alone(arguments);
    EXPECT_EQ(json_at(info.out, "vertices").number_value(), 12) << info.out << info.err;
  }
}

TEST_F(MergingCommand, SaysLoudlyThatCellsAreParts) {
  const Ring ring = ring_of_96();
  // Neighbours are in different ones of eight classes.
  const auto moved = [](std::size_t cell, std::size_t) { return 1e-6 * static_cast<double>(cell % 8); };
  const std::string own = write("own.vtk", own_points(ring.points, ring.cells, moved));
  const ProcessResult plan = run({"plan", own, "--pitch", "0.5"});
  ASSERT_EQ(plan.exit_code, cli::kExitOk) << plan.err;
  EXPECT_THAT(plan.err, HasSubstr("note: the mesh falls into 96 separate parts, 96 of them of one cell; points of "
                                  "different parts are no more than 7e-06 mm apart: with --merge-points 7.7e-06 there "
                                  "are no separate ones"));
  const ProcessResult info = run_alone({"info", own});
  EXPECT_THAT(info.out, AllOf(HasSubstr("parts      96, 96 of them of one cell"),
                              HasSubstr("note       the mesh falls into 96 separate parts")));
  EXPECT_THAT(
      json_at(run({"plan", own, "--pitch", "0.5", "--json"}).out, "notes").list_value().values(0).string_value(),
      HasSubstr("96 separate parts"));
  EXPECT_THAT(run_alone({"info", own, "--merge-points", "7.7e-6"}).out,
              AllOf(Not(HasSubstr("separate")), HasSubstr("up to 7e-06 mm apart")));
  const std::string same = write("same.vtk", own_points(ring.points, ring.cells, [](auto, auto) { return 0; }));
  EXPECT_THAT(run_alone({"convert", same, "--no-merge", "-o", path("apart.ccmesh")}).err,
              HasSubstr("96 of them of one cell; points of different parts are at the same coordinates: without "
                        "--no-merge there are no separate ones"));
  const std::string far = write("far.vtk", own_points(ring.points, ring.cells, [](std::size_t cell, auto) {
                                  return 50.0 * static_cast<double>(cell);
                                }));
  EXPECT_THAT(run_alone({"convert", far, "-o", path("far.ccmesh")}).err,
              HasSubstr("as cells are one part only by common points; --merge-points DISTANCE joins points"));
}

TEST_F(MergingCommand, LeavesMeshesOfTheContractAsTheyAre) {
  const Ring ring = ring_of_96();
  const std::string own = write("own.vtk", own_points(ring.points, ring.cells, [](auto, auto) { return 0; }));
  ASSERT_EQ(run_alone({"convert", own, "--no-merge", "-o", path("own.ccmesh")}).exit_code, cli::kExitOk);
  ASSERT_EQ(run_alone({"convert", path("own.ccmesh"), "-o", path("again.ccmesh")}).exit_code, cli::kExitOk);
  EXPECT_EQ(content(path("again.ccmesh")), content(path("own.ccmesh")));
  ASSERT_EQ(run_alone({"convert", path("own.ccmesh"), "--merge-points", "0", "-o", path("joined.ccmesh")}).exit_code,
            cli::kExitOk);
  ASSERT_EQ(run_alone({"convert", own, "-o", path("common.ccmesh")}).exit_code, cli::kExitOk);
  EXPECT_EQ(content(path("joined.ccmesh")), content(path("common.ccmesh")));
  ASSERT_EQ(run_alone({"convert", path("own.ccmesh"), "-o", path("own.json")}).exit_code, cli::kExitOk);
  EXPECT_EQ(json_at(run_alone({"info", path("own.json"), "--json"}).out, "parts").number_value(), 96);
}

TEST_F(MergingCommand, RefusesWrongDistances) {
  const std::string mesh = write("two.vtk", voxels({{0, 0, 0}, {1, 0, 0}}));
  EXPECT_THAT(run_alone({"info", mesh, "--merge-points", "near"}).err, HasSubstr("--merge-points"));
  EXPECT_EQ(run_alone({"info", mesh, "--merge-points", ""}).exit_code, cli::kExitUsage);
  const ProcessResult negative = run_alone({"info", mesh, "--merge-points=-1"});
  EXPECT_EQ(negative.exit_code, cli::kExitUsage);
  EXPECT_THAT(negative.err, HasSubstr("--merge-points takes a distance in mm, 0 or more, not '-1'"));
  EXPECT_EQ(run_alone({"info", mesh, "--merge-points", "1", "--no-merge"}).exit_code, cli::kExitUsage);
  const ProcessResult far = run_alone({"info", mesh, "--merge-points", "11"});
  EXPECT_EQ(far.exit_code, cli::kExitInput);
  EXPECT_THAT(far.err,
              AllOf(HasSubstr("points within 11 mm of each other are joined, which leaves a corner repeated in "
                              "cells 0, 1, the first at (5, 5, 5) mm: two of the first one's corners are 10 mm "
                              "apart before"),
                    HasSubstr("(--merge-points DISTANCE, --no-merge)")));
}

// A cube in two halves, wedges as hexahedra, each with points of its own.
TEST_F(MergingCommand, ReadsCellsThatAreCollapsedByPlace) {
  const std::vector<Point> points = {{0, 0, 0},  {10, 0, 0},  {10, 10, 0},  {0, 10, 0},
                                     {0, 0, 10}, {10, 0, 10}, {10, 10, 10}, {0, 10, 10}};
  const std::string own = own_points(points, {{0, 1, 2, 2, 4, 5, 6, 6}, {0, 2, 3, 3, 4, 6, 7, 7}},
                                     [](std::size_t, std::size_t i) { return i % 2 == 0 ? 0 : 1e-12; });
  const std::string mesh = write("halves.vtk", own);
  const ProcessResult info = run_alone({"info", mesh, "--as-meshed", "--json"});
  ASSERT_EQ(info.exit_code, cli::kExitOk) << info.err;
  EXPECT_THAT(info.out, HasSubstr("cells with repeated corners are read as what they are: 2 wedges"));
  EXPECT_EQ(json_at(info.out, "parts").number_value(), 1);
  EXPECT_EQ(json_at(info.out, "vertices").number_value(), 8);
  const ProcessResult apart = run_alone({"convert", mesh, "--no-merge", "-o", path("halves.ccmesh")});
  EXPECT_EQ(apart.exit_code, cli::kExitInput);
  const ProcessResult flat = run_alone(
      {"info", write("flat.vtk", own_points(points, {{0, 1, 2, 3, 0, 1, 2, 3}}, [](auto, auto) { return 0; }))});
  EXPECT_EQ(flat.exit_code, cli::kExitInput);
  EXPECT_THAT(flat.err, HasSubstr("a vertex is repeated in cell 0 at (5, 5, 0) mm"));
}

TEST_F(MergingCommand, NamesMidNodesAsTheFileDoes) {
  const std::string mesh =
      write("curved.inp",
            "*NODE\n1,0,0,0\n2,10,0,0\n3,0,10,0\n4,0,0,10\n12,5,0,0\n23,5,5,0\n31,0,5,0\n"
            "4711,0,0,2e6\n24,5,0,5\n34,0,5,5\n*ELEMENT,TYPE=C3D10\n501,1,2,3,4,12,23,31,4711,24,34\n");
  const ProcessResult refused = run_alone({"info", mesh, "--as-meshed"});
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, HasSubstr("coordinates beyond the limit at node 4711 at (0, 0, 2e+06) mm"));
}

TEST_F(MergingCommand, SaysThatPointsWereJoinedWhereCellsLieInEachOther) {
  const Ring ring = ring_of_96();
  std::vector<std::array<int, 8>> cells = ring.cells;
  for (int i = 0; i < 2; ++i) cells.push_back(cells.front());
  const std::string mesh = write("thrice.vtk", own_points(ring.points, cells, [](auto, auto) { return 0; }));
  EXPECT_THAT(run_alone({"convert", mesh, "-o", path("thrice.ccmesh")}).err,
              AllOf(HasSubstr("share one face, and there are 5 more such faces"),
                    HasSubstr("(points in one place were joined: --no-merge)")));
}

/// Two bodies of one node's place each, one inside the other's face: in contact, as CalculiX's decks have them.
TEST_F(MergingCommand, SaysThatPointsWereJoinedWhereBodiesInContactLieOnOneSideOfAFace) {
  const std::string mesh =
      write("contact.inp",
            "*NODE\n1,1,-1,1\n2,3,-1,1\n3,3,-1,-1\n4,1,-1,-1\n5,1,1,1\n6,3,1,1\n7,3,1,-1\n"
            "8,1,1,-1\n11,1,-1,1\n12,9,-1,1\n13,9,-1,-1\n14,1,-1,-1\n15,1,1,1\n16,9,1,1\n"
            "17,9,1,-1\n18,1,1,-1\n*ELEMENT,TYPE=C3D8\n2,1,2,3,4,5,6,7,8\n3,11,12,13,14,15,16,17,18\n");
  const ProcessResult refused = run_alone({"info", mesh});
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("on the same side of a face, in elements 2, 3"),
                                 HasSubstr("(points in one place were joined: --no-merge)")));
  EXPECT_EQ(run_alone({"info", mesh, "--no-merge"}).exit_code, cli::kExitOk);
}

TEST_F(MergingCommand, RefusesValuesThatDisagreeAndNamesTheWayOut) {
  std::vector<Point> points;
  std::vector<double> values;
  std::vector<std::array<int, 8>> cells(2);
  for (int c = 0; c < 2; ++c) {
    for (int i = 0; i < 8; ++i) {
      const double x = i == 1 || i == 2 || i == 5 || i == 6 ? 10 : 0, y = i % 4 > 1 ? 10 : 0, z = i > 3 ? 10 : 0;
      points.push_back({x + 10 * c, y, z});
      values.push_back(20 + 15 * c);
      cells[static_cast<std::size_t>(c)][static_cast<std::size_t>(i)] = 8 * c + i;
    }
  }
  const std::string text = vtk_of(points, cells, values);
  const std::string mesh = write("jump.vtk", text);
  const ProcessResult refused = run_alone({"convert", mesh, "-o", path("jump.ccmesh")});
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("channel 't' is 20 at "), HasSubstr(" and 35 at "),
                                 HasSubstr("values disagree in 3 more places"),
                                 HasSubstr("(--regions-from, --leave-out CHANNEL, --no-merge)")));
  const ProcessResult left = run_alone({"info", mesh, "--leave-out", "t"});
  ASSERT_EQ(left.exit_code, cli::kExitOk) << left.err;
  EXPECT_THAT(left.out, AllOf(HasSubstr("12, 0 sharp edges"), Not(HasSubstr("channel"))));
  const std::string marked =
      write("marked.vtk", text + "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n1\n2\n");
  const ProcessResult jumps = run_alone({"info", marked, "--regions-from", "part"});
  ASSERT_EQ(jumps.exit_code, cli::kExitOk) << jumps.err;
  EXPECT_THAT(jumps.out, AllOf(HasSubstr("at 4 of them each cell region keeps its own values"),
                               HasSubstr("2 hexahedra"), HasSubstr("12, 0 sharp edges")));
}

TEST_F(MergingCommand, PartsVoxelsThatTouchInAnEdge) {
  const std::string mesh = write("voxels.vtk", voxels({{0, 0, 0}, {1, 1, 0}, {2, 2, 1}}));
  const ProcessResult info = run_alone({"info", mesh});
  ASSERT_EQ(info.exit_code, cli::kExitOk) << info.err;
  EXPECT_THAT(info.out, AllOf(HasSubstr("the mesh touches itself in 1 edge and 1 vertex, the first at (10, 10, 5) mm: "
                                        "each side has vertices of its own there, 3 more in all; that makes 3 separate "
                                        "parts, 3 of them of one cell (--no-split refuses such meshes)"),
                              HasSubstr("parts      3, 3 of them of one cell")));
  const ProcessResult refused = run_alone({"info", mesh, "--no-split"});
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("edge "), HasSubstr("at (10, 10, 5) mm isn't manifold"),
                                 HasSubstr("leave out --no-split")));
  // A file of the contract that touches itself can't be taken as it is.
  ASSERT_EQ(run_alone({"convert", mesh, "-o", path("split.ccmesh")}).exit_code, cli::kExitOk);
  EXPECT_EQ(json_at(run_alone({"info", path("split.ccmesh"), "--json"}).out, "vertices").number_value(), 24);
}

TEST_F(MergingCommand, CountsEdgesThatAreNotManifold) {
  const std::string mesh =
      write("many.vtk", voxels({{0, 0, 0}, {1, 1, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0}, {1, 0, 1}}));
  EXPECT_THAT(run_alone({"convert", mesh, "--no-split", "-o", path("many.ccmesh")}).err,
              AllOf(HasSubstr("edges "), HasSubstr(" and 3 more, the first at ("), HasSubstr("aren't manifold")));
  EXPECT_EQ(run_alone({"convert", mesh, "-o", path("many.ccmesh")}).exit_code, cli::kExitOk);
}

TEST_F(MergingCommand, CountsVerticesOfListsAsTheFileDoes) {
  const std::string mesh =
      write("own.vtk", own_points(ring_of_96().points, ring_of_96().cells, [](auto, auto) { return 0; }));
  std::string list, values;
  list += "0 4\n";
  for (int i = 0; i < 768; ++i) values += "7\n";
  write("sharp.txt", list);
  write("values.txt", values);
  const ProcessResult info = run_alone(
      {"info", mesh, "--sharp-file", path("sharp.txt"), "--grade", "seven=file:" + path("values.txt"), "--json"});
  ASSERT_EQ(info.exit_code, cli::kExitOk) << info.err;
  EXPECT_EQ(json_at(info.out, "sharp_edges").number_value(), 1);
  EXPECT_EQ(json_at(info.out, "vertices").number_value(), 216);
}

}  // namespace
}  // namespace ccslice::client
