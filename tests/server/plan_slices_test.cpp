// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/vertex_fit/vertex_fit.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class PlanSlices : public ::testing::Test {
 protected:
  PlanSlices() {
    request_.set_mesh_id(server_.upload_good(make_box(2, 10)));
    request_.mutable_grid()->mutable_pitch()->set_x_mm(0.1);
    request_.mutable_grid()->mutable_pitch()->set_y_mm(0.2);
    request_.mutable_grid()->mutable_pitch()->set_z_mm(0.5);
  }

  grpc::Status plan() {
    grpc::ClientContext context;
    return server_.stub().PlanSlices(&context, request_, &response_);
  }
  Failure failure() { return failure_of(plan()); }
  bool warns_of(v1::PlanWarningKind kind) {
    const grpc::Status status = plan();
    EXPECT_TRUE(status.ok()) << status.error_message();
    for (const v1::PlanWarning& warning : response_.warnings()) {
      if (warning.kind() == kind) return !warning.message().empty();
    }
    return false;
  }

  TestServer server_;
  v1::PlanSlicesRequest request_;
  v1::PlanSlicesResponse response_;
};

TEST_F(PlanSlices, TellsTheGridAndTheSizes) {
  v1::PlaneSpec& channel = *request_.add_planes();
  channel.mutable_channel()->set_name("x");
  channel.set_sample_type(v1::SAMPLE_TYPE_UINT16);
  channel.set_encoding(v1::PLANE_ENCODING_RAW);
  request_.add_planes()->mutable_occupancy();
  const grpc::Status status = plan();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response_.grid().extent().columns(), 100u);
  EXPECT_EQ(response_.grid().extent().rows(), 50u);
  EXPECT_EQ(response_.layer_count(), 20u);
  EXPECT_NEAR(response_.size_mm().z(), 10, 1e-9);
  EXPECT_EQ(response_.raw_bytes_per_layer(), 100u * 50 * 2 + 13 * 50);
  EXPECT_EQ(response_.raw_bytes(), 20 * response_.raw_bytes_per_layer());
  EXPECT_GT(response_.estimated_bytes(), 20u * 100 * 50 * 2);
  EXPECT_EQ(response_.warnings_size(), 0);
}

TEST_F(PlanSlices, PlacesTheGridWhereItIsAskedFor) {
  request_.mutable_grid()->mutable_origin_mm()->set_x(1);
  request_.mutable_grid()->mutable_extent()->set_columns(3);
  request_.mutable_grid()->mutable_extent()->set_rows(4);
  request_.mutable_grid()->mutable_extent()->set_layers(5);
  ASSERT_TRUE(plan().ok());
  EXPECT_EQ(response_.grid().origin_mm().x(), 1);
  EXPECT_EQ(response_.grid().extent().rows(), 4u);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_PART_CLIPPED));
}

TEST_F(PlanSlices, TellsTheRegionAndItsSizes) {
  request_.add_planes()->mutable_occupancy();
  v1::VoxelRegion& voxels = *request_.mutable_region()->mutable_voxels();
  voxels.set_first_column(10);
  voxels.set_first_layer(15);
  voxels.mutable_extent()->set_columns(20);
  voxels.mutable_extent()->set_rows(50);
  voxels.mutable_extent()->set_layers(5);
  request_.mutable_layout()->set_flip_x(true);
  ASSERT_TRUE(plan().ok());
  EXPECT_EQ(response_.grid().extent().columns(), 100u);
  EXPECT_EQ(response_.region().SerializeAsString(), voxels.SerializeAsString());
  EXPECT_TRUE(response_.layout().flip_x());
  EXPECT_EQ(response_.layout().row_order(), v1::ROW_ORDER_ASCENDING_Y);
  EXPECT_EQ(response_.layer_count(), 5u);
  EXPECT_EQ(response_.raw_bytes(), 5u * 3 * 50);
  EXPECT_EQ(response_.warnings_size(), 0) << "a region is meant to cut off parts";
  voxels.mutable_extent()->set_columns(91);
  EXPECT_EQ(failure().reason, "REGION_OUT_OF_GRID");
}

