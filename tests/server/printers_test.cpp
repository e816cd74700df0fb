// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

/// A block of 10 mm.
class Printers : public ::testing::Test {
 protected:
  Printers() { request_.mutable_job()->mutable_printer()->set_name("j750-hq"); }

  grpc::Status plan(const v1::PlanSlicesRequest& request, v1::PlanSlicesResponse& response) {
    grpc::ClientContext context;
    return server_.stub().PlanSlices(&context, request, &response);
  }

  std::vector<v1::PlanWarningKind> warnings() {
    v1::PlanSlicesResponse response;
    const grpc::Status status = plan(request_, response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::vector<v1::PlanWarningKind> kinds;
    for (const v1::PlanWarning& warning : response.warnings()) kinds.push_back(warning.kind());
    return kinds;
  }

  void expect(const std::string& reason, const std::string& field) {
    v1::PlanSlicesResponse response;
    const Failure failure = failure_of(plan(request_, response));
    EXPECT_EQ(failure.reason, reason) << failure.message;
    EXPECT_EQ(failure.field, field) << failure.message;
  }

  void set_pitch(double x, double y, double z) {
    v1::VoxelPitch& pitch = *request_.mutable_job()->mutable_grid()->mutable_pitch();
    pitch.set_x_mm(x);
    pitch.set_y_mm(y);
    pitch.set_z_mm(z);
  }

  TestServer server_;
  const std::string id_ = server_.upload_good(make_box(2, 10));
  v1::PlanSlicesRequest request_ = [this] {
    v1::PlanSlicesRequest request;
    part_of(*request.mutable_job()).set_mesh_id(id_);
    return request;
  }();
};

TEST_F(Printers, GiveThePitch) {
  v1::PlanSlicesResponse response;
  ASSERT_TRUE(plan(request_, response).ok());
  EXPECT_DOUBLE_EQ(response.grid().pitch().x_mm(), 25.4 / 600);
  EXPECT_DOUBLE_EQ(response.grid().pitch().y_mm(), 25.4 / 300);
  EXPECT_DOUBLE_EQ(response.grid().pitch().z_mm(), 0.014);
  EXPECT_THAT(warnings(), testing::IsEmpty());
  set_pitch(0.0423, 0.0846, 0.014);
  EXPECT_THAT(warnings(), testing::IsEmpty());
}

TEST_F(Printers, AreListed) {
  grpc::ClientContext context;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(server_.stub().GetServerInfo(&context, {}, &info).ok());
  std::vector<std::string> names;
  for (const v1::PrinterProfile& profile : info.printer_profiles()) names.push_back(profile.name());
  EXPECT_THAT(names, testing::IsSupersetOf({"j55", "j750-hm", "j750-hq", "j750-hs", "j850-hq", "paper"}));
}

TEST_F(Printers, WarnOfMixedUpAxesAndOtherPitches) {
  set_pitch(25.4 / 300, 25.4 / 600, 0.014);
  EXPECT_THAT(warnings(), testing::ElementsAre(v1::PLAN_WARNING_KIND_AXES_MIXED_UP));
  set_pitch(25.4 / 600, 25.4 / 300, 0.027);
  EXPECT_THAT(warnings(), testing::ElementsAre(v1::PLAN_WARNING_KIND_PRINTER_PITCH));
}

TEST_F(Printers, WarnOfPartsThatDoNotFit) {
  for (const double entry : {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0}) {
    placement_of(*request_.mutable_job()).add_matrix(entry);
  }
  EXPECT_THAT(warnings(), testing::ElementsAre(v1::PLAN_WARNING_KIND_TOO_FEW_LAYERS));
  placement_of(*request_.mutable_job()).set_matrix(0, 50);
  EXPECT_THAT(warnings(),
              testing::ElementsAre(v1::PLAN_WARNING_KIND_TOO_FEW_LAYERS, v1::PLAN_WARNING_KIND_LARGER_THAN_TRAY));
}

TEST_F(Printers, WarnOfTooManyMaterials) {
  request_.mutable_job()->mutable_printer()->set_name("j750-hs");
  v1::BlendMap& blend = *request_.mutable_job()->mutable_printing()->mutable_map()->mutable_blend();
  blend.set_channel("x");
  for (std::uint32_t i = 0; i < 4; ++i) {
    v1::PrintMaterial& material = *request_.mutable_job()->mutable_printing()->add_materials();
    material.set_name(std::to_string(i));
    material.set_rgba(0x1000 * (i + 1) + 0xff);
    v1::BlendStop& stop = *blend.add_stops();
    stop.set_value(5 * i);  // x runs from 0 to 10.
    stop.set_material(std::to_string(i));
  }
  EXPECT_THAT(warnings(), testing::ElementsAre(v1::PLAN_WARNING_KIND_TOO_MANY_MATERIALS));
}

TEST_F(Printers, MayBeTheClientsOwn) {
  v1::PrinterProfile& printer = *request_.mutable_job()->mutable_printer();
  printer.clear_name();
  expect("PRINTER_INVALID", "job.printer.pitch");
  printer.mutable_pitch()->set_x_mm(0.1);
  printer.mutable_pitch()->set_y_mm(0.1);
  printer.mutable_pitch()->set_z_mm(0.1);
  EXPECT_THAT(warnings(), testing::IsEmpty());
  printer.set_name("ours");
  printer.set_min_layers(200);
  printer.mutable_tray_mm()->set_y(9);
  EXPECT_THAT(warnings(),
              testing::ElementsAre(v1::PLAN_WARNING_KIND_TOO_FEW_LAYERS, v1::PLAN_WARNING_KIND_LARGER_THAN_TRAY));
  printer.set_smallest_feature_mm(12);
  EXPECT_THAT(warnings(), testing::Contains(v1::PLAN_WARNING_KIND_THIN_FEATURE));
  v1::PlanSlicesResponse response;
  ASSERT_TRUE(plan(request_, response).ok());
  EXPECT_THAT(response.DebugString(), testing::HasSubstr("the tray of ours is"));
  printer.set_smallest_feature_mm(-1);
  expect("PRINTER_INVALID", "job.printer.smallest_feature_mm");
  printer.clear_smallest_feature_mm();
  printer.mutable_tray_mm()->set_x(std::numeric_limits<double>::quiet_NaN());
  expect("PRINTER_INVALID", "job.printer.tray_mm");
}

TEST_F(Printers, AreRefusedByReason) {
  request_.mutable_job()->mutable_printer()->set_min_layers(3);
  expect("PRINTER_INVALID", "job.printer");
  request_.mutable_job()->mutable_printer()->set_name("inkjet");
  expect("PRINTER_UNKNOWN", "job.printer.name");
}

}  // namespace
}  // namespace ccslice::server
