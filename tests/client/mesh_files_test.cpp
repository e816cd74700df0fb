// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line's own mesh files, and what it does to a mesh on the way.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "client/cli/ccmesh.h"
#include "client/cli/mesh_convert.h"
#include "client/cli/mesh_source.h"
#include "client/cli/output_file.h"
#include "client/cli/text_values.h"
#include "core/base/error.h"
#include "core/mesh/mesh_file.h"
#include "core/mesh/models.h"
#include "core/mesh/validate.h"
#include "tests/client/process.h"
#include "tests/support/mutate.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::string fixture(const std::string& name) { return CCSLICE_TEST_DATA_DIR "/meshes/" + name; }

/// The message of the error that loading throws.
std::string error_of(const MeshOptions& options) {
  try {
    load_mesh(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

TEST(MeshFiles, JsonAndCcmeshHoldTheSameHouse) {
  const LoadedMesh binary = load_mesh({.mesh = fixture("house.ccmesh")});
  const LoadedMesh json = load_mesh({.mesh = fixture("house.json")});
  EXPECT_EQ(binary.bytes->bytes(), to_proto(json.mesh).SerializeAsString());
  EXPECT_EQ(binary.bytes->id(), json.bytes->id());
  EXPECT_THAT(json.mesh.channel_names, ElementsAre("hardness", "mix.0", "mix.1", "mix.2", "count.0", "count.1"));
  EXPECT_EQ(json.mesh.sharp_edges.size(), 2u);
  const LoadedMesh vtk = load_mesh({.mesh = fixture("vtk_binary_5_1.vtk")});
  EXPECT_EQ(vtk.mesh.positions, json.mesh.positions);
  EXPECT_EQ(vtk.mesh.cell_vertices, json.mesh.cell_vertices);
}

TEST(MeshFiles, JsonIsLossless) {
  ControlMesh mesh = make_ring();
  for (Vec3& position : mesh.positions) position += Vec3::Zero();  // JSON has no negative zero.
  mesh.positions[0] += Vec3(1e-17, 1.0 / 3, 0.1);
  mesh.channel_values[0] = 0.1f;
  mesh.sharp_vertices = {3};
  const v1::ControlMesh message = to_proto(mesh);
  EXPECT_EQ(parse_ccmesh(to_json(message)).SerializeAsString(), message.SerializeAsString());
}

TEST(MeshFiles, JsonMistakesTeach) {
  const TemporaryFolder folder;
  const auto error_of_text = [&](const std::string& text) {
    const std::string path = (folder.path() / "bad.json").string();
    write_file(path, text);
    return error_of({.mesh = path});
  };
  EXPECT_THAT(error_of_text("{\"positionsMm\": [1, 2, three]}"), HasSubstr("three"));
  EXPECT_THAT(error_of_text(" {\"positions\": [1, 2, 3]}"), HasSubstr("positions"));
  EXPECT_THAT(error_of_text("{}"), HasSubstr("no cellKinds"));
  EXPECT_THAT(error_of_text("plain text"), HasSubstr("OpenVolumeMesh"));
}

class MutatedCcmeshes : public testing::TestWithParam<const char*> {};

TEST_P(MutatedCcmeshes, GiveAMeshOrAnError) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  constexpr int kMutations = 1000;
  const std::string original = read_file_bytes(fixture(GetParam()), kMaxBytes);
  std::mt19937 random(20190528);
  int meshes = 0;
  for (int mutation = 0; mutation < kMutations; ++mutation) {
    try {
      ControlMesh mesh = from_proto(parse_ccmesh(oracle::mutated(original, random)));
      ++meshes;
      validate(mesh);
    } catch (const Error& error) {
      EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
    }
  }
  EXPECT_GT(meshes, 0);
  EXPECT_LT(meshes, kMutations);
}

INSTANTIATE_TEST_SUITE_P(Readers, MutatedCcmeshes, testing::Values("house.ccmesh", "house.json"),
                         [](const auto& info) { return std::string(info.param).substr(6); });

TEST(MeshFiles, AreSharpenedByAngle) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "box.ccmesh").string();
  ControlMesh box = make_box();
  box.sharp_edges.clear();
  box.sharp_vertices.clear();
  write_file(path, to_proto(box).SerializeAsString());
  const LoadedMesh sharp = load_mesh({.mesh = path, .sharp = {.angle_deg = 90}});
  EXPECT_GE(sharp.mesh.sharp_edges.size(), 12u);
  ASSERT_EQ(sharp.warnings.size(), 1u);
  EXPECT_THAT(sharp.warnings[0], HasSubstr("convex edges"));
  EXPECT_NE(sharp.bytes->id(), load_mesh({.mesh = path}).bytes->id());
  EXPECT_TRUE(load_mesh({.mesh = path, .sharp = {.angle_deg = 91}}).mesh.sharp_edges.empty());
  EXPECT_THAT(error_of({.mesh = path, .sharp = {.angle_deg = 0}}), HasSubstr("--sharp-angle takes degrees"));
}

