// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What plans tell of a limit that is another part than its mesh.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/vertex_fit/vertex_fit.h"
#include "tests/server/plan_slices_fixture.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using ::testing::HasSubstr;

TEST_F(PlanSlices, TellsHowFarThePlacedPartIsFromItsControlMesh) {
  ASSERT_TRUE(plan().ok());
  EXPECT_NEAR(response_.deviation().control_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(response_.deviation().limit_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(response_.deviation().farthest_distance_mm(), 0, 1e-12);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_block(2, 10)));
  for (const double number : {2, 0, 0, 100, 0, -2, 0, 0, 0, 0, 2, 0})
    placement_of(*request_.mutable_job()).add_matrix(number);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_NEAR(deviation.control_volume_mm3(), 8000, 1e-9);
  EXPECT_GT(deviation.limit_volume_mm3(), 0.5 * 8000);
  EXPECT_LT(deviation.limit_volume_mm3(), 0.95 * 8000);
  EXPECT_EQ(deviation.control_box().min_mm().x(), 100);
  EXPECT_EQ(deviation.control_box().max_mm().x(), 120);
  EXPECT_EQ(deviation.control_box().min_mm().y(), -20);
  EXPECT_NEAR(deviation.farthest_distance_mm(), 2 * 5 * std::sqrt(3) / 4, 1e-9) << "a corner of cells of 10 mm";
  const v1::Vector3 &from = deviation.farthest_vertex_mm(), &to = deviation.farthest_limit_mm();
  EXPECT_NEAR(std::hypot(to.x() - from.x(), to.y() - from.y(), to.z() - from.z()), deviation.farthest_distance_mm(),
              1e-12);
  EXPECT_TRUE(std::abs(from.x() - 110) == 10 && std::abs(from.y() + 10) == 10 && std::abs(from.z() - 10) == 10)
      << from.DebugString();
}

// The middle of eight cubes is where it is; what counts is the mesh of the limit points.
TEST_F(PlanSlices, ComparesInterpolatingMeshesWithWhatTheyInterpolate) {
  v1::ControlMesh mesh = make_block(2, 10);
  mesh.set_interpolating(true);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_TRUE(deviation.interpolating());
  EXPECT_EQ(deviation.farthest_distance_mm(), 0);
  EXPECT_LT(deviation.control_volume_mm3(), 900) << "corners and edges are drawn in";
  EXPECT_LT(deviation.control_volume_mm3(), deviation.limit_volume_mm3());
  const auto& warnings = response_.warnings();
  const auto found = std::ranges::find(warnings, v1::PLAN_WARNING_KIND_DEVIATION, &v1::PlanWarning::kind);
  ASSERT_NE(found, warnings.end());
  EXPECT_THAT(found->message(),
              HasSubstr("than the mesh that it interpolates, which is more than it takes to be round between its "
                        "vertices. If that isn't meant, keep edges sharp"));
  EXPECT_EQ(found->places_mm_size(), 0);
}

// Its faces are flat where the limit is round, which holds more: no fault of the fit.
TEST_F(PlanSlices, TakesItThatFittedPartsHoldMoreThanTheirFlatFaces) {
  v1::ControlMesh mesh = make_block(6, 10);
  mesh.set_interpolating(true);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_GT(deviation.limit_volume_mm3(), 1.005 * deviation.control_volume_mm3());
  EXPECT_LT(deviation.limit_volume_mm3(), 1.05 * deviation.control_volume_mm3());
  EXPECT_EQ(deviation.farthest_distance_mm(), 0);
}

/// The block with control points whose limit passes through its vertices; its edges aren't sharp.
v1::ControlMesh fitted_block(std::uint32_t n, double size_mm) {
  v1::ControlMesh mesh = make_plain_block(n, size_mm);
  ControlMesh block;
  for (int i = 0; i < mesh.positions_mm_size(); i += 3) {
    block.positions.emplace_back(mesh.positions_mm(i), mesh.positions_mm(i + 1), mesh.positions_mm(i + 2));
  }
  block.cell_kinds.assign(static_cast<std::size_t>(mesh.cell_kinds_size()), CellKind::kHex);
  block.cell_vertices.assign(mesh.cell_vertices().begin(), mesh.cell_vertices().end());
  FitReport report;
  const ControlMesh fitted = VertexFit(block).fit_positions(FittedVertices::kAll, report);
  mesh.clear_positions_mm();
  for (const Vec3& position : fitted.positions) {
    for (const double coordinate : position) mesh.add_positions_mm(coordinate);
  }
  mesh.set_interpolating(true);
  return mesh;
}