TEST_F(PlanSlices, WarnsOfRegionsWithoutThePart) {
  request_.mutable_grid()->mutable_extent()->set_columns(1000);
  request_.mutable_grid()->mutable_extent()->set_rows(50);
  request_.mutable_grid()->mutable_extent()->set_layers(20);
  v1::VoxelRegion& voxels = *request_.mutable_region()->mutable_voxels();
  voxels.set_first_column(500);
  voxels.mutable_extent()->set_columns(1);
  voxels.mutable_extent()->set_rows(1);
  voxels.mutable_extent()->set_layers(1);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_GRID_EMPTY));
}

TEST_F(PlanSlices, WarnsOfWhatTheUserShouldKnow) {
  request_.mutable_grid()->mutable_origin_mm()->set_x(100);
  request_.mutable_grid()->mutable_extent()->set_columns(3);
  request_.mutable_grid()->mutable_extent()->set_rows(4);
  request_.mutable_grid()->mutable_extent()->set_layers(5);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_GRID_EMPTY));
  request_.mutable_grid()->clear_origin_mm();
  request_.mutable_grid()->clear_extent();
  request_.set_contour_tolerance_mm(0.5);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_COARSE_TOLERANCE));
  request_.clear_contour_tolerance_mm();
  for (const double number : {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}) request_.mutable_placement()->add_matrix(number);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_MIRRORED));
  request_.clear_placement();
  request_.mutable_grid()->mutable_pitch()->set_z_mm(20);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_THINNER_THAN_VOXEL));
}

TEST_F(PlanSlices, WarnsOfFoldsWithTheirPlaces) {
  v1::ControlMesh mesh = make_block(2, 10);
  mesh.set_positions_mm(3 * 13, 40);
  mesh.set_allow_folds(true);
  request_.set_mesh_id(server_.upload_good(mesh));
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_FOLDS));
  const v1::PlanWarning& folds = response_.warnings(0);
  EXPECT_GT(folds.places_mm_size(), 0);
  EXPECT_THAT(folds.message(), testing::ContainsRegex("limit cells, one of them in control cell " +
                                                      std::to_string(folds.control_cells(0)) + " near \\([0-9.-]+, "));
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_INVERTED_CELLS));
}

TEST_F(PlanSlices, TellsHowFarThePlacedPartIsFromItsControlMesh) {
  ASSERT_TRUE(plan().ok());
  EXPECT_NEAR(response_.deviation().control_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(response_.deviation().limit_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(response_.deviation().farthest_distance_mm(), 0, 1e-12);
  request_.set_mesh_id(server_.upload_good(make_block(2, 10)));
  for (const double number : {2, 0, 0, 100, 0, -2, 0, 0, 0, 0, 2, 0}) request_.mutable_placement()->add_matrix(number);
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
  request_.set_mesh_id(server_.upload_good(mesh));
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
  request_.set_mesh_id(server_.upload_good(mesh));
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
  request_.set_mesh_id(server_.upload_good(fitted_block(6, 12)));
  for (const double number : {2, 0, 0, 100, 0, 2, 0, 0, 0, 0, 2, 0}) request_.mutable_placement()->add_matrix(number);
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
  request_.set_mesh_id(server_.upload_good(mesh));
  for (const auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
    (request_.mutable_grid()->mutable_pitch()->*set)(1);
  }
  const auto of_regions = [](const v1::PlanWarning& warning) { return warning.message().starts_with("cell region"); };
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const auto found = std::ranges::find_if(response_.warnings(), of_regions);
  ASSERT_NE(found, response_.warnings().end());
  EXPECT_EQ(found->kind(), v1::PLAN_WARNING_KIND_DEVIATION);
  EXPECT_THAT(found->message(),
              testing::AllOf(HasSubstr("cell region 'core' is printed with 21.3 % less volume than its control cells, "
                                       "and 1 more of 2 change likewise. If that isn't meant, keep edges of interfaces "
                                       "sharp (sharp_edges, or --sharp-angle with --sharp-reentrant of ccslice)"),
                             HasSubstr("--interpolate")));
  const auto whole = std::ranges::find_if_not(response_.warnings(), of_regions);
  ASSERT_NE(whole, response_.warnings().end());
  EXPECT_THAT(whole->message(),
              testing::AllOf(HasSubstr("the limit, with the same volume as the control mesh; interface "
                                       "vertex "),
                             HasSubstr("--sharp-angle with --sharp-reentrant of ccslice")))
      << "its corners move by more than two voxels";
  EXPECT_TRUE(response_.deviation().farthest_on_interface());
  for (int cell = 0; cell < 64; ++cell) mesh.set_cell_regions(cell, 1);
  request_.set_mesh_id(server_.upload_good(mesh));
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION)) << "one region is the whole";
}

