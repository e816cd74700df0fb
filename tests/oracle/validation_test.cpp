// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Every tiny mesh is accepted, every invalid one refused for the right reason.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/limit/limit_solid.h"
#include "core/mesh/validate.h"
#include "core/prepare/prepare_solid.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

class Invalid : public testing::TestWithParam<std::size_t> {};

TEST_P(Invalid, MeshIsRefusedForItsReason) {
  const InvalidMesh& invalid = invalid_meshes()[GetParam()];
  ControlMesh mesh = invalid.mesh;
  try {
    validate(mesh);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(reason(error.code()), reason(invalid.code)) << error.what();
    EXPECT_TRUE(std::ranges::is_sorted(error.ids()));
    if (!invalid.ids.empty()) {
      EXPECT_FALSE(error.ids().empty()) << error.what();
      for (const std::int64_t id : error.ids()) {
        EXPECT_NE(std::ranges::find(invalid.ids, id), invalid.ids.end()) << id << ": " << error.what();
        EXPECT_NE(std::string(error.what()).find(std::to_string(id)), std::string::npos) << error.what();
      }
    }
  }
  EXPECT_EQ(mesh.cell_vertices, invalid.mesh.cell_vertices) << "changed although refused";
  EXPECT_THROW(prepare_solid(invalid.mesh), Error);
}

INSTANTIATE_TEST_SUITE_P(Meshes, Invalid, testing::Range<std::size_t>(0, invalid_meshes().size()),
                         [](const auto& info) { return invalid_meshes()[info.param].name; });

TEST(Valid, TinyMeshesAreAcceptedAsTheyAreAndMirrored) {
  for (const TinyMesh& tiny : tiny_meshes()) {
    ControlMesh mesh = tiny.mesh;
    EXPECT_NO_THROW(validate(mesh)) << tiny.name;
    EXPECT_EQ(mesh.cell_vertices, tiny.mesh.cell_vertices) << tiny.name;
    for (Vec3& p : mesh.positions) p.x() = -p.x();
    EXPECT_NO_THROW(validate(mesh)) << tiny.name << ", all cells mirrored";
  }
}

TEST(Valid, CellsOfEveryKindMayComeInTheMirroredOrder) {
  const auto mirrored_order = [](const ControlMesh& mesh, auto which) {
    std::vector<std::uint32_t> vertices = mesh.cell_vertices;
    auto corners = vertices.begin();
    for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
      const CellKind kind = mesh.cell_kinds[cell];
      const int count = corner_count(kind), half = count / 2;
      if (which(cell) && kind == CellKind::kTet) std::iter_swap(corners + 1, corners + 2);
      if (which(cell) && kind != CellKind::kTet) std::swap_ranges(corners, corners + half, corners + half);
      corners += count;
    }
    return vertices;
  };
  for (const TinyMesh& tiny : tiny_meshes()) {
    for (const std::size_t every : {1, 2, 3}) {
      ControlMesh mesh = tiny.mesh;
      mesh.cell_vertices = mirrored_order(tiny.mesh, [&](std::size_t cell) { return cell % every == 0; });
      EXPECT_NO_THROW(validate(mesh)) << tiny.name << ", every " << every;
      EXPECT_EQ(mesh.cell_vertices, tiny.mesh.cell_vertices) << tiny.name << ", every " << every;
    }
  }
}

TEST(Valid, RealMeshesThatMustBeRefusedAre) {
  // mixed_elements holds pyramids: the reader refuses already.
  const auto sphinx = read_real_mesh_ungraded("sphinx_inverted.mesh");
  if (!sphinx) GTEST_SKIP() << "sphinx_inverted.mesh isn't in " << CCSLICE_SHARED_MESHES_DIR;
  ControlMesh mesh = *sphinx;
  try {
    validate(mesh);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(reason(error.code()), "MESH_INVERTED_CELL") << error.what();
    EXPECT_FALSE(error.ids().empty());
  }
  mesh.allow_folds = true;
  EXPECT_GT(validate(mesh).inverted_cells.size(), 50u);
  EXPECT_THROW(read_real_mesh_ungraded("mixed_elements.vtk"), Error);
}

TEST(Folds, AreReportedWithPlacesWhereTheLimitFolds) {
  const auto folding = read_real_mesh_ungraded("joint_limit_folds.vtk");
  if (!folding) GTEST_SKIP() << "joint_limit_folds.vtk isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const auto solid = prepare_solid(*folding);
  const SolidSummary& summary = solid->summary();
  EXPECT_GT(summary.folding_cells, 0u);
  ASSERT_FALSE(summary.folds.empty());
  for (const FoldPlace& fold : summary.folds) {
    EXPECT_LE(fold.determinant, 0);
    EXPECT_EQ(fold.control_cell, solid->control_cell(fold.cell));
    EXPECT_TRUE(summary.bounding_box.contains(fold.position));
  }
  for (const std::string name : {"rod.vtk", "ellipsoid.mesh", "fertility_cmu.vtk"}) {
    const auto mesh = read_real_mesh_ungraded(name);
    if (mesh) {
      EXPECT_EQ(prepare_solid(*mesh)->summary().folding_cells, 0u) << name;
    }
  }
}

}  // namespace
}  // namespace ccslice::oracle
