// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours and triangles of real meshes, where they are at hand: planes through faces' corners and at random.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/base/read_file.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/contour/contour_checks.h"

namespace ccslice {
namespace {

/// Planes through faces' corners and inner points.
void expect_loops_close(const LimitSolid& solid) {
  LimitEvaluator evaluator(solid);
  const BoundarySurface surface(solid);
  const double diagonal_mm = solid.summary().bounding_box.diagonal().norm();
  std::mt19937 random(20261125);
  for (int trial = 0; trial < 24; ++trial) {
    const BoundaryFaceId face{static_cast<std::uint32_t>(random() % surface.faces().size())};
    const double s = trial % 2 == 0 ? 0 : 0.37;
    const Placement placement = trial % 3 == 0 ? Placement::Identity() : random_placement(random);
    const Vec3 through = placement * evaluator.geo(surface.cell_param(face, s, s));
    const SlicePlane plane = plane_through(through, trial % 6 == 0 ? Vec3(0, 0, 1) : random_direction(random));
    const ContourOptions options{.tolerance_mm = 1e-4 * diagonal_mm, .smallest_feature_mm = 1e-3 * diagonal_mm};
    const Contours contours = intersect(solid, placement, plane, options);
    EXPECT_LT(largest_error_on_surface(solid, placement, plane, contours), 1e-8 * diagonal_mm) << "trial " << trial;
  }
}

void expect_triangles_close(const LimitSolid& solid) {
  const double diagonal_mm = solid.summary().bounding_box.diagonal().norm();
  const Triangulation triangles = triangulate(solid, Placement::Identity(), {.tolerance_mm = 1e-3 * diagonal_mm});
  EXPECT_GT(signed_volume(triangles.all), 0);
  EXPECT_EQ(open_edges(triangles.all), 0u);
  // Inverted cells contradict their neighbours.
  if (solid.summary().inverted_control_cells.empty()) {
    EXPECT_EQ(unmatched_edges(triangles.all), 0u);
  }
}

class ContourRealMesh : public testing::TestWithParam<const char*> {};

TEST_P(ContourRealMesh, LoopsAndTrianglesClose) {
  const std::string path = std::string(CCSLICE_SHARED_MESHES_DIR) + "/" + GetParam();
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " isn't there";
  ControlMesh mesh = read_mesh(read_file_bytes(path, 1u << 30)).mesh;
  mesh.allow_folds = true;
  const auto solid = prepare_solid(std::move(mesh));
  expect_loops_close(*solid);
  expect_triangles_close(*solid);
}

INSTANTIATE_TEST_SUITE_P(Meshes, ContourRealMesh,
                         testing::Values("rod.vtk", "fertility_cmu.vtk", "mountwithhole.vtk", "bone_octree.vtk",
                                         "lower_arm.vtk", "joint_limit_folds.vtk", "mixed_small.vtk", "ellipsoid.mesh",
                                         "rockerarm_cinolib.mesh", "screw2.mesh", "sphinx_inverted.mesh"),
                         [](const auto& info) {
                           const std::string file = info.param;
                           return file.substr(0, file.find('.'));
                         });

}  // namespace
}  // namespace ccslice