TEST(MeshFiles, ReentrantEdgesAreTaggedOnDemandAndWarnedAbout) {
  const std::string house = fixture("meshio.mesh");  // Has a bend between its roof and the gable's tetrahedron.
  const LoadedMesh convex = load_mesh({.mesh = house, .sharp = {.angle_deg = 20}});
  const LoadedMesh all = load_mesh({.mesh = house, .sharp = {.angle_deg = 20, .reentrant = true}});
  ASSERT_EQ(convex.warnings.size(), 1u);
  EXPECT_THAT(convex.warnings[0], HasSubstr("stay smooth (--sharp-reentrant)"));
  ASSERT_EQ(all.warnings.size(), 2u);
  EXPECT_THAT(all.warnings[1], HasSubstr("often fold"));
  EXPECT_GT(all.mesh.sharp_edges.size(), convex.mesh.sharp_edges.size());
}

TEST(MeshFiles, AreSharpenedByAList) {
  const TemporaryFolder folder;
  const std::string list = (folder.path() / "sharp.txt").string();
  const MeshOptions options{.mesh = fixture("meshio.mesh"), .sharp = {.file = list}};
  write_file(list, "# the front edge and a corner\n0 1\n10\n");
  const LoadedMesh sharp = load_mesh(options);
  EXPECT_THAT(sharp.mesh.sharp_edges, ElementsAre(std::array<std::uint32_t, 2>{0, 1}));
  EXPECT_THAT(sharp.mesh.sharp_vertices, ElementsAre(10u));
  write_file(list, "0 6\n");
  EXPECT_THAT(error_of(options), HasSubstr("sharp edge 0-6 is no edge of any cell"));
  write_file(list, "0 99\n");
  EXPECT_THAT(error_of(options), HasSubstr("out of range"));
  write_file(list, "0 1\nrim\n");
  EXPECT_THAT(error_of(options), HasSubstr("sharp.txt: line 2: expected a vertex id, found 'rim'"));
}

TEST(MeshFiles, TakeSeveralGrades) {
  const TemporaryFolder folder;
  const std::string values = (folder.path() / "load.txt").string();
  write_file(values, "0 1 2 3 4 5 6 7 8 9 10\n");
  const LoadedMesh graded =
      load_mesh({.mesh = fixture("meshio.mesh"), .grades = {"a=z", "b=radial:z", "c=distance", "d=file:" + values}});
  EXPECT_THAT(graded.mesh.channel_names, ElementsAre("a", "b", "c", "d"));
  EXPECT_EQ(graded.mesh.channel_values[4 * 7 + 3], 7);
  EXPECT_THAT(error_of({.mesh = fixture("meshio.mesh"), .grades = {"a=z", "a=x"}}), HasSubstr("already"));
}

TEST(MeshFiles, IdsOfUploadedMeshesTakeNoChanges) {
  const std::string id = "sha256:" + std::string(64, '0');
  EXPECT_TRUE(names_mesh_id({.mesh = id}));
  EXPECT_THROW(names_mesh_id({.mesh = id, .sharp = {.angle_deg = 40}}), UsageError);
  EXPECT_THROW(names_mesh_id({.mesh = id, .sharp = {.file = "list.txt"}}), UsageError);
}

}  // namespace
}  // namespace ccslice::cli
