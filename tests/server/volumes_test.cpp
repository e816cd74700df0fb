// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// Volumes as clients see them: uploaded, and read by fields of jobs, plans, previews and probes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/server/test_volumes.h"

namespace ccslice::server {
namespace {

using testing::HasSubstr;

/// A box of 10 mm in voxels of 1 mm, and a volume of 10 samples along each axis whose value is i + 20 j + 0.5 k.
class Volumes : public testing::Test {
 protected:
  Volumes() {
    box_ = server_.upload_good(make_box(2, 10));
    request_ = slice_request(box_, 1, 0, 10);
    job_ = request_.mutable_job();
    std::vector<float> samples;
    for (int k = 0; k < 10; ++k) {
      for (int j = 0; j < 10; ++j) {
        for (int i = 0; i < 10; ++i) samples.push_back(static_cast<float>(i + 20 * j + 0.5 * k));
      }
    }
    ramp_ = put(volume_message(std::array{10u, 10u, 10u}, v1::VOLUME_SAMPLE_TYPE_FLOAT32, samples));
  }

  std::string put(const v1::Volume& volume) { return put(volume.SerializeAsString()); }
  std::string put(const std::string& bytes) {
    const std::string id = mesh_id_of(bytes);
    const grpc::Status status = server_.upload(id, bytes.size(), bytes, &uploaded_);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return id;
  }

  v1::VolumeSamples& add(const std::string& name, const std::string& id) {
    v1::Field& field = *job_->add_fields();
    field.set_name(name);
    field.mutable_volume()->set_volume_id(id);
    return *field.mutable_volume();
  }

  void show(const std::string& name) {
    v1::PlaneSpec& plane = *job_->add_planes();
    plane.mutable_channel()->set_name(name);
    plane.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
    plane.set_encoding(v1::PLANE_ENCODING_RAW);
  }

  /// Looks at the last plane.
  void expect_values(const std::function<double(double, double, double)>& expected) {
    const Sliced sliced = server_.slice(request_);
    ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    for (std::uint32_t layer = 0; layer < 10; ++layer) {
      std::vector<float> values(100);
      std::memcpy(values.data(), sliced.planes.at(layer).back().data(), 400);
      for (std::uint32_t v = 0; v < 100; ++v) {
        ASSERT_NEAR(values[v], expected(v % 10, v / 10, layer), 1e-4) << v << " " << layer;
      }
    }
  }

