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

TEST_F(JobParts, HaveMapsOfTheirOwn) {
  v1::Printing& printing = *job_->mutable_printing();
  for (const auto& [name, rgba] : {std::pair{"white", 0xffffffffu}, std::pair{"black", 0x000000ffu}}) {
    printing.add_materials()->set_name(name);
    printing.mutable_materials()->rbegin()->set_rgba(rgba);
  }
  printing.set_background_rgba(0x808080ff);
  printing.mutable_map()->set_material("white");
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

TEST_F(JobParts, SayWhichHaveTheChannelThatOneLacks) {
  v1::ControlMesh other = make_box(2, 10);
  other.set_channel_names(0, "y");
  add("a", 0);
  add("b", 15).set_mesh_id(server_.upload_good(other));
  const Failure refused = failure();
  EXPECT_EQ(refused.reason, "CHANNEL_UNKNOWN");
  EXPECT_EQ(refused.field, "job.planes[1].channel.name");
  EXPECT_THAT(refused.message, HasSubstr("(part 'b'); the parts that have it: 'a'"));
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

TEST_F(JobParts, AreOneForPreviewsOfLayers) {
  add("a", 0);
  add("b", 15);
  grpc::ClientContext context;
  const auto call = server_.stub().Preview(&context);
  v1::PreviewRequest request;
  request.set_number(1);
  *request.mutable_plane()->mutable_layer()->mutable_job() = *job_;
  request.mutable_plane()->mutable_layer()->mutable_job()->clear_planes();
  request.mutable_content()->mutable_occupancy();
  call->Write(request);
  call->WritesDone();
  v1::PreviewResponse response;
  EXPECT_FALSE(call->Read(&response));
  const Failure refused = failure_of(call->Finish());
  EXPECT_EQ(refused.reason, "TOO_MANY_PARTS");
  EXPECT_EQ(refused.field, "plane.layer.job.parts");
}

}  // namespace
}  // namespace ccslice::server