// A box whose edges should have been sharp: what it holds more bulges out of its faces, few per cent though it is.
TEST_F(PlanSlices, WarnsOfEdgesThatAFitRounded) {
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(fitted_block(6, 12)));
  for (const double number : {2, 0, 0, 100, 0, 2, 0, 0, 0, 0, 2, 0})
    placement_of(*request_.mutable_job()).add_matrix(number);
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_NEAR(deviation.control_volume_mm3(), 8 * 12 * 12 * 12, 1e-6);
  EXPECT_GT(deviation.limit_volume_mm3(), 1.005 * deviation.control_volume_mm3());
  EXPECT_LT(deviation.limit_volume_mm3(), 1.05 * deviation.control_volume_mm3());
  EXPECT_EQ(deviation.rounded_edges(), 12 * 6u);
  EXPECT_NEAR(deviation.rounded_edge_deg(), 90, 1e-6);
  const auto& warnings = response_.warnings();
  const auto found = std::ranges::find(warnings, v1::PLAN_WARNING_KIND_DEVIATION, &v1::PlanWarning::kind);
  ASSERT_NE(found, warnings.end());
  EXPECT_THAT(
      found->message(),
      testing::AllOf(HasSubstr("% more volume than the mesh that it interpolates; 72 edges where the mesh turns "
                               "by 75 degrees or more aren't sharp, and the limit bulges there; the most, by "
                               "90 degrees, near ("),
                     HasSubstr("keep edges sharp (sharp_edges, or --sharp-angle of ccslice)")));
  ASSERT_EQ(found->places_mm_size(), 1);
  EXPECT_EQ(found->places_mm(0).SerializeAsString(), deviation.rounded_edge_mm().SerializeAsString());
  const v1::Vector3& place = found->places_mm(0);
  const auto on_edge = [](double x, double low) { return std::abs(std::abs(x - low - 12) - 12) < 1e-6; };
  EXPECT_EQ(on_edge(place.x(), 100) + on_edge(place.y(), 0) + on_edge(place.z(), 0), 2) << place.DebugString();
}

// A cube in a box: the box keeps its volume and the cube doesn't, as nothing keeps its edges sharp.
TEST_F(PlanSlices, WarnsOfCellRegionsThatChange) {
  v1::ControlMesh mesh = make_box(4, 20);
  for (const char* name : {"core", "shell", "unused"}) mesh.add_cell_region_names(name);
  for (int cell = 0; cell < 64; ++cell) {
    const auto inside = [&](int axis) {
      double middle = 0;
      for (int i = 8 * cell; i < 8 * cell + 8; ++i) {
        middle += mesh.positions_mm(3 * static_cast<int>(mesh.cell_vertices(i)) + axis) / 8;
      }
      return std::abs(middle - 10) < 5;
    };
    mesh.add_cell_regions(inside(0) && inside(1) && inside(2) ? 0 : 1);
  }
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  for (const auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
    (request_.mutable_job()->mutable_grid()->mutable_pitch()->*set)(1);
  }
  const auto of_regions = [](const v1::PlanWarning& warning) { return warning.message().starts_with("cell region"); };
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const auto found = std::ranges::find_if(response_.warnings(), of_regions);
  ASSERT_NE(found, response_.warnings().end());
  EXPECT_EQ(found->kind(), v1::PLAN_WARNING_KIND_DEVIATION);
  EXPECT_THAT(found->message(),
              testing::AllOf(HasSubstr("cell region 'core' is printed with 21.3 % less volume than its control cells, "
                                       "and 1 more of 2 change likewise. If that isn't meant: for a mesh that was made "
                                       "of a CAD part give ccslice --part; "),
                             HasSubstr("else keep edges of interfaces sharp (sharp_edges, or --sharp-angle with "
                                       "--sharp-reentrant of ccslice), or use a finer mesh")));
  const auto whole = std::ranges::find_if_not(response_.warnings(), of_regions);
  ASSERT_NE(whole, response_.warnings().end());
  EXPECT_THAT(whole->message(),
              testing::AllOf(HasSubstr("the limit, with the same volume as the control mesh; interface "
                                       "vertex "),
                             HasSubstr("--sharp-angle with --sharp-reentrant of ccslice")))
      << "its corners move by more than two voxels";
  EXPECT_TRUE(response_.deviation().farthest_on_interface());
  for (int cell = 0; cell < 64; ++cell) mesh.set_cell_regions(cell, 1);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION)) << "one region is the whole";
}

// Two halves of a box whose edges get rounded alike.
TEST_F(PlanSlices, SaysOnceThatTheWholeAndItsCellRegionsChangeAlike) {
  v1::ControlMesh mesh = make_plain_block(2, 10);
  for (const char* name : {"left", "right"}) mesh.add_cell_region_names(name);
  const auto middle_x = [&](int cell) {
    double middle = 0;
    for (int i = 8 * cell; i < 8 * cell + 8; ++i) {
      middle += mesh.positions_mm(3 * static_cast<int>(mesh.cell_vertices(i))) / 8;
    }
    return middle;
  };
  for (int cell = 0; cell < 8; ++cell) mesh.add_cell_regions(middle_x(cell) < 5 ? 0 : 1);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  request_.set_smallest_feature_mm(0);
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  EXPECT_EQ(response_.warnings_size(), 1) << response_.DebugString();
  EXPECT_THAT(response_.warnings(0).message(), HasSubstr("less volume than the control mesh"));
}

