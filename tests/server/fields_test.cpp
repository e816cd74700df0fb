// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields of jobs, previews and probes, as clients see them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using testing::HasSubstr;

constexpr std::uint32_t kColumns = 10, kRows = 10;

/// Boxes of 10 mm in voxels of 1 mm, whose channel "x" is x.
class Fields : public testing::Test {
 protected:
  Fields() {
    box_ = server_.upload_good(make_box(2, 10));
    request_ = slice_request(box_, 1, 0, 10);
    job_ = request_.mutable_job();
  }

  v1::Field& add(const std::string& name, const std::string& formula) {
    v1::Field& field = *job_->add_fields();
    field.set_name(name);
    field.set_formula(formula);
    return field;
  }

  v1::PlaneSpec& show(const std::string& name, v1::SampleType type = v1::SAMPLE_TYPE_FLOAT32) {
    v1::PlaneSpec& plane = *job_->add_planes();
    plane.mutable_channel()->set_name(name);
    plane.set_sample_type(type);
    plane.set_encoding(v1::PLANE_ENCODING_RAW);
    return plane;
  }

  void move_part(double x_mm, double y_mm, double z_mm) {
    v1::Placement& placement = *job_->mutable_parts(0)->add_placements();
    for (const double entry : {1.0, 0.0, 0.0, x_mm, 0.0, 1.0, 0.0, y_mm, 0.0, 0.0, 1.0, z_mm}) {
      placement.add_matrix(entry);
    }
  }

  static double depth_in_box(double x, double y, double z) { return std::min({x, y, z, 10 - x, 10 - y, 10 - z}); }

  Sliced sliced() {
    Sliced sliced = server_.slice(request_);
    EXPECT_TRUE(sliced.status.ok()) << sliced.status.error_message();
    return sliced;
  }
  Failure failure() { return server_.slice_failure(request_); }

  static std::vector<float> floats_of(const Sliced& sliced, std::uint32_t layer, std::size_t plane) {
    std::vector<float> values(kColumns * kRows);
    std::memcpy(values.data(), sliced.planes.at(layer)[plane].data(), sizeof(float) * values.size());
    return values;
  }

  /// expected(x, y, z) of the voxels' centres, in the grid of a box that isn't moved.
  static void expect_values(const Sliced& sliced, std::size_t plane,
                            const std::function<double(double, double, double)>& expected, double error) {
    for (std::uint32_t layer = 0; layer < 10; ++layer) {
      const std::vector<float> values = floats_of(sliced, layer, plane);
      for (std::uint32_t row = 0; row < kRows; ++row) {
        for (std::uint32_t column = 0; column < kColumns; ++column) {
          ASSERT_NEAR(values[row * kColumns + column], expected(column + 0.5, row + 0.5, layer + 0.5), error)
              << column << " " << row << " " << layer;
        }
      }
    }
  }

  TestServer server_;
  std::string box_;
  v1::SliceRangeRequest request_;
  v1::SliceJob* job_;
};

TEST_F(Fields, AreFormulasOfPlacesChannelsAndFieldsBeforeThem) {
  add("height", "z/10");
  add("sum", "\"x\" + 100*height");
  show("height");
  show("sum");
  const Sliced both = sliced();
  expect_values(
      both, 1, [](double, double, double z) { return z / 10; }, 1e-7);
  expect_values(
      both, 2, [](double x, double, double z) { return x + 10 * z; }, 2e-3);
}

TEST_F(Fields, MayBeReadByFieldsOnly) {
  add("height", "z/10");
  add("half", "height/2");
  show("half");
  expect_values(
      sliced(), 1, [](double, double, double z) { return z / 20; }, 1e-7);
}

TEST_F(Fields, ReadTheMeshsFrameOrThatOfTheGrid) {
  move_part(100, 200, 300);
  add("own", "x + y + z");
  add("worlds", "x + y + z").set_frame(v1::FIELD_FRAME_WORLD);
  show("own");
  show("worlds");
  const Sliced both = sliced();
  expect_values(
      both, 1, [](double x, double y, double z) { return x + y + z; }, 1e-4);
  expect_values(
      both, 2, [](double x, double y, double z) { return x + y + z + 600; }, 1e-3);
}

