// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_ovm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/mesh/cell_kind.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/cell_numbers.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Writes a mesh as OpenVolumeMesh has it, every choice that the format leaves open made at random: the direction of
/// edges and faces, where rings begin, the order of a cell's faces.
class OvmWriter {
 public:
  OvmWriter(const ControlMesh& mesh, std::uint32_t seed) : random_(seed) {
    std::size_t begin = 0;
    for (const CellKind kind : mesh.cell_kinds) {
      add_cell(kind, &mesh.cell_vertices[begin]);
      begin += static_cast<std::size_t>(corner_count(kind));
    }
    text_ << "OVM ASCII\nVertices\n" << mesh.vertex_count() << '\n';
    text_.precision(17);
    for (const Vec3& p : mesh.positions) text_ << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    text_ << "Edges\n" << edges_.size() << '\n';
    for (const auto& edge : edges_) text_ << edge[0] << ' ' << edge[1] << '\n';
    write_lists("Faces", face_lists_);
    write_lists("Polyhedra", cell_lists_);
  }

  std::string text() const { return text_.str(); }

 private:
  using Ring = std::vector<std::uint32_t>;

  void add_cell(CellKind kind, const std::uint32_t* corners) {
    std::vector<std::uint32_t> half_faces;
    for (const LocalFace& face : cell_topology(kind).faces) {
      Ring ring;
      for (std::size_t i = 0; i < face.size; ++i) {
        ring.push_back(corners[kind == CellKind::kHex ? vtk_to_bits(face.corners[i]) : face.corners[i]]);
      }
      half_faces.push_back(half_face(ring));
    }
    std::shuffle(half_faces.begin(), half_faces.end(), random_);
    cell_lists_.push_back(half_faces);
  }

  std::uint32_t half_face(Ring ring) {
    Ring key = ring;
    std::sort(key.begin(), key.end());
    if (const auto found = faces_.find(key); found != faces_.end()) return found->second ^ 1;  // The other cell's side.
    const std::uint32_t flipped = random_() % 2;
    if (flipped) std::reverse(ring.begin(), ring.end());
    std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(random_() % ring.size()), ring.end());
    Ring half_edges;
    for (std::size_t i = 0; i < ring.size(); ++i) half_edges.push_back(half_edge(ring[i], ring[(i + 1) % ring.size()]));
    const auto id = static_cast<std::uint32_t>(2 * face_lists_.size());
    face_lists_.push_back(half_edges);
    return faces_[key] = id + flipped;
  }

  std::uint32_t half_edge(std::uint32_t from, std::uint32_t to) {
    for (std::size_t edge = 0; edge < edges_.size(); ++edge) {
      if (edges_[edge] == std::array{from, to}) return static_cast<std::uint32_t>(2 * edge);
      if (edges_[edge] == std::array{to, from}) return static_cast<std::uint32_t>(2 * edge + 1);
    }
    const std::uint32_t against = random_() % 2;
    edges_.push_back(against ? std::array{to, from} : std::array{from, to});
    return static_cast<std::uint32_t>(2 * edges_.size() - 2 + against);
  }

  void write_lists(const char* keyword, const std::vector<Ring>& lists) {
    text_ << keyword << '\n' << lists.size() << '\n';
    for (const Ring& list : lists) {
      text_ << list.size();
      for (const std::uint32_t id : list) text_ << ' ' << id;
      text_ << '\n';
    }
  }

  std::mt19937 random_;
  std::vector<std::array<std::uint32_t, 2>> edges_;
  std::map<Ring, std::uint32_t> faces_;
  std::vector<Ring> face_lists_, cell_lists_;
  std::ostringstream text_;
};

