// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Jobs of several parts, as clients see them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

void place(v1::Part& part, double x_mm) {
  v1::Placement& placement = *part.add_placements();
  for (const double entry : {1.0, 0.0, 0.0, x_mm, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) placement.add_matrix(entry);
}

/// Boxes of 10 mm in voxels of 1 mm, whose channel "x" is x.
class JobParts : public testing::Test {
 protected:
  JobParts() {
    box_ = server_.upload_good(make_box(2, 10));
    request_ = slice_request(box_, 1, 0, 10);
    job_ = request_.mutable_job();
    job_->clear_parts();
    v1::PlaneSpec& channel = *job_->add_planes();
    channel.mutable_channel()->set_name("x");
    channel.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
    channel.set_encoding(v1::PLANE_ENCODING_RAW);
  }

  v1::Part& add(const std::string& name, double x_mm) {
    v1::Part& part = *job_->add_parts();
    part.set_name(name);
    part.set_mesh_id(box_);
    place(part, x_mm);
    return part;
  }

  void add_white_and_black() {
    v1::Printing& printing = *job_->mutable_printing();
    for (const auto& [name, rgba] : {std::pair{"white", 0xffffffffu}, std::pair{"black", 0x000000ffu}}) {
      printing.add_materials()->set_name(name);
      printing.mutable_materials()->rbegin()->set_rgba(rgba);
    }
    printing.set_background_rgba(0x808080ff);
  }

  Sliced sliced() {
    Sliced sliced = server_.slice(request_);
    EXPECT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    return sliced;
  }
  Failure failure() { return server_.slice_failure(request_); }

  /// A row of channel x in layer 3.
  static std::vector<float> row_of(const Sliced& sliced) {
    std::vector<float> row(sliced.header.grid().extent().columns());
    std::memcpy(row.data(), sliced.planes.at(3)[1].data(), sizeof(float) * row.size());
    return row;
  }

  TestServer server_;
  std::string box_;
  v1::SliceRangeRequest request_;
  v1::SliceJob* job_;
};

TEST_F(JobParts, ShareAGridThatHoldsAllOfThem) {
  add("left", 0);
  add("right", 15);
  job_->mutable_contours();
  const Sliced both = sliced();
  EXPECT_EQ(both.header.grid().extent().columns(), 25u);
  EXPECT_THAT(both.header.mesh_ids(), ElementsAre(box_, box_));
  EXPECT_EQ(both.ends.at(3).voxel_count(), 200u);
  EXPECT_EQ(both.ends.at(3).statistics().voxels_covered(), 0u);
  EXPECT_EQ(both.begins.at(3).contour_loops(), 2u);
  const std::vector<float> row = row_of(both);
  EXPECT_NEAR(row[2], 2.5, 1e-3);
  EXPECT_EQ(row[12], 0);
  EXPECT_NEAR(row[17], 2.5, 1e-3);
}

TEST_F(JobParts, GiveVoxelsToTheHighestPriority) {
  add("left", 0);
  add("right", 6).set_priority(2);
  const Sliced right_first = sliced();
  EXPECT_EQ(right_first.ends.at(3).voxel_count(), 160u);
  EXPECT_EQ(right_first.ends.at(3).statistics().voxels_covered(), 40u);
  EXPECT_EQ(right_first.summary.voxels_covered(), 400u);
  EXPECT_NEAR(row_of(right_first)[8], 2.5, 1e-3);
  job_->mutable_parts(1)->set_priority(-1);
  EXPECT_NEAR(row_of(sliced())[8], 8.5, 1e-3);
}

TEST_F(JobParts, MayBeCopies) {
  v1::Part& part = add("", 0);
  place(part, 20);
  place(part, 40);
  const Sliced copies = sliced();
  EXPECT_EQ(copies.header.grid().extent().columns(), 50u);
  EXPECT_EQ(copies.ends.at(3).voxel_count(), 300u);
  EXPECT_NEAR(row_of(copies)[42], 2.5, 1e-3);
}

TEST_F(JobParts, MayBeSnappedToWholeVoxels) {
  v1::Part& part = add("", 0.25);
  place(part, 20);
  place(part, 39.5);
  job_->set_snap(true);
  const Sliced copies = sliced();
  EXPECT_EQ(copies.header.grid().extent().columns(), 49u) << "from 0.25 to 49.25 mm";
  const std::vector<float> row = row_of(copies);
  for (const std::size_t column : {20u, 39u}) EXPECT_EQ(row[column + 3], row[3]) << "the very same value";
  EXPECT_TRUE(copies.ends.at(3).statistics().parts().size() == 1);
  EXPECT_EQ(copies.ends.at(3).statistics().parts(0).voxel_count(), 300u);
  v1::PlanSlicesRequest request;
  *request.mutable_job() = *job_;
  v1::PlanSlicesResponse plan;
  grpc::ClientContext context;
  ASSERT_TRUE(server_.stub().PlanSlices(&context, request, &plan).ok());
  ASSERT_TRUE(plan.has_snapped());
  EXPECT_EQ(plan.snapped().copies(), 2u);
  EXPECT_NEAR(plan.snapped().most_mm().x(), 0.25, 1e-9);
  EXPECT_EQ(plan.snapped().computed(), 1u);
  job_->mutable_grid()->mutable_pitch()->set_x_mm(0);
  EXPECT_EQ(failure().field, "job.grid.pitch.x_mm");
}

TEST_F(JobParts, AreCountedByThemselvesAndWhereTheyOverlap) {
  add_white_and_black();
  job_->mutable_printing()->mutable_map()->set_material("white");
  job_->add_planes()->mutable_materials();
  v1::Part& left = add("left", 0);
  place(left, 30);
  add("right", 6).mutable_map()->set_material("black");
  const Sliced both = sliced();
  const v1::LayerStatistics& statistics = both.ends.at(3).statistics();
  ASSERT_EQ(statistics.parts_size(), 2);
  EXPECT_EQ(statistics.parts(0).voxel_count(), 200u) << "both copies";
  EXPECT_THAT(statistics.parts(0).material_voxels(), ElementsAre(200, 0));
  EXPECT_EQ(statistics.parts(1).voxel_count(), 60u);
  EXPECT_THAT(statistics.parts(1).material_voxels(), ElementsAre(0, 60));
  ASSERT_EQ(statistics.overlaps_size(), 1);
  EXPECT_EQ(statistics.overlaps(0).owner(), 0u);
  EXPECT_EQ(statistics.overlaps(0).covered(), 2u);
  EXPECT_EQ(statistics.overlaps(0).voxel_count(), 40u);
  EXPECT_NEAR(statistics.overlaps(0).place_mm().x(), 6.5, 1e-9);
  EXPECT_NEAR(statistics.overlaps(0).place_mm().z(), 3.5, 1e-9);
}

TEST_F(JobParts, OverlapInSoManyPairsAtMostAsALayerNames) {
  v1::Part& part = add("", 0);
  for (int copy = 0; copy < 300; ++copy) place(part, 0);
  job_->set_snap(true);
  const v1::LayerStatistics statistics = sliced().ends.at(3).statistics();
  EXPECT_EQ(statistics.voxels_covered(), 30000u) << "the first one has all voxels";
  EXPECT_EQ(statistics.overlaps_size(), 256);
}

TEST_F(JobParts, HaveMapsOfTheirOwn) {
  add_white_and_black();
  job_->mutable_printing()->mutable_map()->set_material("white");
  job_->add_planes()->mutable_materials();
  add("left", 0);
  add("right", 15).mutable_map()->set_material("black");
  const Sliced both = sliced();
  EXPECT_THAT(both.ends.at(3).statistics().material_voxels(), ElementsAre(100, 100));
  EXPECT_EQ(both.header.printing().map().material(), "white");
  job_->mutable_parts(1)->mutable_map()->set_material("red");
  EXPECT_EQ(failure().reason, "MATERIAL_UNKNOWN");
  EXPECT_EQ(failure().field, "job.parts[1].map.material");
}

TEST_F(JobParts, AreRefusedWhereTheyOverlapIfThatIsAskedFor) {
  add("left", 0);
  add("right", 15);
  job_->set_overlaps(v1::PART_OVERLAPS_REFUSE);
  sliced();
  job_->mutable_parts(1)->mutable_placements(0)->set_matrix(3, 9);
  const Failure refused = failure();
  EXPECT_EQ(refused.reason, "PARTS_OVERLAP");
  EXPECT_THAT(refused.message, HasSubstr("parts 'left' and 'right' share voxels, in layer 0 at (9.5, 0.5, 0.5) mm"));
  job_->set_overlaps(static_cast<v1::PartOverlaps>(7));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  EXPECT_EQ(failure().field, "job.overlaps");
}

TEST_F(JobParts, HaveNamesOfTheirOwn) {
  add("a", 0);
  add("a", 15);
  EXPECT_EQ(failure().reason, "PART_NAME_INVALID");
  EXPECT_EQ(failure().field, "job.parts[1].name");
  job_->mutable_parts(1)->set_name("");
  EXPECT_EQ(failure().reason, "PART_NAME_INVALID");
  job_->mutable_parts(1)->set_name(std::string(65, 'x'));
  EXPECT_EQ(failure().reason, "PART_NAME_INVALID");
  job_->mutable_parts(1)->set_name(std::string(64, 'x'));
  sliced();
  job_->clear_parts();
  EXPECT_EQ(failure().reason, "PARTS_MISSING");
}

TEST_F(JobParts, NameThePlacementThatIsAtFault) {
  add("a", 0);
  v1::Part& part = add("b", 15);
  for (int i = 0; i < 30; ++i) place(part, 15 + i);
  part.mutable_placements(17)->set_matrix(7, std::numeric_limits<double>::quiet_NaN());
  const Failure refused = failure();
  EXPECT_EQ(refused.reason, "PLACEMENT_NON_FINITE");
  EXPECT_EQ(refused.field, "job.parts[1].placements[17].matrix[7]");
  EXPECT_THAT(refused.message, HasSubstr("(part 'b')"));
}

TEST_F(JobParts, AreNotTooMany) {
  v1::Part& part = add("", 0);
  while (part.placements_size() < 4097) place(part, 0);
  EXPECT_EQ(failure().reason, "TOO_MANY_PARTS");
  EXPECT_EQ(failure().field, "job.parts");
  job_->clear_parts();
  for (int i = 0; i < 257; ++i) add(std::to_string(i), 0);
  EXPECT_EQ(failure().reason, "TOO_MANY_PARTS");
}

TEST_F(JobParts, SayWhichLackAChannel) {
  v1::ControlMesh other = make_box(2, 10);
  other.set_channel_names(0, "y");
  add("a", 0);
  add("b", 15).set_mesh_id(server_.upload_good(other));
  add("c", 30).set_mesh_id(job_->parts(1).mesh_id());
  const Failure refused = failure();
  EXPECT_EQ(refused.reason, "CHANNEL_UNKNOWN");
  EXPECT_EQ(refused.field, "job.planes[1].channel.name");
  EXPECT_THAT(refused.message,
              HasSubstr("the mesh has no channel \"x\"; it has \"y\" (part 'b'); parts that lack it: 'b', 'c'"));
}

TEST_F(JobParts, NameAllMeshesThatAreMissing) {
  add("a", 0);
  add("b", 15).set_mesh_id(mesh_id_of("b"));
  add("c", 30).set_mesh_id(mesh_id_of("c"));
  const Failure missing = failure();
  EXPECT_EQ(missing.reason, "MESH_MISSING");
  EXPECT_EQ(missing.missing, mesh_id_of("b"));
  EXPECT_THAT(missing.message, HasSubstr("2 of the job's meshes, " + mesh_id_of("b") + ", " + mesh_id_of("c")));
  job_->mutable_parts(1)->set_mesh_id("b");
  EXPECT_EQ(failure().reason, "MESH_ID_INVALID");
  EXPECT_EQ(failure().field, "job.parts[1].mesh_id");
}

TEST_F(JobParts, ArePlannedTogether) {
  add("left", 0);
  add("right", 15);
  v1::PlanSlicesRequest request;
  *request.mutable_job() = *job_;
  const auto plan = [&] {
    grpc::ClientContext context;
    v1::PlanSlicesResponse response;
    const grpc::Status status = server_.stub().PlanSlices(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  EXPECT_EQ(plan().grid().extent().columns(), 25u);
  EXPECT_FALSE(plan().has_deviation());
  const auto warns_of_overlaps = [&] {
    const v1::PlanSlicesResponse planned = plan();
    return std::ranges::any_of(planned.warnings(), [](const v1::PlanWarning& warning) {
      return warning.kind() == v1::PLAN_WARNING_KIND_PARTS_OVERLAP && !warning.has_part();
    });
  };
  EXPECT_FALSE(warns_of_overlaps());
  request.mutable_job()->mutable_parts(1)->mutable_placements(0)->set_matrix(3, 5);
  EXPECT_TRUE(warns_of_overlaps());
  // A mirrored part is warned of by its name.
  request.mutable_job()->mutable_parts(1)->mutable_placements(0)->set_matrix(0, -1);
  const v1::PlanSlicesResponse mirrored = plan();
  const auto warning = std::ranges::find(mirrored.warnings(), v1::PLAN_WARNING_KIND_MIRRORED, &v1::PlanWarning::kind);
  ASSERT_NE(warning, mirrored.warnings().end());
  EXPECT_THAT(warning->message(), HasSubstr("part 'right': "));
  EXPECT_EQ(warning->part(), 1u);
}

TEST_F(JobParts, AreWarnedOfOnceForCopiesThatLieAlike) {
  v1::Part& part = add("many", 0);
  for (int copy = 1; copy < 4; ++copy) {
    *part.add_placements() = part.placements(0);
    part.mutable_placements(copy)->set_matrix(3, 15 * copy);
  }
  v1::PlanSlicesRequest request;
  const auto mirrored = [&] {
    *request.mutable_job() = *job_;
    grpc::ClientContext context;
    v1::PlanSlicesResponse response;
    const grpc::Status status = server_.stub().PlanSlices(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::vector<std::string> messages;
    for (const v1::PlanWarning& warning : response.warnings()) {
      if (warning.kind() == v1::PLAN_WARNING_KIND_MIRRORED) messages.push_back(warning.message());
    }
    return messages;
  };
  EXPECT_THAT(mirrored(), testing::IsEmpty());
  for (const int copy : {2, 3}) part.mutable_placements(copy)->set_matrix(0, -1);
  EXPECT_THAT(mirrored(), testing::ElementsAre(HasSubstr("part 'many, copy 3': ")));
}

/// Layer 3 of the job in previews.
class PreviewsOfJobParts : public JobParts {
 protected:
  v1::PreviewRequest asked(std::uint64_t number) const {
    v1::PreviewRequest request;
    request.set_number(number);
    request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
    v1::PreviewLayer& layer = *request.mutable_plane()->mutable_layer();
    *layer.mutable_job() = *job_;
    layer.set_layer(3);
    request.mutable_content()->mutable_occupancy();
    return request;
  }
  /// Pictures of so few pixels are one message each.
  std::vector<v1::PreviewResponse> shown(const std::vector<v1::PreviewRequest>& requests, Failure* refused = nullptr) {
    grpc::ClientContext context;
    const auto call = server_.stub().Preview(&context);
    std::vector<v1::PreviewResponse> pictures;
    for (const v1::PreviewRequest& request : requests) {
      call->Write(request);
      v1::PreviewResponse picture;
      if (call->Read(&picture)) pictures.push_back(picture);
    }
    call->WritesDone();
    const grpc::Status status = call->Finish();
    if (refused != nullptr) {
      *refused = failure_of(status);
    } else {
      EXPECT_TRUE(status.ok()) << status.error_message();
      EXPECT_EQ(pictures.size(), requests.size());
    }
    return pictures;
  }
  static std::string pixel(const v1::PreviewResponse& picture, std::size_t column) {
    return picture.picture().substr(4 * column, 4);
  }
};

TEST_F(PreviewsOfJobParts, ShowTheSamplesOfSlices) {
  add("left", 0);
  add("right", 6).set_priority(2);
  v1::PreviewRequest channel = asked(2);
  v1::ChannelColours& colours = *channel.mutable_content()->mutable_channel();
  colours.set_channel("x");
  colours.set_colours(v1::COLOUR_MAP_NAME_GREY);
  colours.mutable_range()->set_min(0);
  colours.mutable_range()->set_max(10);
  const std::vector<v1::PreviewResponse> pictures = shown({asked(1), channel});
  const Sliced sliced = this->sliced();
  EXPECT_EQ(pictures.at(0).header().width(), 16u);
  EXPECT_EQ(pictures.at(0).header().pixels_inside(), sliced.ends.at(3).voxel_count());
  const std::vector<float> row = row_of(sliced);
  for (std::size_t column = 0; column < row.size(); ++column) {
    const auto grey = static_cast<unsigned char>(pixel(pictures.at(1), column).front());
    EXPECT_NEAR(grey, 25.5F * row[column], 1.1F) << column;
  }
}

TEST_F(PreviewsOfJobParts, ShowMapsOfTheirOwn) {
  add_white_and_black();
  job_->mutable_printing()->mutable_map()->set_strict(true);
  job_->mutable_printing()->mutable_map()->mutable_blend()->set_channel("x");
  for (const auto& [value, name] : {std::pair{2.0, "white"}, std::pair{8.0, "black"}}) {
    v1::BlendStop& stop = *job_->mutable_printing()->mutable_map()->mutable_blend()->add_stops();
    stop.set_value(value);
    stop.set_material(name);
  }
  add("left", 0);
  v1::Part& right = add("right", 6);
  right.mutable_map()->set_material("black");
  right.set_priority(1);
  place(right, 30);
  v1::PreviewRequest halftone = asked(1), mix = asked(2);
  mix.mutable_content()->mutable_mix();
  halftone.mutable_content()->mutable_halftone();
  halftone.mutable_plane()->mutable_layer()->mutable_job()->mutable_printing()->mutable_map()->set_strict(false);
  v1::VoxelBox& voxels = *mix.mutable_plane()->mutable_layer()->mutable_job()->mutable_region()->mutable_voxels();
  voxels.set_first_column(1);
  voxels.set_first_row(2);
  voxels.mutable_extent()->set_columns(38);
  voxels.mutable_extent()->set_rows(5);
  voxels.mutable_extent()->set_layers(1);
  const std::vector<v1::PreviewResponse> pictures = shown({halftone, mix});
  const std::string black("\0\0\0\xff", 4), white(4, '\xff'), nothing(4, '\0');
  EXPECT_EQ(pictures.at(0).header().material_pixels(0) + pictures.at(0).header().material_pixels(1), 260u);
  EXPECT_GE(pictures.at(0).header().material_pixels(1), 200u);
  EXPECT_EQ(pixel(pictures.at(0), 6), black) << "the higher priority's";
  EXPECT_EQ(pictures.at(1).header().pixels_inside(), 5u * (5 + 10 + 9));
  EXPECT_EQ(pixel(pictures.at(1), 0), white) << "at 1.5 mm";
  EXPECT_NE(pixel(pictures.at(1), 3), white);
  EXPECT_NE(pixel(pictures.at(1), 3), black);
  EXPECT_EQ(pixel(pictures.at(1), 5), black);
  EXPECT_EQ(pixel(pictures.at(1), 20), nothing);
  EXPECT_EQ(pixel(pictures.at(1), 30), black) << "the copy's";
}

TEST_F(PreviewsOfJobParts, AreOfTheMeshesThatTheirFirstRequestNames) {
  add("box", 0);
  add("other", 15).set_mesh_id(server_.upload_good(make_box(1, 5)));
  v1::PreviewRequest plane;
  plane.set_number(2);
  plane.mutable_plane()->mutable_free()->mutable_across()->set_x(1);
  plane.mutable_plane()->mutable_free()->mutable_up()->set_y(1);
  plane.mutable_plane()->mutable_free()->mutable_middle_mm()->set_z(1);
  plane.mutable_plane()->mutable_free()->set_across_mm_per_pixel(1);
  plane.set_width(20);
  plane.set_height(20);
  plane.mutable_content()->mutable_occupancy();
  v1::PreviewRequest one = asked(3);
  one.mutable_plane()->mutable_layer()->mutable_job()->mutable_parts()->DeleteSubrange(0, 1);
  const std::vector<v1::PreviewResponse> pictures = shown({asked(1), plane, one});
  EXPECT_EQ(pictures.at(0).header().pixels_inside(), 100u + 25u);
  EXPECT_EQ(pictures.at(1).header().pixels_inside(), 100u) << "a quarter of the plane, of the first part's mesh";
  EXPECT_EQ(pictures.at(2).header().pixels_inside(), 25u);
  Failure refused;
  one.set_number(1);
  EXPECT_EQ(shown({one, asked(2)}, &refused).size(), 1u);
  EXPECT_EQ(refused.reason, "REQUEST_MALFORMED");
  EXPECT_EQ(refused.field, "plane.layer.job.parts[0].mesh_id");
}

TEST_F(PreviewsOfJobParts, AreRefusedWithThePartAtFault) {
  add("a", 0);
  add("b", 5).set_mesh_id(server_.upload_good(with_channels(make_box(1, 10), 1)));
  Failure refused;
  v1::PreviewRequest channel = asked(1);
  channel.mutable_content()->mutable_channel()->set_channel("x");
  shown({channel}, &refused);
  EXPECT_EQ(refused.reason, "CHANNEL_UNKNOWN");
  EXPECT_EQ(refused.field, "content.channel.channel");
  EXPECT_THAT(refused.message, HasSubstr("parts that lack it: 'b'"));
  v1::PreviewRequest overlapping = asked(1);
  overlapping.mutable_plane()->mutable_layer()->mutable_job()->set_overlaps(v1::PART_OVERLAPS_REFUSE);
  shown({overlapping}, &refused);
  EXPECT_EQ(refused.reason, "PARTS_OVERLAP");
  EXPECT_EQ(refused.field, "plane.layer.job.overlaps");
}

}  // namespace
}  // namespace ccslice::server
