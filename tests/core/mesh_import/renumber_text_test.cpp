// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/renumber_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/mesh/offenders.h"
#include "core/mesh/validate.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

FileNumbers elements() {
  FileNumbers numbers{"node", "element", {}, {}};
  for (std::uint64_t i = 0; i < 40; ++i) {
    numbers.vertices.push_back(1000 + i);
    numbers.cells.push_back(501 + 10 * i);
  }
  return numbers;
}

TEST(RenumberText, PutsTheFilesNounsAndNumbersIn) {
  const FileNumbers numbers = elements();
  EXPECT_EQ(renumber_text("a corner in cells 0, 1 and 5 more: untangle them", numbers),
            "a corner in elements 501, 511 and 5 more: untangle them");
  EXPECT_EQ(renumber_text("no cell uses vertex 7: remove it", numbers), "no cell uses node 1007: remove it");
  EXPECT_EQ(renumber_text("cells 3 and 7 share more than one face", numbers),
            "elements 531 and 571 share more than one face");
  EXPECT_EQ(renumber_text("cells 1, 2 and 3 share one face", numbers), "elements 511, 521 and 531 share one face");
  EXPECT_EQ(renumber_text("edges 4-13, 5-14 and 2 more aren't manifold", numbers),
            "edges 1004-1013, 1005-1014 and 2 more aren't manifold");
  EXPECT_EQ(renumber_text("sharp edge 1-2 lies inside; sharp vertex 3 too", numbers),
            "sharp edge 1001-1002 lies inside; sharp node 1003 too");
  EXPECT_EQ(renumber_text("folds in 7 limit cells, one of them in control cell 2 near (1, 2, 3) mm", numbers),
            "folds in 7 limit cells, one of them in element 521 near (1, 2, 3) mm");
  EXPECT_EQ(renumber_text("boundary vertex 12 is 0.1 mm from its limit point. vertex 5.", numbers),
            "boundary node 1012 is 0.1 mm from its limit point. node 1005.");
}

TEST(RenumberText, NamesACellThatBecameSeveralOnce) {
  FileNumbers numbers = elements();
  numbers.cells = {501, 501, 502, 503, 503};
  EXPECT_EQ(renumber_text("inside out: cells 0, 1: untangle them", numbers), "inside out: element 501: untangle them");
  EXPECT_EQ(renumber_text("in cells 0, 1, 2, 3, 4", numbers), "in elements 501, 502, 503");
  EXPECT_EQ(renumber_text("in cells 0, 1 and 3 more", numbers), "in elements 501 and 3 more");
  EXPECT_EQ(renumber_text("control cells 3 and 4 near (1, 2, 3) mm", numbers), "element 503 near (1, 2, 3) mm");
  EXPECT_EQ(renumber_text("vertices 1, 1", numbers), "node 1001");
}

TEST(RenumberText, KnowsMidNodesByTheirNumbersInTheFile) {
  FileNumbers numbers = elements();
  EXPECT_EQ(renumber_text("beyond the limit at mid-nodes 0, 1", numbers), "beyond the limit at mid-nodes 0, 1");
  numbers.mid_nodes = {77, 55};
  EXPECT_EQ(renumber_text("beyond the limit at mid-nodes 0, 1: scale", numbers, {{{9}}, {{9}}}),
            "beyond the limit at nodes 77, 55: scale");
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.mid_nodes.edges = {{0, 1}, {1, 2}};
  mesh.mid_nodes.positions = {{5, 0, 0}, {0, 7, 0}};
  EXPECT_EQ(renumber_text("at mid-node 1: scale", numbers, {}, &mesh), "at node 55 at (0, 7, 0) mm: scale");
  EXPECT_EQ(renumber_text("at mid-node 2: scale", numbers, {}, &mesh), "at mid-node 2: scale");
}

TEST(RenumberText, LeavesWhatIsNoId) {
  const FileNumbers numbers = elements();
  for (const std::string text : {"3 cells, 7 vertices", "vertex ids run from 0 to 7", "cell 0.5", "cells 12%",
                                 "supercell 3", "edge 7", "edges 4-", "cell 3rd", "vertex -1", "cell", "cell ",
                                 "vertices 3 more", "cell 99999999999999999999", "cell 40", ""}) {
    EXPECT_EQ(renumber_text(text, numbers), text);
  }
  EXPECT_EQ(renumber_text("face of vertices 1, 2, 0.3 of an edge", numbers),
            "face of nodes 1001, 1002, 0.3 of an edge");
}

