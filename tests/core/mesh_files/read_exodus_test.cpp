// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_exodus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/cell_averages.h"
#include "core/mesh_import/cell_numbers.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

std::string classic() { return read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/exodus_classic.e", 1 << 20); }

/// The file with another text of the same length in the place of the first one.
std::string with(std::string bytes, std::string_view text, std::string_view other) {
  const std::size_t at = bytes.find(text);
  EXPECT_NE(at, std::string::npos) << text;
  EXPECT_EQ(text.size(), other.size());
  return bytes.replace(at, text.size(), other);
}

/// The nodes of the hexahedron, as the file has them.
constexpr std::string_view kHexNodes("\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0\4\0\0\0\5", 20);

TEST(ReadExodus, BlocksAndElementSetsBecomeSets) {
  MeshFile file = read_exodus(classic());
  ASSERT_EQ(file.cell_sets.size(), 4u);
  EXPECT_EQ(file.cell_sets[0].name, "walls");
  EXPECT_EQ(file.cell_sets[1].name, "roof");
  EXPECT_EQ(file.cell_sets[2].name, "30") << "a block without a name is called by its id";
  EXPECT_EQ(file.cell_sets[3].name, "upper");
  EXPECT_THAT(file.cell_sets[3].cells, ElementsAre(1, 2)) << "without the shell";
  make_cell_regions("walls,roof,30", file);
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(0, 1, 2));
  make_cell_regions("block", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("10", "20", "30"));
}

TEST(ReadExodus, VariablesAtElementsBecomeNumbersOfTheLastStep) {
  MeshFile file = read_exodus(classic());
  ASSERT_EQ(file.cell_numbers.size(), 2u);
  EXPECT_EQ(file.cell_numbers[1].name, "density");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(2.5, 5, 7.5));
  average_cell_numbers("density", MeanOver::kAllCells, file);
  EXPECT_THAT(file.mesh.channel_names, Contains("density"));
}

TEST(ReadExodus, SaysWhatIsLeftOut) {
  EXPECT_THAT(read_exodus(classic()).warnings,
              ElementsAre("variable 'partial' at elements left out: 1 cells have no value in it",
                          "1 points, lines, faces and shells left out", "1 sets of nodes left out",
                          "1 sets of sides left out", "the last of 2 time steps taken, the others left out"));
}

std::string exodus_number(std::uint64_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
  return bytes;
}

std::string exodus_text(std::string text) {
  return exodus_number(text.size()) + text + std::string((4 - text.size() % 4) % 4, '\0');
}

/// A classic file of one tetrahedron with so many nodes, at (0, 0, 0), (1, 1, 1), and so on but for its corners.
std::string one_tet(std::uint64_t nodes) {
  const std::string none(8, '\0');
  std::string head = std::string("CDF\x01", 4) + exodus_number(0) + exodus_number(10) + exodus_number(5) +
                     exodus_text("num_dim") + exodus_number(3) + exodus_text("num_nodes") + exodus_number(nodes) +
                     exodus_text("num_el_blk") + exodus_number(1) + exodus_text("num_el_in_blk1") + exodus_number(1) +
                     exodus_text("num_nod_per_el1") + exodus_number(nodes) + none + exodus_number(11) +
                     exodus_number(4);
  const std::string type = exodus_text("TETRA" + std::to_string(nodes)),
                    attribute =
                        exodus_number(12) + exodus_number(1) + exodus_text("elem_type") + exodus_number(2) + type;
  const std::uint64_t coordinates = 4 * nodes;
  std::uint64_t begin = 0;
  std::string variables;
  const auto header_of = [&](std::uint64_t first) {
    begin = first;
    variables.clear();
    for (const char* name : {"coordx", "coordy", "coordz"}) {
      variables += exodus_text(name) + exodus_number(1) + exodus_number(1) + none + exodus_number(5) +
                   exodus_number(coordinates) + exodus_number(begin);
      begin += coordinates;
    }
    variables += exodus_text("connect1") + exodus_number(2) + exodus_number(3) + exodus_number(4) + attribute +
                 exodus_number(4) + exodus_number(coordinates) + exodus_number(begin);
    return head + variables;
  };
  std::string file = header_of(header_of(0).size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::uint64_t node = 0; node < nodes; ++node) {
      const float x = node < 4 ? static_cast<float>(node == axis + 1) : static_cast<float>(node);
      file += exodus_number(std::bit_cast<std::uint32_t>(x));
    }
  }
  for (std::uint64_t node = 1; node <= nodes; ++node) file += exodus_number(node);
  return file;
}

TEST(ReadExodus, SaysWhichNodesOfSecondOrderAreLeftOut) {
  for (const std::uint64_t nodes : {10, 14, 15}) {
    const MeshFile file = read_exodus(one_tet(nodes));
    EXPECT_EQ(file.mesh.mid_nodes.edges.size(), 6u) << nodes;
    EXPECT_EQ(file.mesh.mid_nodes.positions[0], Vec3(4, 4, 4)) << nodes;
    EXPECT_THAT(file.numbers.mid_nodes, testing::UnorderedElementsAre(5, 6, 7, 8, 9, 10)) << nodes;
    if (nodes == 10) {
      EXPECT_TRUE(file.warnings.empty()) << file.warnings.front();
    } else {
      EXPECT_THAT(file.warnings,
                  ElementsAre("1 cells have nodes in the middle of triangles or of themselves, which are "
                              "left out"));
    }
  }
}

