// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "client/cli/meshes/mesh_convert.h"
#include "tests/server/plan_slices_fixture.h"
#include "tests/support/job_parts.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::server {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST_F(PlanSlices, TellsTheGridAndTheSizes) {
  v1::PlaneSpec& channel = *request_.mutable_job()->add_planes();
  channel.mutable_channel()->set_name("x");
  channel.set_sample_type(v1::SAMPLE_TYPE_UINT16);
  channel.set_encoding(v1::PLANE_ENCODING_RAW);
  request_.mutable_job()->add_planes()->mutable_occupancy();
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
  request_.mutable_job()->mutable_grid()->mutable_origin_mm()->set_x(1);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(3);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_rows(4);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_layers(5);
  ASSERT_TRUE(plan().ok());
  EXPECT_EQ(response_.grid().origin_mm().x(), 1);
  EXPECT_EQ(response_.grid().extent().rows(), 4u);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_PART_CLIPPED));
}

TEST_F(PlanSlices, TellsTheRegionAndItsSizes) {
  request_.mutable_job()->add_planes()->mutable_occupancy();
  v1::VoxelBox& voxels = *request_.mutable_job()->mutable_region()->mutable_voxels();
  voxels.set_first_column(10);
  voxels.set_first_layer(15);
  voxels.mutable_extent()->set_columns(20);
  voxels.mutable_extent()->set_rows(50);
  voxels.mutable_extent()->set_layers(5);
  request_.mutable_job()->mutable_layout()->set_flip_x(true);
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
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(1000);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_rows(50);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_layers(20);
  v1::VoxelBox& voxels = *request_.mutable_job()->mutable_region()->mutable_voxels();
  voxels.set_first_column(500);
  voxels.mutable_extent()->set_columns(1);
  voxels.mutable_extent()->set_rows(1);
  voxels.mutable_extent()->set_layers(1);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_GRID_EMPTY));
}

TEST_F(PlanSlices, WarnsOfWhatTheUserShouldKnow) {
  request_.mutable_job()->mutable_grid()->mutable_origin_mm()->set_x(100);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(3);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_rows(4);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_layers(5);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_GRID_EMPTY));
  request_.mutable_job()->mutable_grid()->clear_origin_mm();
  request_.mutable_job()->mutable_grid()->clear_extent();
  request_.mutable_job()->mutable_tolerances()->set_contour_mm(0.5);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_COARSE_TOLERANCE));
  request_.mutable_job()->mutable_tolerances()->clear_contour_mm();
  for (const double number : {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0})
    placement_of(*request_.mutable_job()).add_matrix(number);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_MIRRORED));
  part_of(*request_.mutable_job()).clear_placements();
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(20);
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_THINNER_THAN_VOXEL));
}

TEST_F(PlanSlices, WarnsOfOverlapsWithPairsOfCellsAndTheirPlaces) {
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_two_blocks(9.9)));
  // Twice as large, and 100 mm aside.
  for (const double number : {2, 0, 0, 100, 0, 2, 0, 0, 0, 0, 2, 0})
    placement_of(*request_.mutable_job()).add_matrix(number);
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_OVERLAP));
  const v1::PlanWarning& overlap =
      *std::ranges::find(response_.warnings(), v1::PLAN_WARNING_KIND_OVERLAP, &v1::PlanWarning::kind);
  ASSERT_GT(overlap.places_mm_size(), 0);
  ASSERT_EQ(overlap.control_cells_size(), 2 * overlap.places_mm_size());
  EXPECT_LE(overlap.control_cells_size(), 32);
  EXPECT_LT(overlap.control_cells(0), 8u);
  EXPECT_GE(overlap.control_cells(1), 8u);
  EXPECT_GT(overlap.places_mm(0).x(), 118);
  EXPECT_LT(overlap.places_mm(0).x(), 121);
  EXPECT_THAT(overlap.message(),
              testing::ContainsRegex("by up to 0.[12][0-9.]* mm and about .* mm\\^3 in all, control cells " +
                                     std::to_string(overlap.control_cells(0)) + " and " +
                                     std::to_string(overlap.control_cells(1)) + " near \\("));
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(make_two_blocks(10)));
  EXPECT_FALSE(warns_of(v1::PLAN_WARNING_KIND_OVERLAP));
}