// A box, sharp all over, whose corner was to be 0.25 mm further out along x; its volume grows by a 600th.
TEST_F(PlanSlices, WarnsOfVerticesThatAFitMissed) {
  v1::ControlMesh mesh = make_box(2, 10);
  mesh.set_interpolating(true);
  mesh.add_missed_vertices(0);
  for (const double number : {-0.25, 0., 0.}) mesh.add_missed_positions_mm(number);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.51);
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_EQ(deviation.farthest_vertex(), 0u);
  EXPECT_EQ(deviation.farthest_vertex_mm().x(), -0.25);
  EXPECT_NEAR(deviation.farthest_distance_mm(), 0.25, 1e-12);
  EXPECT_NEAR(deviation.limit_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(deviation.control_volume_mm3(), 1000 + 0.25 * 25 / 4, 1e-9) << "a face of 5 mm bulges";
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.49);
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const auto& warnings = response_.warnings();
  const auto found = std::ranges::find(warnings, v1::PLAN_WARNING_KIND_DEVIATION, &v1::PlanWarning::kind);
  ASSERT_NE(found, warnings.end());
  EXPECT_THAT(found->message(),
              HasSubstr("than the mesh that it was fitted to; boundary vertex 0, which the fit missed, "
                        "is 0.25 mm, 0.5102 voxels, from its limit point."));
  ASSERT_EQ(found->places_mm_size(), 1);
  EXPECT_EQ(found->places_mm(0).x(), -0.25);
}

// A box, sharp all over, that a fit was to take 3 mm further out along x in one corner, 0.3 mm along z in another.
TEST_F(PlanSlices, WarnsOfTheVertexThatThePlanNamesUnlessVoxelsHideIt) {
  v1::ControlMesh mesh = make_box(2, 10);
  mesh.set_interpolating(true);
  for (const std::uint32_t corner : {0u, 26u}) mesh.add_missed_vertices(corner);
  for (const double number : {-3., 0., 0., 10., 10., 10.3}) mesh.add_missed_positions_mm(number);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(0.1);
  const auto told = [&](double x_mm) {
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(x_mm);
    EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
    EXPECT_EQ(response_.deviation().farthest_vertex(), 0u);
    const auto& warnings = response_.warnings();
    const auto found = std::ranges::find(warnings, v1::PLAN_WARNING_KIND_DEVIATION, &v1::PlanWarning::kind);
    return found == warnings.end() ? std::string() : found->message();
  };
  EXPECT_THAT(told(2), HasSubstr("boundary vertex 0, which the fit missed, is 3 mm, 1.5 voxels,"))
      << "as the plan says, though vertex 26 is 3 voxels away";
  EXPECT_THAT(told(10), HasSubstr("boundary vertex 26, which the fit missed, is 0.3 mm, 3 voxels,"));
}

// Smooth cubes of cells of 0.5 mm: their volume is within 0.5 %, and their corners move by 0.217 mm.
TEST_F(PlanSlices, WarnsOfVerticesThatMoveByMoreThanHalfAVoxel) {
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_block(20, 10)));
  const auto set_pitch = [&](double x, double y, double z) {
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(x);
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(y);
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(z);
  };
  set_pitch(0.44, 0.44, 0.44);
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  EXPECT_LT(std::abs(response_.deviation().limit_volume_mm3() - 1000), 5);
  EXPECT_GT(std::abs(response_.deviation().limit_volume_mm3() - 1000), 1);
  set_pitch(0.42, 0.42, 0.42);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  set_pitch(0.44, 0.44, 0.2);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION)) << "layers count as well";
  set_pitch(0.44, 0.44, 0.44);
  for (const double number : {1., 0., 0., 0., 0., 1.5, 0., 0., 0., 0., 1., 0.})
    placement_of(*request_.mutable_job()).add_matrix(number);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION)) << "so does the placement";
}

TEST_F(PlanSlices, WarnsOfVolumesThatDifferWhateverThePitch) {
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_block(2, 10)));
  for (const auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
    (request_.mutable_job()->mutable_grid()->mutable_pitch()->*set)(9);
  }
  request_.set_smallest_feature_mm(0);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  ASSERT_EQ(response_.warnings_size(), 1);
  EXPECT_THAT(response_.warnings(0).message(),
              testing::AllOf(HasSubstr("% less volume than the control mesh"), HasSubstr("2.165 mm, 0.2406 voxels"),
                             HasSubstr(". If that isn't meant: for a mesh that was made of a CAD part give ccslice "
                                       "--part; for one of finite elements --as-meshed (as_meshed); else keep edges "
                                       "sharp (sharp_edges, or --sharp-angle of ccslice), or use a finer mesh"),
                             testing::Not(HasSubstr("--fit"))))
      << "which is refused for such edges";
  ASSERT_EQ(response_.warnings(0).places_mm_size(), 1);
  EXPECT_EQ(response_.warnings(0).places_mm(0).SerializeAsString(),
            response_.deviation().farthest_vertex_mm().SerializeAsString());
}

}  // namespace
}  // namespace ccslice::server