TEST_F(Fields, HaveTheRangeOfTheirBoundsOrTheirOwn) {
  add("height", "z/10");
  add("capped", "z").mutable_range()->set_max(4);
  show("height", v1::SAMPLE_TYPE_UINT8);
  show("capped", v1::SAMPLE_TYPE_UINT8);
  const Sliced both = sliced();
  const v1::ValueRange& bounds = both.header.planes(1).value_range();
  EXPECT_LE(bounds.min(), 0);
  EXPECT_GE(bounds.max(), 1);
  EXPECT_NEAR(bounds.max() - bounds.min(), 1, 0.01);
  EXPECT_EQ(both.header.planes(2).value_range().max(), 4);
  EXPECT_EQ(static_cast<unsigned char>(both.planes.at(9)[2][0]), 255) << "9.5, clamped to 4";
  EXPECT_EQ(static_cast<unsigned char>(both.planes.at(0)[2][0]), 32) << "0.5 of 4";
}

TEST_F(Fields, MixMaterials) {
  add("checker", "mod(floor(x/5) + floor(y/5) + floor(z/5), 2)");
  v1::Printing& printing = *job_->mutable_printing();
  v1::BlendMap& blend = *printing.mutable_map()->mutable_blend();
  blend.set_channel("checker");
  for (const auto& [name, rgba, value] :
       {std::tuple{"white", 0xffffffffu, 0.0}, std::tuple{"black", 0x101010ffu, 1.0}}) {
    v1::PrintMaterial& material = *printing.add_materials();
    material.set_name(name);
    material.set_rgba(rgba);
    v1::BlendStop& stop = *blend.add_stops();
    stop.set_value(value);
    stop.set_material(name);
  }
  v1::PlaneSpec& plane = *job_->add_planes();
  plane.mutable_materials();
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  plane.set_encoding(v1::PLANE_ENCODING_RAW);
  const Sliced printed = sliced();
  for (const std::uint32_t layer : {0u, 4u, 5u, 9u}) {
    const std::string& numbers = printed.planes.at(layer)[1];
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t column = 0; column < kColumns; ++column) {
        const std::uint32_t blocks = column / 5 + row / 5 + layer / 5;
        ASSERT_EQ(numbers[row * kColumns + column], blocks % 2 == 0 ? 1 : 2) << column << " " << row << " " << layer;
      }
    }
  }
}

TEST_F(Fields, AreTheSameInAnySplit) {
  add("lattice", "gyroid(x/4, y/4, z/4)*\"x\"");
  show("lattice");
  const Sliced whole = sliced();
  for (const std::uint32_t first : {0u, 3u, 7u}) {
    request_.set_first_layer(first);
    request_.set_layer_count(3);
    const Sliced piece = sliced();
    for (std::uint32_t layer = first; layer < first + 3; ++layer) {
      EXPECT_EQ(piece.planes.at(layer)[1], whole.planes.at(layer)[1]) << layer;
    }
  }
}

TEST_F(Fields, ArePlanned) {
  add("height", "z/10");
  show("height");
  v1::PlanSlicesRequest plan;
  *plan.mutable_job() = *job_;
  v1::PlanSlicesResponse planned;
  grpc::ClientContext context;
  const grpc::Status status = server_.stub().PlanSlices(&context, plan, &planned);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(planned.layer_count(), 10u);
}

TEST_F(Fields, AreProbed) {
  v1::ProbePointsRequest request;
  request.set_mesh_id(box_);
  v1::Field& field = *request.add_fields();
  field.set_name("sum");
  field.set_formula("\"x\" + 100*y");
  for (const double number : {2.0, 3.0, 4.0, 20.0, 3.0, 4.0, 6.0, 1.0, 4.0}) request.add_points_mm(number);
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  v1::ProbePointsResponse answer;
  ASSERT_TRUE(stream->Write(request) && stream->Read(&answer));
  request.clear_fields();  // They go on.
  v1::ProbePointsResponse second;
  ASSERT_TRUE(stream->Write(request) && stream->Read(&second));
  // Bounds of a field of the world move along with the part.
  v1::Field& up = *request.add_fields();
  up.set_name("up");
  up.set_formula("z");
  up.set_frame(v1::FIELD_FRAME_WORLD);
  v1::ProbePointsResponse moved;
  ASSERT_TRUE(stream->Write(request) && stream->Read(&moved));
  request.clear_fields();
  request.clear_points_mm();
  for (const double entry : {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 100.0}) {
    request.mutable_placement()->add_matrix(entry);
  }
  for (const double number : {2.0, 3.0, 104.0}) request.add_points_mm(number);
  ASSERT_TRUE(stream->Write(request) && stream->Read(&moved));
  ASSERT_EQ(moved.channel_values_size(), 2);
  EXPECT_NEAR(moved.channel_values(1), 104, 1e-4);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  ASSERT_EQ(answer.channel_values_size(), 6);
  EXPECT_NEAR(answer.channel_values(0), 2, 1e-6);
  EXPECT_NEAR(answer.channel_values(1), 302, 1e-4);
  EXPECT_EQ(answer.channel_values(3), 0) << "outside";
  EXPECT_NEAR(answer.channel_values(5), 106, 1e-4);
  EXPECT_EQ(second.SerializeAsString(), answer.SerializeAsString());
}

