// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Damaged files of every kind that the core reads: each gives a mesh or an Error, and no count in it makes a reader
// take more memory than the file's own bytes account for.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_authoring/sharpen.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/cell_averages.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/support/allocation_count.h"
#include "tests/support/mutate.h"

namespace ccslice {
namespace {

constexpr int kMutations = 1000;
constexpr std::uint32_t kSeed = 20190528;
constexpr std::size_t kMaxBytesPerByte = 400, kMaxFixedBytes = 1 << 20;

constexpr const char* kOriginals[] = {"meshio.mesh",
                                      "house.ovm",
                                      "house.inp",
                                      "assembly.inp",
                                      "regions.inp",
                                      "gmsh_ascii_2_2.msh",
                                      "gmsh_binary_2_2.msh",
                                      "gmsh_ascii_4_1.msh",
                                      "gmsh_binary_4_1.msh",
                                      "vtk_ascii_4_2.vtk",
                                      "vtk_ascii_5_1.vtk",
                                      "vtk_binary_4_2.vtk",
                                      "vtk_binary_5_1.vtk",
                                      "meshio_binary_5_1.vtk",
                                      "vtk_ascii.vtu",
                                      "vtk_binary.vtu",
                                      "vtk_binary_zlib.vtu",
                                      "vtk_binary_big_endian.vtu",
                                      "vtk_appended_raw.vtu",
                                      "vtk_appended_raw_zlib.vtu",
                                      "vtk_appended_base64.vtu",
                                      "vtk_appended_base64_zlib.vtu",
                                      "meshio_binary_zlib.vtu",
                                      "vtk_binary_lz4.vtu",
                                      "vtk_appended_raw_lzma.vtu",
                                      "polyhedra_vtk.vtu",
                                      "polyhedra_vtk_2_3.vtu",
                                      "polyhedra_vtk_5_1.vtk",
                                      "curved_vtk.vtu",
                                      "pyramids.vtk",
                                      "exodus_classic.e",
                                      "exodus_64_bit_offset.e",
                                      "exodus_64_bit_data.e",
                                      "second_order.inp",
                                      "second_order.msh",
                                      "second_order_binary.msh",
                                      "second_order.mesh",
                                      "second_order.e"};

std::string bytes_of(const std::string& name) {
  constexpr std::uint64_t kMaxFileBytes = 1 << 20;
  return read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/" + name, kMaxFileBytes);
}

void expect_consistent(const ControlMesh& mesh) {
  std::size_t corners = 0;
  for (const CellKind kind : mesh.cell_kinds) corners += static_cast<std::size_t>(corner_count(kind));
  EXPECT_EQ(mesh.cell_vertices.size(), corners);
  EXPECT_EQ(mesh.channel_values.size(), mesh.channel_count() * mesh.vertex_count());
  EXPECT_TRUE(std::all_of(mesh.cell_vertices.begin(), mesh.cell_vertices.end(),
                          [&](std::uint32_t vertex) { return vertex < mesh.vertex_count(); }));
}

/// Every way to make something of them gives a mesh or an Error, too.
void use_cell_numbers(const MeshFile& file) {
  std::vector<std::string> regions = {"sets"};
  for (const CellNumbers& numbers : file.cell_numbers) {
    EXPECT_EQ(numbers.of_cells.size(), file.mesh.cell_count()) << numbers.name;
    regions.push_back(numbers.name);
  }
  for (const CellSet& set : file.cell_sets) {
    EXPECT_TRUE(std::ranges::is_sorted(set.cells, std::ranges::less_equal()) && !set.cells.empty() &&
                set.cells.back() < file.mesh.cell_count())
        << set.name;
    regions.push_back(set.name);
  }
  for (const std::string& name : regions) {
    for (const bool average : {false, true}) {
      MeshFile changed = file;
      try {
        average ? average_cell_numbers(name, MeanOver::kAllCells, changed) : make_cell_regions(name, changed);
        expect_consistent(changed.mesh);
        EXPECT_TRUE(average || changed.mesh.cell_regions.size() == changed.mesh.cell_count());
        validate(changed.mesh);
      } catch (const Error& error) {
        EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
      }
    }
  }
}

class MutatedFiles : public testing::TestWithParam<const char*> {};

TEST_P(MutatedFiles, GiveAMeshOrAnError) {
  const std::string original = bytes_of(GetParam());
  std::mt19937 random(kSeed);
  int meshes = 0;
  for (int mutation = 0; mutation < kMutations; ++mutation) {
    const std::string bytes = oracle::mutated(original, random);
    const std::size_t before = oracle::allocated_bytes();
    const auto expect_little = [&] {
      EXPECT_LT(oracle::allocated_bytes() - before, kMaxFixedBytes + kMaxBytesPerByte * bytes.size())
          << "mutation " << mutation;
    };
    try {
      MeshFile file = read_mesh(bytes);
      expect_consistent(file.mesh);
      ++meshes;
      const MeshFile as_read = file;
      validate(file.mesh);
      expect_little();
      use_cell_numbers(as_read);
    } catch (const Error& error) {
      EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
      expect_little();
    }
  }
  EXPECT_GT(meshes, kMutations / 50) << "hardly any damage was harmless: does the file read at all?";
  EXPECT_LT(meshes, kMutations);
}

INSTANTIATE_TEST_SUITE_P(Readers, MutatedFiles, testing::ValuesIn(kOriginals), [](const auto& info) {
  std::string name = info.param;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

TEST(MutatedFilesOfAllKinds, MissNoReader) {
  std::set<MeshFileKind> kinds;
  for (const char* name : kOriginals) kinds.insert(mesh_file_kind(bytes_of(name)));
  EXPECT_FALSE(kinds.contains(MeshFileKind::kUnknown));
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(MeshFileKind::kUnknown)) << "the last one, after all that are read";
}

TEST(MutatedSharpFeatures, GiveAListOrAnError) {
  const std::string original = "# edges\n0 1\n1 2\n7\n12 13 # a comment\n\n4\n";
  std::mt19937 random(kSeed);
  int lists = 0;
  for (int mutation = 0; mutation < kMutations; ++mutation) {
    try {
      read_sharp_features(oracle::mutated(original, random));
      ++lists;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFileSyntax) << error.what();
    }
  }
  EXPECT_GT(lists, 0);
}

}  // namespace
}  // namespace ccslice