// A box, sharp all over, whose corner was to be 0.25 mm further out along x; its volume grows by a 600th.
TEST_F(PlanSlices, WarnsOfVerticesThatAFitMissed) {
  v1::ControlMesh mesh = make_box(2, 10);
  mesh.set_interpolating(true);
  mesh.add_missed_vertices(0);
  for (const double number : {-0.25, 0., 0.}) mesh.add_missed_positions_mm(number);
  request_.set_mesh_id(server_.upload_good(mesh));
  request_.mutable_grid()->mutable_pitch()->set_x_mm(0.51);
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  const v1::LimitDeviation& deviation = response_.deviation();
  EXPECT_EQ(deviation.farthest_vertex(), 0u);
  EXPECT_EQ(deviation.farthest_vertex_mm().x(), -0.25);
  EXPECT_NEAR(deviation.farthest_distance_mm(), 0.25, 1e-12);
  EXPECT_NEAR(deviation.limit_volume_mm3(), 1000, 1e-9);
  EXPECT_NEAR(deviation.control_volume_mm3(), 1000 + 0.25 * 25 / 4, 1e-9) << "a face of 5 mm bulges";
  request_.mutable_grid()->mutable_pitch()->set_x_mm(0.49);
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

// Smooth cubes of cells of 0.5 mm: their volume is within 0.5 %, and their corners move by 0.217 mm.
TEST_F(PlanSlices, WarnsOfVerticesThatMoveByMoreThanHalfAVoxel) {
  request_.set_mesh_id(server_.upload_good(make_block(20, 10)));
  const auto set_pitch = [&](double x, double y, double z) {
    request_.mutable_grid()->mutable_pitch()->set_x_mm(x);
    request_.mutable_grid()->mutable_pitch()->set_y_mm(y);
    request_.mutable_grid()->mutable_pitch()->set_z_mm(z);
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
    request_.mutable_placement()->add_matrix(number);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION)) << "so does the placement";
}

TEST_F(PlanSlices, WarnsOfVolumesThatDifferWhateverThePitch) {
  request_.set_mesh_id(server_.upload_good(make_block(2, 10)));
  for (const auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
    (request_.mutable_grid()->mutable_pitch()->*set)(9);
  }
  request_.set_smallest_feature_mm(0);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_DEVIATION));
  ASSERT_EQ(response_.warnings_size(), 1);
  EXPECT_THAT(response_.warnings(0).message(),
              testing::AllOf(HasSubstr("% less volume than the control mesh"), HasSubstr("2.165 mm, 0.2406 voxels"),
                             HasSubstr("keep edges sharp (sharp_edges, or --sharp-angle of ccslice)"),
                             HasSubstr("finer mesh, or control points fitted to the part (--interpolate of ccslice)")));
  ASSERT_EQ(response_.warnings(0).places_mm_size(), 1);
  EXPECT_EQ(response_.warnings(0).places_mm(0).SerializeAsString(),
            response_.deviation().farthest_vertex_mm().SerializeAsString());
}

