// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours and triangles of real meshes, where they are at hand: planes through faces' corners and at random.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "core/mesh/mesh_file.h"
#include "tests/core/contour/contour_checks.h"
#include "tests/support/bfr_surface.h"

namespace ccslice {
namespace {

struct RealMesh {
  std::string file;
  bool against_bfr = false;  // Hexes only, and small enough to sample densely.
};

void PrintTo(const RealMesh& mesh, std::ostream* out) { *out << mesh.file; }

class ContourRealMesh : public testing::TestWithParam<RealMesh> {
 protected:
  void SetUp() override {
    const std::string path = std::string(CCSLICE_SHARED_MESHES_DIR) + "/" + GetParam().file;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " isn't there";
    mesh_ = read_mesh(read_file_bytes(path, 1u << 30)).mesh;
    mesh_.allow_folds = true;
    solid_ = LimitSolid::prepare(mesh_);
    diagonal_mm_ = solid_->summary().bounding_box.diagonal().norm();
  }

  ControlMesh mesh_;
  std::shared_ptr<const LimitSolid> solid_;
  double diagonal_mm_ = 0;
};

TEST_P(ContourRealMesh, LoopsCloseOnTheSurfaceThroughFacesCornersAndAnywhere) {
  LimitEvaluator evaluator(*solid_);
  const BoundarySurface surface(*solid_);
  std::mt19937 random(20261125);
  for (int trial = 0; trial < 24; ++trial) {
    const auto face = static_cast<std::uint32_t>(random() % surface.faces().size());
    const double s = trial % 2 == 0 ? 0 : 0.37;
    const Placement placement = trial % 3 == 0 ? Placement::Identity() : random_placement(random);
    const Vec3 through = placement * evaluator.geo(surface.cell_param(face, s, s));
    const SlicePlane plane = plane_through(through, trial % 6 == 0 ? Vec3(0, 0, 1) : random_direction(random));
    const ContourOptions options{.tolerance_mm = 1e-4 * diagonal_mm_, .smallest_feature_mm = 1e-3 * diagonal_mm_};
    const Contours contours = intersect(*solid_, placement, plane, options);
    EXPECT_LT(largest_error_on_surface(*solid_, placement, plane, contours), 1e-8 * diagonal_mm_) << "trial " << trial;
  }
}

TEST_P(ContourRealMesh, TrianglesClose) {
  const Triangulation triangles = triangulate(*solid_, Placement::Identity(), {.tolerance_mm = 1e-3 * diagonal_mm_});
  EXPECT_EQ(open_edges(triangles.all), 0u);
  // Inverted cells contradict their neighbours.
  if (solid_->summary().inverted_control_cells.empty()) {
    EXPECT_EQ(unmatched_edges(triangles.all), 0u);
  }
  EXPECT_GT(signed_volume(triangles.all), 0);
}

TEST_P(ContourRealMesh, PolygonsLieWithinTheToleranceOfOpenSubdivsSurface) {
  if (!GetParam().against_bfr) GTEST_SKIP() << "too large, or not of hexes alone";
  const oracle::BruteMesh mesh = oracle::to_brute_mesh(mesh_);
  const oracle::BfrSurface surface(mesh, oracle::build_topology(mesh.cells, mesh.vertex_count()));
  const oracle::NearestOnSurface nearest(surface, 6);
  const ContourOptions options{.tolerance_mm = 1e-5 * diagonal_mm_, .smallest_feature_mm = 1e-3 * diagonal_mm_};
  const Box3 box = solid_->placed_bounding_box(Placement::Identity());
  double worst = 0;
  for (const double share : {0.21, 0.5, 0.83}) {
    const SlicePlane plane = plane_through(box.min() + share * box.sizes(), Vec3(0.36, 0.48, 0.8));
    for (const ContourLoop& loop : intersect(*solid_, Placement::Identity(), plane, options).loops) {
      for (std::size_t k = 0; k < loop.points.size(); k += 2) {
        const Vec2 &p = loop.points[k].xy, &q = loop.points[(k + 1) % loop.points.size()].xy;
        worst = std::max(worst, nearest.distance(world_point(plane, 0.5 * (p + q))));
      }
    }
  }
  EXPECT_GT(worst, 0);
  EXPECT_LE(worst, options.tolerance_mm);
  RecordProperty("worst_share_of_tolerance", std::to_string(worst / options.tolerance_mm));
}

INSTANTIATE_TEST_SUITE_P(Meshes, ContourRealMesh,
                         testing::Values(RealMesh{"rod.vtk", true}, RealMesh{"fertility_cmu.vtk", true},
                                         RealMesh{"mountwithhole.vtk", true}, RealMesh{"bone_octree.vtk"},
                                         RealMesh{"lower_arm.vtk", true}, RealMesh{"joint_limit_folds.vtk"},
                                         RealMesh{"mixed_small.vtk"}, RealMesh{"ellipsoid.mesh", true},
                                         RealMesh{"rockerarm_cinolib.mesh"}, RealMesh{"screw2.mesh"},
                                         RealMesh{"sphinx_inverted.mesh"}),
                         [](const auto& info) { return info.param.file.substr(0, info.param.file.find('.')); });

}  // namespace
}  // namespace ccslice