TEST_F(Fields, ArePreviewedOnPlanesAndLayers) {
  v1::PreviewRequest request;
  request.set_number(1);
  request.set_mesh_id(box_);
  request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
  request.mutable_content()->mutable_channel()->set_channel("height");
  v1::FreePlane& plane = *request.mutable_plane()->mutable_free();
  plane.mutable_middle_mm()->set_x(5);
  plane.mutable_middle_mm()->set_y(5);
  plane.mutable_middle_mm()->set_z(5);
  plane.mutable_across()->set_x(1);
  plane.mutable_up()->set_z(1);
  plane.set_across_mm_per_pixel(0.5);
  request.set_width(20);
  request.set_height(20);
  *request.add_fields() = add("height", "z/10");
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  const auto range_of = [&](const v1::PreviewRequest& asked) {
    v1::PreviewResponse answer;
    v1::ValueRange range;
    EXPECT_TRUE(stream->Write(asked));
    do {
      EXPECT_TRUE(stream->Read(&answer));
      if (answer.has_header()) range = answer.header().range();
    } while (!answer.last());
    return range;
  };
  const v1::ValueRange upright = range_of(request);
  EXPECT_NEAR(upright.min(), 0.025, 1e-6);
  EXPECT_NEAR(upright.max(), 0.975, 1e-6);
  v1::PreviewRequest layer;
  layer.set_number(2);
  *layer.mutable_content() = request.content();
  layer.mutable_plane()->mutable_layer()->set_layer(7);
  *layer.mutable_plane()->mutable_layer()->mutable_job() = *job_;
  EXPECT_NEAR(range_of(layer).max(), 0.75, 1e-6);
  layer.set_number(3);
  *layer.add_fields() = request.fields(0);
  EXPECT_TRUE(stream->Write(layer));
  v1::PreviewResponse none;
  EXPECT_FALSE(stream->Read(&none)) << "a layer has its job's";
  EXPECT_EQ(failure_of(stream->Finish()).reason, "REQUEST_MALFORMED");
}