TEST_F(PlanSlices, WarnsWhereOverlapsWereNotAllLookedFor) {
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(cli::to_proto(oracle::nested_shells(16))));
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_OVERLAP));
  const v1::PlanWarning& overlap =
      *std::ranges::find(response_.warnings(), v1::PLAN_WARNING_KIND_OVERLAP, &v1::PlanWarning::kind);
  EXPECT_EQ(overlap.places_mm_size(), 0);
  EXPECT_THAT(overlap.message(), testing::HasSubstr("not all were looked at"));
}

TEST_F(PlanSlices, WarnsOfFoldsWithTheirPlaces) {
  v1::ControlMesh mesh = make_block(2, 10);
  mesh.set_positions_mm(3 * 13, 40);
  mesh.set_allow_folds(true);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_FOLDS));
  const v1::PlanWarning& folds = response_.warnings(0);
  EXPECT_GT(folds.places_mm_size(), 0);
  EXPECT_THAT(folds.message(), testing::ContainsRegex("limit cells, one of them in control cell " +
                                                      std::to_string(folds.control_cells(0)) + " near \\([0-9.-]+, "));
  EXPECT_TRUE(warns_of(v1::PLAN_WARNING_KIND_INVERTED_CELLS));
  for (const v1::PlanWarning& warning : response_.warnings()) {
    if (warning.kind() != v1::PLAN_WARNING_KIND_INVERTED_CELLS) continue;
    EXPECT_THAT(warning.message(),
                testing::ContainsRegex("^[0-9]+ control cells are inverted, the first near \\([0-9.-]+, "));
    EXPECT_GT(warning.control_cells_size(), 0);
    EXPECT_EQ(warning.places_mm_size(), warning.control_cells_size());
  }
}

// Its corner lies beyond the opposite one.
TEST_F(PlanSlices, WarnsOfASingleInvertedCell) {
  v1::ControlMesh mesh = make_block(2, 10);
  for (int coordinate = 0; coordinate < 3; ++coordinate) mesh.set_positions_mm(coordinate, 6);
  mesh.set_allow_folds(true);
  part_of(*request_.mutable_job()).set_mesh_id(server_.upload_good(mesh));
  ASSERT_TRUE(warns_of(v1::PLAN_WARNING_KIND_INVERTED_CELLS));
  const v1::PlanWarning& warning =
      *std::ranges::find(response_.warnings(), v1::PLAN_WARNING_KIND_INVERTED_CELLS, &v1::PlanWarning::kind);
  EXPECT_THAT(warning.message(), testing::StartsWith("1 control cell is inverted, "));
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
    placement_of(*request_.mutable_job()).add_matrix(entry);
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
    request_.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(pitch);
    const Failure refused = failure();
    EXPECT_EQ(refused.code, grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(refused.reason, reason) << pitch;
    EXPECT_EQ(refused.field, "job.grid.pitch.y_mm");
  };
  for (const double pitch : {0.0, -0.1, kNan, kInfinity}) expect(pitch, "PITCH_INVALID");
  for (const double pitch : {1e-9, 1e9}) expect(pitch, "PITCH_OUT_OF_RANGE");
  request_.mutable_job()->mutable_grid()->clear_pitch();
  EXPECT_EQ(failure().reason, "PITCH_MISSING");
  request_.mutable_job()->clear_grid();
  EXPECT_EQ(failure().reason, "PITCH_MISSING");
  EXPECT_EQ(failure().field, "job.grid.pitch");
  EXPECT_THAT(failure().message, HasSubstr("missing"));
}