  TestServer server_;
  std::string box_, ramp_;
  v1::UploadMeshResponse uploaded_;
  v1::SliceRangeRequest request_;
  v1::SliceJob* job_;
};

double ramp_at(double i, double j, double k) { return i + 20 * j + 0.5 * k; }

TEST_F(Volumes, AreSummarized) {
  const v1::VolumeSummary& volume = uploaded_.mesh().volume();
  EXPECT_EQ(uploaded_.mesh().mesh_id(), ramp_);
  EXPECT_EQ(volume.samples_i(), 10u);
  EXPECT_EQ(volume.sample_type(), v1::VOLUME_SAMPLE_TYPE_FLOAT32);
  ASSERT_EQ(volume.channels_size(), 1);
  EXPECT_EQ(volume.channels(0).max_sample(), 9 + 180 + 4.5);
  EXPECT_GE(uploaded_.mesh().memory_bytes(), 4000u);
  EXPECT_LE(uploaded_.mesh().memory_bytes(), 4400u);
  EXPECT_EQ(uploaded_.mesh().control_cells(), 0u);
  grpc::ClientContext list, get, remove;
  v1::ListMeshesResponse listed;
  EXPECT_TRUE(server_.stub().ListMeshes(&list, {}, &listed).ok());
  EXPECT_EQ(listed.meshes_size(), 2);
  v1::GetMeshRequest asked;
  asked.set_mesh_id(ramp_);
  v1::GetMeshResponse got;
  EXPECT_TRUE(server_.stub().GetMesh(&get, asked, &got).ok());
  EXPECT_EQ(got.mesh().volume().SerializeAsString(), volume.SerializeAsString());
  v1::DeleteMeshRequest deleted;
  deleted.set_mesh_id(ramp_);
  v1::DeleteMeshResponse answer;
  EXPECT_TRUE(server_.stub().DeleteMesh(&remove, deleted, &answer).ok());
  EXPECT_TRUE(answer.deleted());
}

TEST_F(Volumes, FillThePartByDefault) {
  add("v", ramp_);
  show("v");
  expect_values(ramp_at);
}

/// Rounding never takes a part out of the box that is filled for it.
TEST_F(Volumes, ThatFillThePartHaveNothingOutside) {
  const std::string id =
      put(volume_message(std::array{7u, 7u, 7u}, v1::VOLUME_SAMPLE_TYPE_UINT8, std::vector<std::uint8_t>(343, 150)));
  std::mt19937 random(1);
  for (int turn = 0; turn < 50; ++turn) {
    v1::ControlMesh mesh = make_box(2, 10);
    const double scale = std::uniform_real_distribution<double>(0.1, 3)(random);
    for (int p = 0; p < mesh.positions_mm_size(); ++p) {
      mesh.set_positions_mm(p, scale * mesh.positions_mm(p) + 37.7 * turn * (1 + p % 3));
    }
    v1::SliceRangeRequest request = slice_request(server_.upload_good(mesh), scale, 0, 1);
    v1::Field& field = *request.mutable_job()->add_fields();
    field.set_name("v");
    field.mutable_volume()->set_volume_id(id);
    field.mutable_volume()->set_outside_value(-7);
    request.mutable_job()->clear_planes();
    request.mutable_job()->add_planes()->mutable_channel()->set_name("v");
    const Sliced sliced = server_.slice(request);
    ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    EXPECT_EQ(sliced.header.planes(0).value_range().min(), 150) << turn;
  }
}

TEST_F(Volumes, OfTooManyFieldsAreNotLookedFor) {
  for (int i = 0; i < 1000; ++i) add("v" + std::to_string(i), mesh_id_of(std::to_string(i)));
  const Failure failure = server_.slice_failure(request_);
  EXPECT_EQ(failure.reason, "FIELD_INVALID");
  EXPECT_EQ(failure.field, "job.fields");
}

TEST_F(Volumes, LieWhereTheJobSays) {
  v1::VolumeSamples& samples = add("v", ramp_);
  // Half a millimetre along x, and j and k swapped: voxel (c, r, l) is at i = 2 c, j = l, k = r.
  for (const double number : {0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.5, 0.0, 1.0, 0.0, 0.5})
    samples.add_index_to_mm(number);
  samples.set_outside_value(-7);
  show("v");
  expect_values([](double c, double r, double l) { return 2 * c > 9.5 ? -7 : ramp_at(2 * c, l, r); });
}

TEST_F(Volumes, AreReadByFormulasAndMaps) {
  add("v", ramp_).set_slope(0.5);
  job_->mutable_fields(0)->mutable_volume()->set_intercept(3);
  v1::Field& field = *job_->add_fields();
  field.set_name("w");
  field.set_formula("v + x");
  show("w");
  expect_values([](double c, double r, double l) { return 0.5 * ramp_at(c, r, l) + 3 + c + 0.5; });
}

TEST_F(Volumes, StandStillInTheWorldAndMoveWithTheirPart) {
  v1::Placement& placement = *job_->mutable_parts(0)->add_placements();
  for (const double entry : {1.0, 0.0, 0.0, 100.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}) placement.add_matrix(entry);
  v1::VolumeSamples& samples = add("v", ramp_);
  for (const double number : {1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.5})
    samples.add_index_to_mm(number);
  samples.set_outside_value(-7);
  show("v");
  expect_values(ramp_at);
  job_->mutable_fields(0)->set_frame(v1::FIELD_FRAME_WORLD);
  expect_values([](double, double, double) { return -7; });
  job_->mutable_fields(0)->mutable_volume()->clear_index_to_mm();
  expect_values(ramp_at);
}

TEST_F(Volumes, CanBeLabels) {
  std::vector<std::uint8_t> labels(8);
  for (std::size_t s = 0; s < 8; ++s) labels[s] = static_cast<std::uint8_t>(10 * s);
  const std::string id = put(volume_message(std::array{2u, 2u, 2u}, v1::VOLUME_SAMPLE_TYPE_UINT8, labels));
  add("v", id).set_interpolation(v1::VOLUME_INTERPOLATION_NEAREST);
  show("v");
  expect_values(
      [](double c, double r, double l) { return 10 * ((c >= 5 ? 1 : 0) + (r >= 5 ? 2 : 0) + (l >= 5 ? 4 : 0)); });
}

TEST_F(Volumes, AreProbedAndPreviewed) {
  v1::ProbePointsRequest request;
  request.set_mesh_id(box_);
  for (const double at : {5.0, 5.0, 5.0}) request.add_points_mm(at);
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  v1::ProbePointsResponse answer;
  ASSERT_TRUE(stream->Write(request) && stream->Read(&answer));
  EXPECT_EQ(answer.channel_values_size(), 1);
  // A later message brings a volume.
  request.clear_mesh_id();
  v1::Field& field = *request.add_fields();
  field.set_name("v");
  field.mutable_volume()->set_volume_id(ramp_);
  ASSERT_TRUE(stream->Write(request) && stream->Read(&answer));
  ASSERT_EQ(answer.channel_values_size(), 2);
  EXPECT_NEAR(answer.channel_values(1), ramp_at(4.5, 4.5, 4.5), 1e-4);
  request.mutable_fields(0)->mutable_volume()->set_volume_id(mesh_id_of("nothing"));
  EXPECT_TRUE(stream->Write(request));
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_EQ(failure_of(stream->Finish()).reason, "MESH_MISSING");

  grpc::ClientContext preview_context;
  const auto pictures = server_.stub().Preview(&preview_context);
  v1::PreviewRequest asked;
  asked.set_number(1);
  asked.set_mesh_id(box_);
  v1::FreePlane& plane = *asked.mutable_plane()->mutable_free();
  for (v1::Vector3* vector : {plane.mutable_middle_mm(), plane.mutable_across(), plane.mutable_up()}) vector->set_x(0);
  plane.mutable_middle_mm()->set_x(5);
  plane.mutable_middle_mm()->set_y(5);
  plane.mutable_middle_mm()->set_z(5);
  plane.mutable_across()->set_x(1);
  plane.mutable_up()->set_y(1);
  plane.set_across_mm_per_pixel(1);
  asked.set_width(8);
  asked.set_height(8);
  asked.mutable_content()->mutable_occupancy();
  v1::PreviewResponse picture;
  ASSERT_TRUE(pictures->Write(asked) && pictures->Read(&picture));
  asked.set_number(2);
  asked.clear_mesh_id();
  asked.mutable_content()->mutable_channel()->set_channel("v");
  *asked.add_fields() = field;
  asked.mutable_fields(0)->mutable_volume()->set_volume_id(ramp_);
  const bool is_answered = pictures->Write(asked) && pictures->Read(&picture);
  ASSERT_TRUE(is_answered) << failure_of(pictures->Finish()).message;
  EXPECT_NEAR(picture.header().range().max(), ramp_at(8, 8, 4.5), 0.6);
  // The volume that no request names any more can be dropped, and the mesh, which the call holds, isn't looked for.
  for (const std::string& id : {box_, ramp_}) {
    grpc::ClientContext remove;
    v1::DeleteMeshRequest deleted;
    deleted.set_mesh_id(id);
    v1::DeleteMeshResponse gone;
    EXPECT_TRUE(server_.stub().DeleteMesh(&remove, deleted, &gone).ok());
  }
  const std::string other =
      put(volume_message(std::array{1u, 1u, 1u}, v1::VOLUME_SAMPLE_TYPE_UINT8, std::vector<std::uint8_t>{3}));
  asked.set_number(3);
  asked.mutable_fields(0)->mutable_volume()->set_volume_id(other);
  const bool is_again = pictures->Write(asked) && pictures->Read(&picture);
  ASSERT_TRUE(is_again) << failure_of(pictures->Finish()).message;
  EXPECT_EQ(picture.header().range().max(), 3);
  pictures->WritesDone();
}

TEST_F(Volumes, GiveTheSameBytesForAnyRange) {
  add("v", ramp_);
  show("v");
  const Sliced whole = server_.slice(request_);
  for (std::uint32_t layer = 0; layer < 10; ++layer) {
    v1::SliceRangeRequest one = request_;
    one.set_first_layer(layer);
    one.set_layer_count(1);
    EXPECT_EQ(server_.slice(one).planes.at(layer), whole.planes.at(layer));
  }
}

TEST_F(Volumes, BesideThePartAreWarnedOf) {
  v1::PlanSlicesRequest request;
  v1::VolumeSamples& samples = add("v", ramp_);
  for (const double number : {1.0, 0.0, 0.0, 5.5, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.5})
    samples.add_index_to_mm(number);
  *request.mutable_job() = *job_;
  const auto warning_of = [&] {
    grpc::ClientContext context;
    v1::PlanSlicesResponse plan;
    EXPECT_TRUE(server_.stub().PlanSlices(&context, request, &plan).ok());
    for (const v1::PlanWarning& warning : plan.warnings()) {
      if (warning.kind() == v1::PLAN_WARNING_KIND_OUTSIDE_VOLUME) return warning.message();
    }
    return std::string();
  };
  EXPECT_THAT(warning_of(), HasSubstr("field 'v' has no samples in about 50 % of the part"));
  request.mutable_job()->mutable_fields(0)->mutable_volume()->clear_index_to_mm();
  EXPECT_EQ(warning_of(), "");
}

TEST_F(Volumes, AreRefusedWithTheFieldAndTheRemedy) {
  const auto refuses = [&](const std::function<void(v1::VolumeSamples&)>& change, const std::string& reason,
                           const std::string& field, const std::string& part) {
    job_->clear_fields();
    change(add("v", ramp_));
    const Failure failure = server_.slice_failure(request_);
    EXPECT_EQ(failure.reason, reason) << failure.message;
    EXPECT_EQ(failure.field, field) << failure.message;
    EXPECT_THAT(failure.message, HasSubstr(part));
  };
  using Samples = v1::VolumeSamples;
  const std::string at = "job.fields[0].volume.";
  const double infinity = std::numeric_limits<double>::infinity();
  refuses([](Samples& samples) { samples.set_volume_id("scan"); }, "MESH_ID_INVALID", at + "volume_id", "");
  refuses([](Samples& samples) { samples.clear_volume_id(); }, "MESH_ID_INVALID", at + "volume_id", "empty");
  refuses([&](Samples& samples) { samples.set_volume_id(box_); }, "MESH_ID_INVALID", at + "volume_id", "is a mesh's");
  refuses([](Samples& samples) { samples.set_channel(1); }, "FIELD_INVALID", at + "channel", "last channel is 0");
  refuses([](Samples& samples) { samples.set_interpolation(static_cast<v1::VolumeInterpolation>(9)); },
          "ENUM_VALUE_UNKNOWN", at + "interpolation", "LINEAR or NEAREST");
  refuses([](Samples& samples) { samples.add_index_to_mm(1); }, "FIELD_INVALID", at + "index_to_mm", "1 numbers");
  refuses(
      [](Samples& samples) {
        for (int i = 0; i < 12; ++i) samples.add_index_to_mm(i % 5 == 0 && i < 10 ? 1 : 0);
      },
      "FIELD_INVALID", at + "index_to_mm", "plane or a line");
  refuses(
      [](Samples& samples) {
        for (int i = 0; i < 12; ++i) samples.add_index_to_mm(1e-200);
      },
      "FIELD_INVALID", at + "index_to_mm", "plane or a line");
  refuses(
      [](Samples& samples) {
        for (int i = 0; i < 12; ++i) samples.add_index_to_mm(std::nan(""));
      },
      "FIELD_INVALID", at + "index_to_mm", "isn't finite");
  refuses([](Samples& samples) { samples.set_slope(1e38); }, "FIELD_INVALID", at + "slope", "too large");
  refuses([&](Samples& samples) { samples.set_slope(infinity); }, "FIELD_INVALID", at + "slope", "isn't finite");
  refuses([&](Samples& samples) { samples.set_outside_value(infinity); }, "FIELD_INVALID", at + "outside_value", "");
  refuses([](Samples& samples) { samples.set_volume_id(mesh_id_of("nothing")); }, "MESH_MISSING", "", "upload");
  job_->clear_fields();
  job_->mutable_parts(0)->set_mesh_id(ramp_);
  const Failure not_a_mesh = server_.slice_failure(request_);
  EXPECT_EQ(not_a_mesh.reason, "MESH_ID_INVALID");
  EXPECT_EQ(not_a_mesh.field, "job.parts[0].mesh_id");
  EXPECT_THAT(not_a_mesh.message, HasSubstr("is the id of a volume"));
}

TEST_F(Volumes, ThatAreNoneAreRefusedAndNotKept) {
  v1::Volume volume =
      volume_message(std::array{2u, 1u, 1u}, v1::VOLUME_SAMPLE_TYPE_UINT8, std::vector<std::uint8_t>{1});
  const std::string bytes = volume.SerializeAsString();
  const std::string id = mesh_id_of(bytes);
  const Failure failure = failure_of(server_.upload(id, bytes.size(), bytes));
  EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(failure.reason, "VOLUME_INVALID");
  EXPECT_EQ(failure.field, "samples_zstd");
  volume.set_samples_i(1u << 30);
  volume.set_samples_j(1u << 10);
  const std::string promises = volume.SerializeAsString();
  EXPECT_EQ(failure_of(server_.upload(mesh_id_of(promises), promises.size(), promises)).reason, "MESH_EXCEEDS_MEMORY");
}

TEST_F(Volumes, HaveACallOfMeshesRefusedForThem) {
  grpc::ClientContext context;
  v1::TessellateBoundaryRequest request;
  request.set_mesh_id(ramp_);
  const auto stream = server_.stub().TessellateBoundary(&context, request);
  v1::TessellateBoundaryResponse answer;
  while (stream->Read(&answer)) {
  }
  EXPECT_EQ(failure_of(stream->Finish()).reason, "MESH_ID_INVALID");
  grpc::ClientContext probe_context;
  const auto probe = server_.stub().ProbePoints(&probe_context);
  v1::ProbePointsRequest points;
  points.set_mesh_id(ramp_);
  EXPECT_TRUE(probe->Write(points));
  v1::ProbePointsResponse none;
  EXPECT_FALSE(probe->Read(&none));
  EXPECT_EQ(failure_of(probe->Finish()).reason, "MESH_ID_INVALID");
  grpc::ClientContext evaluate_context;
  const auto evaluate = server_.stub().EvaluatePoints(&evaluate_context);
  v1::EvaluatePointsRequest places;
  places.set_mesh_id(ramp_);
  EXPECT_TRUE(evaluate->Write(places));
  v1::EvaluatePointsResponse nothing;
  EXPECT_FALSE(evaluate->Read(&nothing));
  EXPECT_EQ(failure_of(evaluate->Finish()).reason, "MESH_ID_INVALID");
  grpc::ClientContext preview_context;
  const auto preview = server_.stub().Preview(&preview_context);
  v1::PreviewRequest asked;
  asked.set_number(1);
  asked.set_mesh_id(ramp_);
  asked.mutable_plane()->mutable_free();
  EXPECT_TRUE(preview->Write(asked));
  v1::PreviewResponse picture;
  EXPECT_FALSE(preview->Read(&picture));
  EXPECT_EQ(failure_of(preview->Finish()).reason, "MESH_ID_INVALID");
}

}  // namespace
}  // namespace ccslice::server