/// The vertices of each cell, sorted: what stays however corners are numbered.
std::vector<std::vector<std::uint32_t>> vertex_sets(const ControlMesh& mesh) {
  std::vector<std::vector<std::uint32_t>> sets;
  auto at = mesh.cell_vertices.begin();
  for (const CellKind kind : mesh.cell_kinds) {
    sets.emplace_back(at, at + corner_count(kind));
    std::sort(sets.back().begin(), sets.back().end());
    at += corner_count(kind);
  }
  return sets;
}

TEST(ReadOvm, RebuildsTheCornersOfEveryMeshOfTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh read = read_ovm(OvmWriter(mesh, 7).text()).mesh;
    EXPECT_EQ(read.positions, mesh.positions) << name;
    EXPECT_EQ(read.cell_kinds, mesh.cell_kinds) << name;
    EXPECT_EQ(vertex_sets(read), vertex_sets(mesh)) << name;
    const std::vector<std::uint32_t> as_read = read.cell_vertices;
    EXPECT_NO_THROW(validate(read)) << name;
    EXPECT_EQ(read.cell_vertices, as_read) << name << ": half-faces seen from outside give positive cells";
  }
}

const std::string kOvmTet =
    "OVM ASCII\nVertices\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nEdges\n6\n0 1\n1 2\n2 0\n0 3\n1 3\n2 3\n"
    "Faces\n4\n3 0 2 4\n3 0 8 7\n3 2 10 9\n3 4 6 11\nPolyhedra\n1\n4 1 2 4 6\n";

TEST(ReadOvm, ReadsATetrahedronWithCommentsAndAnyCase) {
  std::string text = "# made by hand\n" + kOvmTet;
  text.replace(text.find("Vertices"), 8, "VERTICES # four of them");
  ControlMesh mesh = read_ovm(text).mesh;
  EXPECT_THAT(mesh.cell_kinds, ElementsAre(CellKind::kTet));
  EXPECT_THAT(mesh.cell_vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_NO_THROW(validate(mesh));
}

TEST(ReadOvm, TakesCellsSeenFromInside) {
  std::string text = kOvmTet;
  text.replace(text.find("4 1 2 4 6"), 9, "4 0 3 5 7");
  ControlMesh mesh = read_ovm(text).mesh;
  const std::vector<std::uint32_t> as_read = mesh.cell_vertices;
  EXPECT_NO_THROW(validate(mesh));
  EXPECT_NE(mesh.cell_vertices, as_read);
}

TEST(ReadOvm, NumbersOfVerticesBecomeChannels) {
  const MeshFile file = read_ovm(kOvmTet +
                                 "VProp bool \"fixed\"\n0\n1\n1\n0\nVProp string \"label\"\n3\na b\n1\nx\n0\n\n2\ncd\n"
                                 "vprop vec2f \"u v\"\n0 1\n2 3\n4 5\n6 7\nFProp double \"area\"\n1\n1\n1\n1\n"
                                 "VProp vec9f \"odd\"\n1\n2\n3\n4\n");
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("fixed", "u v.0", "u v.1"));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(0, 0, 1, 1, 2, 3, 1, 4, 5, 0, 6, 7));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("'label'"), HasSubstr("'area'"), HasSubstr("'odd'")));
}

/// Two tetrahedra that share the face of vertices 1, 2, 3.
const std::string kOvmTwoTets =
    "OVM ASCII\nVertices\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\nEdges\n9\n0 1\n1 2\n2 0\n0 3\n1 3\n2 3\n1 4\n2 4\n3 4\n"
    "Faces\n7\n3 0 2 4\n3 0 8 7\n3 2 10 9\n3 4 6 11\n3 2 14 13\n3 10 16 15\n3 8 16 13\n"
    "Polyhedra\n2\n4 1 2 4 6\n4 5 9 11 12\n";

