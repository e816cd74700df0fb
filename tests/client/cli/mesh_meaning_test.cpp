// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/mesh_meaning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "client/cli/base/console.h"
#include "client/cli/base/output_file.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "core/base/error.h"
#include "core/prepare/deviation.h"
#include "tests/client/process.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class MeantFile : public testing::Test {
 protected:
  std::string file_of(const ControlMesh& mesh) {
    const std::string path = (folder_.path() / "part.ccmesh").string();
    write_file(path, to_proto(mesh).SerializeAsString());
    return path;
  }

 private:
  TemporaryFolder folder_;
};

/// Two quarters of a tube, 10 to 20 mm wide, of so many cells each: its bore is reentrant, its ends turn by 90 degrees.
ControlMesh half_tube(int cells) {
  ControlMesh mesh = oracle::box_mesh(2, 2 * cells, 3, 1);
  for (Vec3& p : mesh.positions) {
    const double radius = 10 + 5 * p.x(), angle = p.y() * std::numbers::pi / 2 / cells;
    p = Vec3(radius * std::cos(angle), radius * std::sin(angle), 5 * p.z());
  }
  return mesh;
}

TEST_F(MeantFile, AsMeshedHasTheVolumeOfTheMeshAndMovesNothing) {
  const LoadedMesh loaded = load_mesh({.mesh = file_of(oracle::box_mesh(2, 2, 2, 10)), .meaning = {.as_meshed = true}});
  EXPECT_TRUE(loaded.mesh.as_meshed);
  EXPECT_THAT(loaded.warnings, IsEmpty());
  EXPECT_NEAR(measure_limit(loaded.mesh).deviation.limit_volume_mm3, 8000, 1e-9);
}

TEST_F(MeantFile, AsMeshedIsSizedAndGradedWithItsMidNodes) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1, 10);
  mesh.as_meshed = true;
  oracle::add_random_mid_nodes(0, false, 1, mesh);
  const LoadedMesh loaded = load_mesh({.mesh = file_of(mesh), .grades = {"g=x:0..4"}, .size = {.size = "20"}});
  ASSERT_EQ(12u, loaded.mesh.mid_nodes.positions.size());
  EXPECT_NEAR(measure_limit(loaded.mesh).deviation.limit_volume_mm3, 8000, 1e-6);
  for (std::size_t n = 0; n < 12; ++n) {
    EXPECT_NEAR(loaded.mesh.mid_nodes.values[n], loaded.mesh.mid_nodes.positions[n].x() / 5, 1e-6);
  }
}

TEST_F(MeantFile, ControlMeshesHaveNoMidNodes) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1, 10);
  oracle::add_random_mid_nodes(0, false, 1, mesh);
  const std::string with_nodes = load_mesh({.mesh = file_of(mesh)}).bytes->id();
  std::vector<std::string> notes;
  take_as(false, mesh, notes);
  EXPECT_TRUE(mesh.mid_nodes.empty());
  EXPECT_EQ(load_mesh({.mesh = file_of(mesh)}).bytes->id(), with_nodes) << "servers get none either";
  EXPECT_THAT(notes, ElementsAre(HasSubstr("12 nodes between corners are left out; --as-meshed keeps them")));
}

TEST_F(MeantFile, APartIsFittedAndKeepsItsEdges) {
  const LoadedMesh loaded = load_mesh({.mesh = file_of(half_tube(3)), .meaning = {.part = true}});
  EXPECT_TRUE(loaded.mesh.interpolating);
  EXPECT_FALSE(loaded.mesh.sharp_edges.empty());
  const Deviation deviation = measure_limit(loaded.mesh).deviation;
  const double tube_mm3 = std::numbers::pi / 2 * (400 - 100) * 15;
  EXPECT_NEAR(deviation.limit_volume_mm3 / tube_mm3, 1, 6e-3) << "round, as the part is, but for its ends";
  EXPECT_LT(deviation.control_volume_mm3 / tube_mm3, 0.96) << "the mesh is made of chords";
}

TEST_F(MeantFile, APartThatWouldFoldIsTakenAsMeshed) {
  ControlMesh mesh = oracle::sharp_fan(3, 300, 5);
  mesh.sharp_edges.clear();  // --part finds them by itself.
  const LoadedMesh loaded = load_mesh({.mesh = file_of(mesh), .meaning = {.part = true}});
  EXPECT_TRUE(loaded.mesh.as_meshed);
  EXPECT_TRUE(loaded.mesh.sharp_edges.empty());
  EXPECT_THAT(loaded.warnings, Contains(HasSubstr("--part: taken as meshed, since ")));
}

TEST_F(MeantFile, AFitThatRoundsEdgesIsRefusedUnlessItIsMeant) {
  MeshOptions options{.mesh = file_of(oracle::box_mesh(3, 3, 3, 10)), .meaning = {.fit = "all"}};
  try {
    load_mesh(options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshNotInterpolable);
    EXPECT_THAT(error.what(), HasSubstr("--part keeps such edges sharp"));
    EXPECT_THAT(error.what(), Not(HasSubstr("--fit=boundary"))) << "which would be refused as well";
  }
  options.meaning.smooth = true;
  EXPECT_NO_THROW(load_mesh(options));
  options.meaning = {.sharp = {.angle_deg = 40}, .fit = "all"};
  EXPECT_NO_THROW(load_mesh(options));
}

TEST(ParseMeaning, RefusesWhatContradictsItself) {
  EXPECT_EQ(parse_meaning({}), std::nullopt);
  EXPECT_EQ(parse_meaning({.part = true}), std::nullopt);
  EXPECT_EQ(parse_meaning({.smooth = true, .fit = "all"}), FittedVertices::kAll);
  EXPECT_THROW(parse_meaning({.as_meshed = true, .part = true}), UsageError);
  EXPECT_THROW(parse_meaning({.as_meshed = true, .fit = "all"}), UsageError);
  EXPECT_THROW(parse_meaning({.as_meshed = true, .sharp = {.angle_deg = 40}}), UsageError);
  EXPECT_THROW(parse_meaning({.part = true, .fit = "all"}), UsageError);
  EXPECT_THROW(parse_meaning({.smooth = true}), UsageError);
}

}  // namespace
}  // namespace ccslice::cli