TEST_F(PlanSlices, RefusesGridsBeyondTheLimits) {
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(1e-4);
  EXPECT_EQ(failure().reason, "GRID_TOO_LARGE");
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.1);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(4'000'000'000);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_rows(1);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_layers(1);
  EXPECT_EQ(failure().reason, "GRID_TOO_LARGE");
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(0);
  EXPECT_EQ(failure().reason, "GRID_EXTENT_ZERO");
  EXPECT_EQ(failure().field, "job.grid.extent.columns");
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_columns(60'000);
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_rows(60'000);
  EXPECT_EQ(failure().reason, "GRID_LAYER_TOO_LARGE");
  EXPECT_EQ(failure().field, "job.grid.extent");
  request_.mutable_job()->mutable_grid()->mutable_extent()->set_layers(2'000'000);
  EXPECT_EQ(failure().reason, "GRID_TOO_MANY_LAYERS");
  EXPECT_EQ(failure().field, "job.grid.extent.layers");
}

TEST_F(PlanSlices, RefusesWrongOrigins) {
  request_.mutable_job()->mutable_grid()->mutable_origin_mm()->set_z(kInfinity);
  EXPECT_EQ(failure().reason, "GRID_ORIGIN_NON_FINITE");
  request_.mutable_job()->mutable_grid()->mutable_origin_mm()->set_z(-1e8);
  EXPECT_EQ(failure().reason, "GRID_ORIGIN_OUT_OF_RANGE");
  EXPECT_EQ(failure().field, "job.grid.origin_mm.z");
}

TEST_F(PlanSlices, RefusesLayersLargerThanTheWindow) {
  ServerOptions options = test_options();
  options.stream_window_bytes = 1 << 20;
  TestServer server(options);
  part_of(*request_.mutable_job()).set_mesh_id(server.upload_good(make_box(2, 10)));
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(0.001);
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(0.001);
  request_.mutable_job()->add_planes()->mutable_channel()->set_name("x");
  grpc::ClientContext context;
  const Failure refused = failure_of(server.stub().PlanSlices(&context, request_, &response_));
  EXPECT_EQ(refused.reason, "LAYER_BYTES_TOO_LARGE");
  EXPECT_EQ(refused.field, "job.planes");
}

TEST_F(PlanSlices, RefusesWrongPlacements) {
  for (int i = 0; i < 12; ++i) placement_of(*request_.mutable_job()).add_matrix(0);
  EXPECT_EQ(failure().reason, "PLACEMENT_SINGULAR");
  placement_of(*request_.mutable_job()).set_matrix(3, kNan);
  EXPECT_EQ(failure().reason, "PLACEMENT_NON_FINITE");
  EXPECT_EQ(failure().field, "job.parts[0].placements[0].matrix[3]");
  placement_of(*request_.mutable_job()).add_matrix(0);
  EXPECT_EQ(failure().reason, "REQUEST_MALFORMED");
  EXPECT_EQ(failure().field, "job.parts[0].placements[0].matrix");
}

TEST_F(PlanSlices, RefusesWrongPlanes) {
  v1::PlaneSpec& plane = *request_.mutable_job()->add_planes();
  EXPECT_EQ(failure().reason, "CONTENT_INVALID");
  EXPECT_EQ(failure().field, "job.planes[0]");
  plane.mutable_channel()->set_name("nonsense");
  EXPECT_EQ(failure().reason, "CHANNEL_UNKNOWN");
  EXPECT_EQ(failure().field, "job.planes[0].channel.name");
  plane.mutable_channel()->set_name("x");
  plane.set_sample_type(static_cast<v1::SampleType>(99));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  EXPECT_EQ(failure().field, "job.planes[0].sample_type");
  plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  plane.set_encoding(static_cast<v1::PlaneEncoding>(99));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  EXPECT_EQ(failure().field, "job.planes[0].encoding");
  plane.set_encoding(v1::PLANE_ENCODING_PNG);
  EXPECT_EQ(failure().reason, "ENCODING_UNSUPPORTED");
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  plane.mutable_value_range()->set_min(1);
  plane.mutable_value_range()->set_max(1);
  EXPECT_EQ(failure().reason, "VALUE_RANGE_INVALID");
  EXPECT_EQ(failure().field, "job.planes[0].value_range");
  plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  EXPECT_EQ(failure().reason, "VALUE_RANGE_UNEXPECTED");
  plane.clear_value_range();
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT16);
  plane.set_outside_sample(70000);
  EXPECT_EQ(failure().reason, "OUTSIDE_SAMPLE_INVALID");
  EXPECT_EQ(failure().field, "job.planes[0].outside_sample");
}

TEST_F(PlanSlices, RefusesWrongTolerances) {
  for (const double tolerance : {0.0, -1.0, 1e-9, 100.0, kNan}) {
    request_.mutable_job()->mutable_tolerances()->set_contour_mm(tolerance);
    EXPECT_EQ(failure().reason, "TOLERANCE_INVALID") << tolerance;
    EXPECT_EQ(failure().field, "job.tolerances.contour_mm");
  }
  request_.mutable_job()->mutable_tolerances()->clear_contour_mm();
  for (const double tolerance : {-1e-9, 1.01, kNan}) {
    request_.mutable_job()->mutable_tolerances()->set_channel(tolerance);
    EXPECT_EQ(failure().reason, "TOLERANCE_INVALID") << tolerance;
    EXPECT_EQ(failure().field, "job.tolerances.channel");
  }
}

}  // namespace
}  // namespace ccslice::server