TEST_F(Fields, AreRefusedWithTheirNameAndTheRemedy) {
  struct Case {
    std::string name, formula, reason, field, part_of_message;
  };
  const std::vector<Case> cases = {
      {"", "x", "FIELD_INVALID", "job.fields[0].name", "give the field a name"},
      {std::string(257, 'n'), "x", "FIELD_INVALID", "job.fields[0].name", "shorter"},
      {"a", "", "FIELD_INVALID", "job.fields[0].formula", "\"a\""},
      {"a", "1 +", "FIELD_INVALID", "job.fields[0].formula", "column 4"},
      {"a", "x + heigth", "FIELD_INVALID", "job.fields[0].formula", "heigth"},
      {"a", "1/x", "FIELD_INVALID", "job.fields[0].formula", "clamp(..., low, high)"},
      {"x", "y", "CHANNEL_REPEATED", "job.fields[0]", "already"},
      {"a", "\"a\"", "FIELD_INVALID", "job.fields[0].formula", "those before it only"},
      {"a", "1e308*1e308", "FIELD_INVALID", "job.fields[0].formula", "too large"},
      {"a", std::string(100'000, '('), "FIELD_INVALID", "job.fields[0].formula", "4096"},
  };
  for (const Case& each : cases) {
    job_->clear_fields();
    add(each.name, each.formula);
    const Failure refused = failure();
    EXPECT_EQ(refused.code, grpc::StatusCode::INVALID_ARGUMENT) << each.formula;
    EXPECT_EQ(refused.reason, each.reason) << refused.message;
    EXPECT_EQ(refused.field, each.field) << refused.message;
    EXPECT_THAT(refused.message, HasSubstr(each.part_of_message));
  }
}

TEST_F(Fields, AreRefusedWithoutKindRangeFrameOrEnd) {
  job_->add_fields()->set_name("a");
  EXPECT_EQ(failure().reason, "FIELD_INVALID");
  add("a", "x");
  job_->mutable_fields()->DeleteSubrange(0, 1);
  job_->mutable_fields(0)->mutable_range()->set_min(1);
  EXPECT_EQ(failure().reason, "VALUE_RANGE_INVALID");
  job_->mutable_fields(0)->mutable_range()->set_max(std::nan(""));
  EXPECT_EQ(failure().field, "job.fields[0].range");
  job_->mutable_fields(0)->mutable_range()->set_max(1e300);
  EXPECT_EQ(failure().field, "job.fields[0].range");
  job_->mutable_fields(0)->clear_range();
  job_->mutable_fields(0)->set_frame(static_cast<v1::FieldFrame>(9));
  EXPECT_EQ(failure().reason, "ENUM_VALUE_UNKNOWN");
  job_->clear_fields();
  for (int i = 0; i < 17; ++i) add("f" + std::to_string(i), "x");
  const Failure too_many = failure();
  EXPECT_EQ(too_many.reason, "FIELD_INVALID");
  EXPECT_EQ(too_many.field, "job.fields");
  job_->mutable_fields()->RemoveLast();
  EXPECT_TRUE(server_.slice(request_).status.ok());
}

TEST_F(Fields, MeasureTheDepthOfThePlacedPart) {
  add("depth", "distance(3)");
  add("hollow", "distance(3) + 100*distance(1)");
  show("depth");
  show("hollow");
  const Sliced result = sliced();
  expect_values(
      result, 1, [](double x, double y, double z) { return std::min(depth_in_box(x, y, z), 3.0); }, 1e-5);
  expect_values(
      result, 2,
      [](double x, double y, double z) {
        const double depth = depth_in_box(x, y, z);
        return std::min(depth, 3.0) + 100 * std::min(depth, 1.0);
      },
      1e-3);
  // The same distances in mm for the part at half the size.
  v1::Placement& half = *job_->mutable_parts(0)->add_placements();
  for (const double entry : {0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0}) half.add_matrix(entry);
  for (auto set : {&v1::VoxelPitch::set_x_mm, &v1::VoxelPitch::set_y_mm, &v1::VoxelPitch::set_z_mm}) {
    (job_->mutable_grid()->mutable_pitch()->*set)(0.5);
  }
  expect_values(
      sliced(), 1, [](double x, double y, double z) { return std::min(0.5 * depth_in_box(x, y, z), 3.0); }, 1e-5);
}

TEST_F(Fields, MakeShells) {
  for (const auto& [name, colour] : {std::pair{"core", 0xff0000ffu}, {"inner", 0x00ff00ffu}, {"outer", 0x0000ffffu}}) {
    v1::PrintMaterial& material = *job_->mutable_printing()->add_materials();
    material.set_name(name);
    material.set_rgba(colour);
  }
  add("depth", "distance(2.25)");
  v1::MaterialMap& map = *job_->mutable_printing()->mutable_map();
  map.set_material("core");
  for (const auto& [below, material] : {std::pair{1.25, "outer"}, {2.25, "inner"}}) {
    v1::MapOverride& shell = *map.add_overrides();
    shell.set_channel("depth");
    shell.set_below(below);
    shell.set_material(material);
  }
  v1::PlaneSpec& plane = *job_->add_planes();
  plane.mutable_materials();
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  plane.set_encoding(v1::PLANE_ENCODING_RAW);
  const Sliced result = sliced();
  for (std::uint32_t layer = 0; layer < 10; ++layer) {
    for (std::uint32_t voxel = 0; voxel < kColumns * kRows; ++voxel) {
      const double depth = depth_in_box(voxel % kColumns + 0.5, voxel / kColumns + 0.5, layer + 0.5);
      const int expected = depth < 1.25 ? 3 : depth < 2.25 ? 2 : 1;
      ASSERT_EQ(static_cast<int>(result.planes.at(layer)[1][voxel]), expected) << layer << " " << voxel;
    }
  }
}

TEST_F(Fields, RefuseDistancesThatThereAreNone) {
  add("seam", "1 + interface_distance(2)");
  EXPECT_THAT(failure().message, HasSubstr("fields[0].formula: \"seam\": the mesh has no cell regions that meet"));
  job_->clear_fields();
  for (int i = 1; i <= 5; ++i) add("d" + std::to_string(i), "x + distance(" + std::to_string(i) + ")");
  EXPECT_THAT(failure().message, HasSubstr("fields[4].formula: \"d5\": a job has at most 4 distances"));
}

}  // namespace
}  // namespace ccslice::server