TEST(ReadOvm, NumbersOfCellsBecomeRegionsOrChannels) {
  MeshFile file = read_ovm(kOvmTwoTets +
                           "CProp int \"material\"\n7\n-3\ncprop vec2d \"grain\"\n1 0.5\n2 nan\n"
                           "CProp double \"density\"\n0.25\n0.75\nCProp string \"label\"\n1\na\n1\nb\n"
                           "CProp int \"material\"\n1\n2\nCProp int \"\"\n1\n2\nVProp float \"heat\"\n1\n2\n3\n4\n5\n");
  ASSERT_EQ(file.cell_numbers.size(), 4u);
  EXPECT_EQ(file.cell_numbers[0].name, "material");
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(7, -3));
  EXPECT_EQ(file.cell_numbers[1].name, "grain.0");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(1, 2));
  EXPECT_EQ(file.cell_numbers[2].name, "grain.1");
  EXPECT_TRUE(std::isnan(file.cell_numbers[2].of_cells[1]));
  EXPECT_THAT(file.cell_numbers[3].of_cells, ElementsAre(0.25, 0.75));
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("property 'label'"), HasSubstr("property 'material'"), HasSubstr("property ''")));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 3, 4, 5));
  make_cell_regions("material", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("-3", "7"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 0));
  EXPECT_NO_THROW(validate(file.mesh));
}

TEST(ReadOvm, KeepsSoManyNumbersOfCellsOnly) {
  std::string text = kOvmTwoTets;
  for (int i = 0; i < 20; ++i) text += "CProp float \"n" + std::to_string(i) + "\"\n1\n2\n";
  const MeshFile file = read_ovm(text);
  EXPECT_EQ(file.cell_numbers.size(), kMostCellNumbers);
  EXPECT_EQ(file.warnings.size(), 20 - kMostCellNumbers);
  expect_error([] { read_ovm(kOvmTwoTets + "CProp int \"material\"\n1\n"); }, ErrorCode::kFileSyntax,
               "expected a value, found the end of the file");
  expect_error([] { read_ovm(kOvmTwoTets + "CProp int \"material\"\n1\nx\n"); }, ErrorCode::kFileSyntax,
               "line 35: expected a value, found 'x'");
}

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kOvmTet;
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(ReadOvm, NamesLineAndToken) {
  expect_error([] { read_ovm(changed("1 0 0", "1 zero 0")); }, ErrorCode::kFileSyntax,
               "line 5: expected a coordinate, found 'zero'");
  expect_error([] { read_ovm(changed("1 0 0", "1 nan 0")); }, ErrorCode::kMeshNonFinite, "line 5");
  expect_error([] { read_ovm(changed("1 2\n", "1 4\n")); }, ErrorCode::kMeshIndexOutOfRange, "line 11");
  expect_error([] { read_ovm(changed("3 0 2 4", "3 0 2 12")); }, ErrorCode::kMeshIndexOutOfRange, "line 18");
  expect_error([] { read_ovm(changed("3 0 2 4", "3 0 2 5")); }, ErrorCode::kFileSyntax,
               "face 0 (from 0) don't form a closed loop");
  expect_error([] { read_ovm(changed("4 1 2 4 6", "4 1 2 4 8")); }, ErrorCode::kMeshIndexOutOfRange, "line 24");
  expect_error([] { read_ovm(changed("Edges", "Kanten")); }, ErrorCode::kFileSyntax, "expected 'Edges'");
  expect_error([] { read_ovm(kOvmTet + "VProp float hardness\n1\n"); }, ErrorCode::kFileSyntax, "quotation marks");
  expect_error([] { read_ovm(kOvmTet + "VProp float \"a\"\n1\n2\n3\n"); }, ErrorCode::kFileSyntax, "end of the file");
  expect_error([] { read_ovm(kOvmTet + "VProp float \"a\"\n1\n2\n3\n1e300\n"); }, ErrorCode::kMeshNonFinite, "float");
}

