// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/sizing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "core/base/error.h"
#include "core/limit/limit_solid.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/client/process.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Meshes in a file, sized when they are loaded.
class SizedFile : public testing::Test {
 protected:
  std::string file_of(const ControlMesh& mesh) {
    const std::string path = (folder_.path() / "part.ccmesh").string();
    write_file(path, to_proto(mesh).SerializeAsString());
    return path;
  }
  static Box3 limit_box(const ControlMesh& mesh) { return prepare_solid(mesh)->summary().bounding_box; }

  TemporaryFolder folder_;
};

TEST(ParseSizing, TakesUnitsAndSides) {
  EXPECT_EQ(parse_sizing({.units = "in"}).mm_per_unit, 25.4);
  EXPECT_EQ(parse_sizing({.units = "um"}).mm_per_unit, 1e-3);
  EXPECT_FALSE(parse_sizing({.units = "mm"}).changes());
  EXPECT_EQ(parse_sizing({.size = "30"}).side_mm, 30);
  EXPECT_EQ(parse_sizing({.size = "30"}).axis, std::nullopt);
  EXPECT_EQ(parse_sizing({.size = "y=2.5"}).side_mm, 2.5);
  EXPECT_EQ(parse_sizing({.size = "y=2.5"}).axis, 1);
}