TEST(RenumberText, LeavesWhatStandsInQuotationMarks) {
  EXPECT_EQ(
      renumber_text("channel 'cell 3' jumps at the cell's vertex 7, 'vertex 1' at its cells' vertex 8", elements()),
      "channel 'cell 3' jumps at the cell's node 1007, 'vertex 1' at its cells' node 1008");
  EXPECT_EQ(renumber_text("an open 'cell 3", elements()), "an open 'element 531");
}

TEST(RenumberText, TakesOnlyTheIdsThatAreMeant) {
  const IdsInText ids{{{7}}, {{2}}};
  EXPECT_EQ(renumber_text("region 'cell 3': cell 2 at vertices 7, 8", elements(), ids),
            "region 'cell 3': element 521 at nodes 1007, 8");
}

TEST(RenumberText, CountsFromZeroWithoutNumbers) {
  EXPECT_EQ(renumber_text("control cell 3, vertex 4", {}), "control cell 3, vertex 4");
  EXPECT_EQ(renumber_text("cell 3, vertex 4", FileNumbers{"point", "cell", {}, {}}), "cell 3, point 4");
}

TEST(RenumberText, KnowsNumbersOf64Bits) {
  FileNumbers numbers{"node", "element", {}, {18'446'744'073'709'551'615u}};
  EXPECT_EQ(renumber_text("in cell 0", numbers), "in element 18446744073709551615");
}

TEST(RenumberText, SaysWhereTheFirstOneIs) {
  const ControlMesh mesh = oracle::box_mesh(2, 1, 1, 10);
  const auto placed = [&](const std::string& text) { return renumber_text(text, elements(), {}, &mesh); };
  EXPECT_EQ(placed("in cells 1, 0: untangle them"), "in elements 511, 501, the first at (15, 5, 5) mm: untangle them");
  EXPECT_EQ(placed("cells 0 and 1 share"), "elements 501 and 511, the first at (5, 5, 5) mm, share");
  EXPECT_EQ(placed("cell 1 and 5 more"), "element 511 and 5 more, the first at (15, 5, 5) mm");
  EXPECT_EQ(placed("edge 0-1 isn't"), "edge 1000-1001 at (5, 0, 0) mm isn't");
  EXPECT_EQ(placed("cell 1 near (1, 2, 3) mm"), "element 511 near (1, 2, 3) mm") << "it has a place";
  EXPECT_EQ(placed("cell 2"), "cell 2") << "the mesh has no such cell";
}

TEST(RenumberText, FindsTheIdsOfEveryRefusal) {
  FileNumbers numbers{"node", "element", {}, {}};
  constexpr std::uint64_t kFirst = 7'000'000'000;
  for (const auto& invalid : oracle::invalid_meshes()) {
    ControlMesh mesh = invalid.mesh;
    numbers.vertices.resize(mesh.vertex_count());
    numbers.cells.resize(mesh.cell_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) numbers.vertices[v] = kFirst + v;
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) numbers.cells[c] = 2 * kFirst + c;
    try {
      validate(mesh);
    } catch (const Error& error) {
      // Ids of channels and of regions, or of what the mesh hasn't got.
      if (error.ids().empty() || error.code() == ErrorCode::kMeshBadChannel) continue;
      if (error.code() == ErrorCode::kMeshBadCellRegion || error.code() == ErrorCode::kMeshIndexOutOfRange) continue;
      const std::string text = renumber_text(error.what(), numbers, {error.ids(), error.ids()}, &invalid.mesh);
      for (const std::int64_t id : error.ids()) {
        if (static_cast<std::size_t>(id) >= invalid.mesh.vertex_count()) continue;
        const auto number = static_cast<std::uint64_t>(id) + kFirst;
        const bool as_vertex = text.find(std::to_string(number)) != text.npos;
        const bool as_cell = text.find(std::to_string(number + kFirst)) != text.npos;
        EXPECT_TRUE(as_vertex || as_cell) << invalid.name << ": " << text;
      }
      if (error.code() == ErrorCode::kMeshNonFinite) continue;  // It is nowhere.
      EXPECT_THAT(text, testing::HasSubstr(") mm")) << invalid.name;
    }
  }
}

}  // namespace
}  // namespace ccslice