TEST(ReadOvm, RefusesCellsByTheirNumber) {
  expect_error([] { read_ovm(changed("4 1 2 4 6", "4 1 2 4 4")); }, ErrorCode::kMeshUnsupportedCell,
               "line 24: cell 0 (from 0)");
  expect_error([] { read_ovm(changed("4 1 2 4 6", "3 1 2 4")); }, ErrorCode::kMeshUnsupportedCell, "3 faces");
  expect_error([] { read_ovm(changed("4 1 2 4 6", "0")); }, ErrorCode::kMeshUnsupportedCell, "0 faces");
  const std::string pyramid =
      "OVM ASCII\nVertices\n5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\nEdges\n8\n0 1\n1 2\n2 3\n3 0\n0 4\n1 4\n2 4\n3 4\n"
      "Faces\n5\n4 0 2 4 6\n3 0 10 9\n3 2 12 11\n3 4 14 13\n3 6 8 15\nPolyhedra\n1\n5 1 2 4 6 8\n";
  EXPECT_THAT(read_ovm(pyramid).mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 4, 4, 4, 4));
}

TEST(ReadOvm, LeavesOutVerticesThatNoCellUses) {
  const MeshFile file = read_ovm(changed("4\n0 0 0\n", "5\n0 0 0\n").replace(kOvmTet.find("Edges"), 0, "nan 7 7\n") +
                                 "VProp float \"heat\"\n1\n2\n3\n4\nnan\n");
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_THAT(file.numbers.vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.numbers.cells, ElementsAre(0));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 vertex that no cell uses left out")));
}

TEST(ReadOvm, LeavesOutPropertiesWhoseNamesNoChannelMayHave) {
  const std::string values = "\n1\n2\n3\n4\n";
  const MeshFile file = read_ovm(kOvmTet + "VProp float \"" + std::string(257, 'x') + "\"" + values + "VProp int \"\"" +
                                 values + "VProp int \"a\"" + values + "VProp int \"a\"" + values);
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("a"));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("a name of 257 bytes"), HasSubstr("it has no name"),
                                         "array 'a' left out: it comes again"));
}

TEST(ReadOvm, TakesAnyHeaderThatOpenVolumeMeshTakes) {
  for (const char* header : {"OVM", "ovm", "OVM anything"}) {
    EXPECT_THAT(read_ovm(changed("OVM ASCII", header)).mesh.cell_vertices, ElementsAre(0, 1, 2, 3)) << header;
  }
}

TEST(ReadOvm, RefusesBinaryFilesAndEmptyOnes) {
  expect_error([] { read_ovm("OVM BINARY\n"); }, ErrorCode::kFileUnsupported, "save it as ASCII");
  expect_error([] { read_mesh(std::string("OVMB\n\r\n\xff\0\0", 10)); }, ErrorCode::kFileUnsupported,
               "OpenVolumeMesh's binary format (.ovmb)");
  expect_error([] { read_ovm("OVM ASCII\nVertices\n0\n"); }, ErrorCode::kMeshEmpty, "no vertices");
}

TEST(ReadOvm, NeverAllocatesOrLoopsOverWhatAFileMerelyClaims) {
  expect_error([] { read_ovm(changed("Edges\n6", "Edges\n4294967295")); }, ErrorCode::kMeshTooLarge, "at most");
  expect_error([] { read_ovm(changed("Edges\n6", "Edges\n2147483647")); }, ErrorCode::kFileSyntax, "vertex id");
  expect_error([] { read_ovm(changed("3 0 2 4", "900000000 0 2 4")); }, ErrorCode::kMeshTooLarge, "half-edges");
  expect_error([] { read_ovm("OVM ASCII\nVertices\n15000000\n0 0 0\n"); }, ErrorCode::kFileSyntax, "coordinate");
}

TEST(ReadOvm, EveryTruncationFailsCleanly) {
  for (std::size_t length = 0; length + 2 < kOvmTet.size(); ++length) {
    EXPECT_THROW(read_ovm(kOvmTet.substr(0, length)), Error) << length;
  }
}

}  // namespace
}  // namespace ccslice