TEST_F(PlanSlices, WarnsOfThinFeatures) {
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_THIN_FEATURE)) << "10 mm are many voxels";
  request_.set_smallest_feature_mm(10.5);
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_THIN_FEATURE));
  const v1::PlanWarning& warning = response_.warnings(0);
  EXPECT_THAT(warning.message(), HasSubstr("only 10 mm thick at ("));
  EXPECT_THAT(warning.message(), HasSubstr("10.5 mm"));
  EXPECT_GT(warning.places_mm_size(), 0);
  EXPECT_GT(warning.control_cells_size(), 0);
  request_.clear_smallest_feature_mm();
  for (const double entry : {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.08, 0.0}) {
    request_.mutable_placement()->add_matrix(entry);
  }
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_THIN_FEATURE)) << "0.8 mm in layers of 0.5 mm";
  request_.set_smallest_feature_mm(0);
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_THIN_FEATURE));
  for (const double wrong : {-1.0, kNan, kInfinity}) {
    request_.set_smallest_feature_mm(wrong);
    EXPECT_EQ(failure().reason, "TOLERANCE_INVALID") << wrong;
    EXPECT_EQ(failure().field, "smallest_feature_mm");
  }
}

TEST_F(PlanSlices, RefusesWrongPitches) {
  const auto expect = [this](double pitch, const std::string& reason) {
    request_.mutable_grid()->mutable_pitch()->set_y_mm(pitch);
    const Failure refused = failure();
    EXPECT_EQ(refused.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(refused.reason, reason) << pitch;
    EXPECT_EQ(refused.field, "grid.pitch.y_mm");
  };
  for (const double pitch : {0.0, -0.1, kNan, kInfinity}) expect(pitch, "PITCH_INVALID");
  for (const double pitch : {1e-9, 1e9}) expect(pitch, "PITCH_OUT_OF_RANGE");
  request_.mutable_grid()->clear_pitch();
  EXPECT_EQ(failure().reason, "PITCH_MISSING");
  request_.clear_grid();
  EXPECT_EQ(failure().reason, "PITCH_MISSING");
  EXPECT_EQ(failure().field, "grid.pitch");
  EXPECT_THAT(failure().message, HasSubstr("missing"));
}

TEST_F(PlanSlices, RefusesGridsBeyondTheLimits) {
  request_.mutable_grid()->mutable_pitch()->set_x_mm(1e-4);
  EXPECT_EQ(failure().reason, "GRID_TOO_LARGE");
  request_.mutable_grid()->mutable_pitch()->set_x_mm(0.1);
  request_.mutable_grid()->mutable_extent()->set_columns(4'000'000'000);
  request_.mutable_grid()->mutable_extent()->set_rows(1);
  request_.mutable_grid()->mutable_extent()->set_layers(1);
  EXPECT_EQ(failure().reason, "GRID_TOO_LARGE");
  request_.mutable_grid()->mutable_extent()->set_columns(0);
  EXPECT_EQ(failure().reason, "GRID_EXTENT_ZERO");
  EXPECT_EQ(failure().field, "grid.extent.columns");
  request_.mutable_grid()->mutable_extent()->set_columns(60'000);
  request_.mutable_grid()->mutable_extent()->set_rows(60'000);
  EXPECT_EQ(failure().reason, "GRID_LAYER_TOO_LARGE");
  EXPECT_EQ(failure().field, "grid.extent");
  request_.mutable_grid()->mutable_extent()->set_layers(2'000'000);
  EXPECT_EQ(failure().reason, "GRID_TOO_MANY_LAYERS");
  EXPECT_EQ(failure().field, "grid.extent.layers");
}

TEST_F(PlanSlices, RefusesWrongOrigins) {
  request_.mutable_grid()->mutable_origin_mm()->set_z(kInfinity);
  EXPECT_EQ(failure().reason, "GRID_ORIGIN_NON_FINITE");
  request_.mutable_grid()->mutable_origin_mm()->set_z(-1e8);
  EXPECT_EQ(failure().reason, "GRID_ORIGIN_OUT_OF_RANGE");
  EXPECT_EQ(failure().field, "grid.origin_mm.z");
}

TEST_F(PlanSlices, RefusesLayersLargerThanTheWindow) {
  ServerOptions options = test_options();
  options.stream_window_bytes = 1 << 20;
  TestServer server(options);
  request_.set_mesh_id(server.upload_good(make_box(2, 10)));
  request_.mutable_grid()->mutable_pitch()->set_x_mm(0.001);
  request_.mutable_grid()->mutable_pitch()->set_y_mm(0.001);
  request_.add_planes()->mutable_channel()->set_name("x");
  grpc::ClientContext context;
  const Failure refused = failure_of(server.stub().PlanSlices(&context, request_, &response_));
  EXPECT_EQ(refused.reason, "LAYER_BYTES_TOO_LARGE");
  EXPECT_EQ(refused.field, "planes");
}

TEST_F(PlanSlices, RefusesWrongPlacements) {
  for (int i = 0; i < 12; ++i) request_.mutable_placement()->add_matrix(0);
  EXPECT_EQ(failure().reason, "PLACEMENT_SINGULAR");
  request_.mutable_placement()->set_matrix(3, kNan);
  EXPECT_EQ(failure().reason, "PLACEMENT_NON_FINITE");
  EXPECT_EQ(failure().field, "placement.matrix[3]");
  request_.mutable_placement()->add_matrix(0);
  EXPECT_EQ(failure().reason, "REQUEST_MALFORMED");
  EXPECT_EQ(failure().field, "placement.matrix");
}

TEST_F(PlanSlices, RefusesWrongPlanes) {
  v1::PlaneSpec& plane = *request_.add_planes();
  EXPECT_EQ(failure().reason, "CONTENT_INVALID");
  EXPECT_EQ(failure().field, "planes[0]");
  plane.mutable_channel()->set_name("nonsense");
  EXPECT_EQ(failure().reason, "CHANNEL_UNKNOWN");
  EXPECT_EQ(failure().field, "planes[0].channel.name");
  plane.mutable_channel()->set_name("x");
  plane.set_sample_type(static_cast<v1::SampleType>(99));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  EXPECT_EQ(failure().field, "planes[0].sample_type");
  plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  plane.set_encoding(static_cast<v1::PlaneEncoding>(99));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  EXPECT_EQ(failure().field, "planes[0].encoding");
  plane.set_encoding(v1::PLANE_ENCODING_PNG);
  EXPECT_EQ(failure().reason, "ENCODING_UNSUPPORTED");
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  plane.mutable_value_range()->set_min(1);
  plane.mutable_value_range()->set_max(1);
  EXPECT_EQ(failure().reason, "VALUE_RANGE_INVALID");
  EXPECT_EQ(failure().field, "planes[0].value_range");
  plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  EXPECT_EQ(failure().reason, "VALUE_RANGE_UNEXPECTED");
  plane.clear_value_range();
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT16);
  plane.set_outside_sample(70000);
  EXPECT_EQ(failure().reason, "OUTSIDE_SAMPLE_INVALID");
  EXPECT_EQ(failure().field, "planes[0].outside_sample");
}

TEST_F(PlanSlices, RefusesWrongTolerances) {
  for (const double tolerance : {0.0, -1.0, 1e-9, 100.0, kNan}) {
    request_.set_contour_tolerance_mm(tolerance);
    EXPECT_EQ(failure().reason, "TOLERANCE_INVALID") << tolerance;
    EXPECT_EQ(failure().field, "contour_tolerance_mm");
  }
  request_.clear_contour_tolerance_mm();
  for (const double tolerance : {-1e-9, 1.01, kNan}) {
    request_.set_material_tolerance(tolerance);
    EXPECT_EQ(failure().reason, "TOLERANCE_INVALID") << tolerance;
    EXPECT_EQ(failure().field, "material_tolerance");
  }
}

}  // namespace
}  // namespace ccslice::server