TEST(ReadExodus, OtherCellsAreRefused) {
  expect_error([] { read_exodus(with(classic(), "TETRA10", "PYRAMID")); }, ErrorCode::kMeshUnsupportedCell,
               "block '30' has 1 elements of type 'PYRAMID', pyramids, of which only those of 5 nodes are read");
  expect_error([] { read_exodus(with(classic(), "TETRA10", "NFACED9")); }, ErrorCode::kMeshUnsupportedCell,
               "type 'NFACED9', which isn't read: save the part with");
  expect_error([] { read_exodus(with(classic(), "SHELL4", std::string_view("HEX8\0\0", 6))); }, ErrorCode::kFileSyntax,
               "'connect1' has too");
}

TEST(ReadExodus, OtherFilesAreRefused) {
  expect_error([] { read_exodus(with(classic(), "num_nodes", "num_nodez")); }, ErrorCode::kFileUnsupported,
               "is no Exodus file");
  expect_error(
      [] {
        read_exodus(
            with(classic(), std::string_view("num_dim\0\0\0\0\3", 12), std::string_view("num_dim\0\0\0\0\2", 12)));
      },
      ErrorCode::kMeshEmpty, "2 dimensions");
  expect_error([] { read_exodus(with(classic(), "coordx", "coordq")); }, ErrorCode::kFileSyntax,
               "no variable 'coordx'");
  expect_error([] { read_exodus(with(classic(), "connect2", "connect9")); }, ErrorCode::kFileSyntax,
               "no variable 'connect2'");
  const std::string unnumbered = with(with(classic(), "eb_prop1", "eb_prop9"), "eb_names", "eb_namez");
  EXPECT_EQ(read_exodus(unnumbered).mesh.cell_count(), read_exodus(classic()).mesh.cell_count());
  expect_error([&] { read_exodus(with(unnumbered, "num_el_blk", "num_el_blx")); }, ErrorCode::kMeshEmpty,
               "no hexahedra, tetrahedra or wedges");
  std::string another_shape = classic();
  another_shape[another_shape.find("coordx") + 15] = 3;  // The number of the dimension.
  expect_error([&] { read_exodus(another_shape); }, ErrorCode::kFileSyntax, "'coordx' has another shape");
}

TEST(ReadExodus, LimitsAreKept) {
  MeshLimits limits;
  limits.max_vertices = 16;
  expect_error([&] { read_exodus(classic(), limits); }, ErrorCode::kMeshTooLarge, "17 nodes, at most 16");
  limits = {};
  limits.max_cells = 2;
  expect_error([&] { read_exodus(classic(), limits); }, ErrorCode::kMeshTooLarge, "more than 2 cells");
}

TEST(ReadExodus, NodesHaveToExist) {
  std::string nodes(kHexNodes);
  nodes[3] = 0;
  expect_error([&] { read_exodus(with(classic(), kHexNodes, nodes)); }, ErrorCode::kMeshIndexOutOfRange,
               "uses node 0; the file has nodes 1 to 17");
  nodes[3] = 18;
  expect_error([&] { read_exodus(with(classic(), kHexNodes, nodes)); }, ErrorCode::kMeshIndexOutOfRange,
               "uses node 18; the file has nodes 1 to 17");
}

TEST(ReadExodus, HasTheFilesOwnNumbersIfTheyCount) {
  const std::string mapped = read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/second_order.e", 1 << 20);
  const std::string_view map("\0\0\1\xf5\0\0\1\xf6\0\0\1\xf7", 12);
  const MeshFile file = read_exodus(mapped);
  EXPECT_THAT(file.numbers.cells, ElementsAre(501, 502, 503));
  EXPECT_EQ(file.numbers.vertices.front(), 10u);
  EXPECT_TRUE(file.warnings.empty());
  for (const char last : {'\0', '\xff'}) {
    const std::string number(4, last);  // 0 and -1.
    const MeshFile counted = read_exodus(with(mapped, map, std::string(map.substr(0, 8)) + number));
    EXPECT_THAT(counted.numbers.cells, ElementsAre(1, 2, 3));
    EXPECT_THAT(counted.warnings, ElementsAre(HasSubstr("numbers in 'elem_num_map' left out, messages count from 1")));
  }
  const MeshFile without = read_exodus(classic());
  EXPECT_EQ(without.numbers.cells.front(), 2u) << "behind a shell";
  EXPECT_EQ(without.numbers.vertices.front(), 1u);
}

TEST(ReadExodus, NumbersThatNoVertexCanHaveAreNamed) {
  const std::string_view x22("\x40\x36\0\0\0\0\0\0", 8), nan("\x7f\xf8\0\0\0\0\0\0", 8), x17("\x40\x31\0\0\0\0\0\0", 8);
  expect_error([&] { read_exodus(with(classic(), x22, nan)); }, ErrorCode::kMeshNonFinite,
               "a coordinate of node 11, is not a finite number");
  expect_error([&] { read_exodus(with(classic(), x17, nan)); }, ErrorCode::kMeshNonFinite,
               "a coordinate of node 15, is");
  const std::string_view hard("\x40\x36\x80\0\0\0\0\0", 8), huge("\x7f\xe0\0\0\0\0\0\0", 8);
  expect_error([&] { read_exodus(with(classic(), hard, huge)); }, ErrorCode::kMeshNonFinite,
               "a value of node 6, is not finite, or too large for a float");
}

}  // namespace
}  // namespace ccslice