TEST(ParseSizing, MistakesTeach) {
  const auto error_of = [](const SizeOptions& options) -> std::string {
    try {
      parse_sizing(options);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of({.units = "ft"}),
            "--units takes mm, cm, m, in or um, the unit of the file's coordinates, not 'ft'");
  for (const char* size : {"z", "z=", "w=3", "z=-3", "0", "30mm", "nan", "inf", "x=30,40", "1e-4", "1e7"}) {
    EXPECT_EQ(error_of({.size = size}),
              "--size takes the part's longest side in mm, as in 30, or its side along an axis, as in z=30, from 0.001 "
              "to 1,000,000; not '" +
                  std::string(size) + "'");
  }
}

TEST_F(SizedFile, UnitsTurnCoordinatesIntoMillimetres) {
  const ControlMesh box = make_box();
  const LoadedMesh inches = load_mesh({.mesh = file_of(box), .size = {.units = "in"}});
  for (std::size_t v = 0; v < box.vertex_count(); ++v) {
    EXPECT_EQ(inches.mesh.positions[v], Vec3(25.4 * box.positions[v]));
  }
  EXPECT_EQ(load_mesh({.mesh = file_of(box), .size = {.units = "mm"}}).bytes->id(),
            load_mesh({.mesh = file_of(box)}).bytes->id());
}

// The coyote is smooth: its limit is well inside of its control mesh.
TEST_F(SizedFile, SizesAndPlacesAreThoseOfTheLimit) {
  const ControlMesh coyote = make_coyote();
  const Vec3 before = limit_box(coyote).sizes();
  const LoadedMesh sized =
      load_mesh({.mesh = file_of(coyote), .size = {.units = "cm", .size = "z=30", .center = true, .on_bed = true}});
  const Box3 box = limit_box(sized.mesh);
  EXPECT_NEAR(box.sizes().z(), 30, 1e-7);
  EXPECT_NEAR(box.sizes().x(), before.x() / before.z() * 30, 1e-6) << "in proportion";
  EXPECT_NEAR(box.min().z(), 0, 1e-7);
  EXPECT_NEAR(box.center().x(), 0, 1e-7);
  EXPECT_NEAR(box.center().y(), 0, 1e-7);
  ASSERT_EQ(sized.warnings.size(), 1u);
  EXPECT_THAT(sized.warnings[0], testing::AllOf(HasSubstr("--size z=30 scales by "), HasSubstr(" x 30 mm, from (")));
  const LoadedMesh longest = load_mesh({.mesh = file_of(coyote), .size = {.size = "12"}});
  EXPECT_NEAR(limit_box(longest.mesh).sizes().maxCoeff(), 12, 1e-7);
  const double scale = 12 / before.maxCoeff();
  EXPECT_TRUE(longest.mesh.positions[7].isApprox(scale * coyote.positions[7], 1e-9)) << "about the file's origin";
}

TEST_F(SizedFile, PlacingAloneDoesNotScale) {
  const ControlMesh box = make_box();
  const LoadedMesh placed = load_mesh({.mesh = file_of(box), .size = {.center = true}});
  const Vec3 moved = placed.mesh.positions[0] - box.positions[0];
  EXPECT_TRUE(moved.isApprox(Vec3(-12, -8, 0), 1e-9)) << moved;
  for (std::size_t v = 0; v < box.vertex_count(); ++v) {
    EXPECT_LT((placed.mesh.positions[v] - box.positions[v] - moved).norm(), 1e-12);
  }
  EXPECT_THAT(placed.warnings, ElementsAre("the part takes 24 x 16 x 8 mm, from (-12, -8, 0)"));
}

TEST_F(SizedFile, SharpEdgesCountBeforeSizes) {
  ControlMesh box = make_box();
  box.sharp_edges.clear();
  box.sharp_vertices.clear();
  const LoadedMesh sharp =
      load_mesh({.mesh = file_of(box), .size = {.size = "x=48"}, .meaning = {.sharp = {.angle_deg = 40}}});
  EXPECT_NEAR(limit_box(sharp.mesh).sizes().x(), 48, 1e-7);
  EXPECT_TRUE(sharp.mesh.positions[1].isApprox(2 * box.positions[1], 1e-9)) << "a sharp box fills its control mesh";
}

TEST_F(SizedFile, GradesAreInMillimetresOfTheResult) {
  const ControlMesh ring = make_ring();
  const auto deepest_value = [&](const SizeOptions& size) {
    const LoadedMesh graded = load_mesh({.mesh = file_of(ring), .grades = {"skin=distance:0..1:1000"}, .size = size});
    const std::size_t channels = graded.mesh.channel_count();
    float most = 0;
    for (std::size_t at = channels - 1; at < graded.mesh.channel_values.size(); at += channels) {
      most = std::max(most, graded.mesh.channel_values[at]);
    }
    return 1000.0 * most;  // Its depth, mm.
  };
  const double as_it_is = deepest_value({});
  EXPECT_GT(as_it_is, 1);
  EXPECT_NEAR(deepest_value({.units = "cm"}), 10 * as_it_is, 1e-3);
  EXPECT_NEAR(deepest_value({.size = "83.53"}) / as_it_is, 83.53 / limit_box(ring).sizes().maxCoeff(), 1e-5);
}

TEST_F(SizedFile, GradesByDistanceSayHowDeepTheyGo) {
  const std::string file = file_of(make_box({.size_mm = Vec3(60, 60, 60), .cells_x = 6, .cells_y = 6, .cells_z = 6}));
  const auto note = [&](const std::string& grade, const SizeOptions& size = {}) {
    const LoadedMesh graded = load_mesh({.mesh = file, .grades = {grade}, .size = size});
    return graded.warnings.empty() ? "no note" : graded.warnings.back();
  };
  EXPECT_EQ(note("skin=distance:90..30"),
            "--grade skin=distance reaches 30 at a depth of 30 mm, where the deepest vertex lies");
  EXPECT_EQ(
      note("skin=distance:90..30:20"),
      "--grade skin=distance reaches 30 at a depth of 20 mm and keeps it down to 30 mm, where the deepest vertex lies");
  EXPECT_EQ(note("skin=distance:90..30:40"),
            "--grade skin=distance ends at a depth of 30 mm, where the deepest vertex lies, with 45 instead of "
            "30");
  EXPECT_EQ(
      note("skin=distance:90..30:2.5", {.size = "6"}),
      "--grade skin=distance reaches 30 at a depth of 2.5 mm and keeps it down to 3 mm, where the deepest vertex lies");
  EXPECT_EQ(note("height=z"), "no note");
  EXPECT_EQ(load_mesh({.mesh = file, .grades = {"skin=distance:0..1:40"}, .scale = Vec3(2, -2, 2)}).warnings.back(),
            "--grade skin=distance reaches 1 at a depth of 40 mm and keeps it down to 60 mm, where the deepest vertex "
            "lies");
}

TEST_F(SizedFile, LengthsOfGradesAreThoseOnceScaled) {
  const std::string file = file_of(make_box({.size_mm = Vec3(60, 60, 60), .cells_x = 6, .cells_y = 6, .cells_z = 6}));
  const auto graded = [&](const std::string& grade, const Vec3& scale, const SizeOptions& size = {}) {
    return load_mesh({.mesh = file, .grades = {grade}, .size = size, .scale = scale}).mesh;
  };
  const ControlMesh as_it_is = graded("skin=distance:0..1:20", Vec3::Ones());
  const ControlMesh half = graded("skin=distance:0..1:10", Vec3::Constant(0.5));
  EXPECT_EQ(half.channel_values, as_it_is.channel_values);
  EXPECT_EQ(half.positions, as_it_is.positions) << "scaling the part is the server's business";
  const ControlMesh large = graded("r=radial:@120,60,60", Vec3(4, 2, 2));
  const ControlMesh sized = graded("r=radial:@120,60,60", Vec3(2, 1, 1), {.units = "in", .size = "240"});
  ASSERT_EQ(large.channel_values.size(), sized.channel_values.size());
  for (std::size_t v = 0; v < large.vertex_count(); ++v) {
    const double x = 4 * as_it_is.positions[v].x(), y = 2 * as_it_is.positions[v].y();
    const double z = 2 * as_it_is.positions[v].z(), farthest = Vec3(120, 60, 60).norm();
    const std::size_t at = (v + 1) * large.channel_count() - 1;
    EXPECT_NEAR(large.channel_values[at], Vec3(x - 120, y - 60, z - 60).norm() / farthest, 1e-6);
    EXPECT_NEAR(sized.channel_values[at], large.channel_values[at], 1e-6);
  }
  for (const char* grade : {"up=z", "skin=distance:0..1:20", "r=radial:@1,2,3"}) {
    EXPECT_EQ(graded(grade, Vec3(1, 1, -1)).channel_values, graded(grade, Vec3::Ones()).channel_values)
        << "a mirrored part keeps its materials";
    EXPECT_EQ(graded(grade, Vec3(1, 1, -1), {.on_bed = true}).channel_values,
              graded(grade, Vec3::Ones(), {.on_bed = true}).channel_values)
        << "on the bed, too";
  }
}

TEST_F(SizedFile, SizesAndPlacesAreThoseOnceScaled) {
  const std::string file = file_of(make_box());  // 24 x 16 x 8, from 0.
  const SizeOptions all = {.size = "z=30", .center = true, .on_bed = true};
  const Vec3 scale(1, 2, -3);
  const LoadedMesh sized = load_mesh({.mesh = file, .size = all, .scale = scale});
  Box3 box;
  for (const Vec3& position : sized.mesh.positions) box.extend(Vec3(position.cwiseProduct(scale)));
  EXPECT_TRUE(box.min().isApprox(Vec3(-15, -20, 0), 1e-9)) << box.min().transpose();
  EXPECT_TRUE(box.max().isApprox(Vec3(15, 20, 30), 1e-9)) << box.max().transpose();
  EXPECT_THAT(sized.warnings, ElementsAre("--size z=30 scales by 1.25, and --scale further: the part takes 30 x 40 x "
                                          "30 mm, from (-15, -20, 0)"));
  EXPECT_THAT(load_mesh({.mesh = file, .size = {.on_bed = true}, .scale = Vec3(1, 1, -1)}).warnings,
              ElementsAre("the part takes 24 x 16 x 8 mm, from (0, 0, 0)"));
}

TEST_F(SizedFile, SmallAndLargePartsMayBeInAnotherUnit) {
  const auto warnings = [&](double longest_mm, const SizeOptions& size) {
    return load_mesh({.mesh = file_of(make_box({.size_mm = Vec3(0.5, 0.25, 1) * longest_mm})), .size = size}).warnings;
  };
  const auto asks = Contains(HasSubstr("Is the file in another unit?"));
  EXPECT_THAT(warnings(0.08, {}), ElementsAre("the longest side of the control mesh is 0.08 mm. Is the file in another "
                                              "unit? --units m makes it 80 mm, --units in 2.032 mm; --size sets the "
                                              "size; --units mm says that it is meant"));
  EXPECT_THAT(warnings(1200, {}), Contains(HasSubstr("--units um makes it 1.2 mm")));
  EXPECT_THAT(warnings(0.08, {.center = true}), asks);
  for (const SizeOptions& meant : {SizeOptions{.units = "mm"}, SizeOptions{.units = "m"}, SizeOptions{.size = "0.5"}}) {
    EXPECT_THAT(warnings(0.08, meant), Not(asks));
  }
  EXPECT_THAT(warnings(1, {}), testing::IsEmpty());
  EXPECT_THAT(warnings(1000, {}), testing::IsEmpty());
  const std::string file = file_of(make_box({.size_mm = Vec3(0.04, 0.02, 0.08)}));
  EXPECT_THAT(load_mesh({.mesh = file, .scale = Vec3::Constant(1000)}).warnings, testing::IsEmpty());
  EXPECT_THAT(load_mesh({.mesh = file, .scale = Vec3(30, 1, 10)}).warnings, testing::IsEmpty());
  EXPECT_THAT(load_mesh({.mesh = file, .scale = Vec3(10, 10, 10)}).warnings, Contains(HasSubstr("is 0.8 mm. Is the")));
}

ControlMesh moved(ControlMesh mesh, double factor, const Vec3& offset) {
  for (Vec3& position : mesh.positions) position = factor * position + offset;
  return mesh;
}

TEST_F(SizedFile, SizesHoldForCoordinatesBeyondTheLimits) {
  const ControlMesh ring = make_ring();
  const LoadedMesh near = load_mesh({.mesh = file_of(ring), .size = {.size = "50"}});
  const LoadedMesh far = load_mesh({.mesh = file_of(moved(ring, 1e9, Vec3::Zero())), .size = {.size = "50"}});
  for (std::size_t v = 0; v < ring.vertex_count(); ++v) {
    EXPECT_LT((far.mesh.positions[v] - near.mesh.positions[v]).norm(), 1e-11) << v;
  }
}

TEST_F(SizedFile, PartsFarFromTheOriginKeepTheirShape) {
  const ControlMesh ring = make_ring();
  const Vec3 offset(4e9, -5e9, 3e8);  // Doubles have 1e-6 left there.
  const SizeOptions size = {.size = "50", .center = true, .on_bed = true};
  const LoadedMesh near = load_mesh({.mesh = file_of(ring), .size = size});
  const LoadedMesh far = load_mesh({.mesh = file_of(moved(ring, 1, offset)), .size = size});
  for (std::size_t v = 0; v < ring.vertex_count(); ++v) {
    EXPECT_LT((far.mesh.positions[v] - near.mesh.positions[v]).norm(), 5e-6) << v;
  }
  const LoadedMesh placed = load_mesh(
      {.mesh = file_of(moved(ring, 1, offset)), .size = {.center = true, .on_bed = true}, .scale = {2, -1, 1}});
  const LoadedMesh there =
      load_mesh({.mesh = file_of(ring), .size = {.center = true, .on_bed = true}, .scale = {2, -1, 1}});
  for (std::size_t v = 0; v < ring.vertex_count(); ++v) {
    EXPECT_LT((placed.mesh.positions[v] - there.mesh.positions[v]).norm(), 5e-6) << v;
  }
}

// --size scales about the file's origin.
TEST_F(SizedFile, PlacesBeyondTheLimitsAreThoseOfTheResult) {
  const ControlMesh far = moved(make_ring(), 1, Vec3(2e6, 0, 0));
  const double side = limit_box(make_ring()).sizes().maxCoeff();
  const LoadedMesh half = load_mesh({.mesh = file_of(far), .size = {.size = std::to_string(side / 10)}});
  EXPECT_NEAR(limit_box(half.mesh).center().x(), 2e5, 1);
  try {
    load_mesh({.mesh = file_of(far), .size = {.size = std::to_string(side)}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshCoordinateOutOfRange);
    EXPECT_THAT(error.what(), HasSubstr("--center and --on-bed move it to the origin"));
  }
}

TEST_F(SizedFile, FilesBeyondTheLimitsAreToldOfUnits) {
  const std::string file = file_of(make_box({.size_mm = Vec3(5e6, 5e6, 5e6)}));
  try {
    load_mesh({.mesh = file});
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("--units"));
  }
  EXPECT_NO_THROW(load_mesh({.mesh = file, .size = {.units = "um"}}));
}

}  // namespace
}  // namespace ccslice::cli
