// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/fitting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/ccmesh.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "core/base/error.h"
#include "core/prepare/deviation.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/client/process.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::AllOf;
using testing::Contains;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

class FittedFile : public testing::Test {
 protected:
  std::string file_of(const ControlMesh& mesh, const std::string& name = "part.ccmesh") {
    const std::string path = (folder_.path() / name).string();
    write_file(path, to_proto(mesh).SerializeAsString());
    return path;
  }

  static std::string error_of(const MeshOptions& options) {
    try {
      load_mesh(options);
    } catch (const UsageError& error) {
      return std::string("usage: ") + error.what();
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }

  TemporaryFolder folder_;
};

TEST(ParseFit, TakesItsTwoWays) {
  EXPECT_EQ(parse_fit(""), std::nullopt);
  EXPECT_EQ(parse_fit("all"), FittedVertices::kAll);
  EXPECT_EQ(parse_fit("boundary"), FittedVertices::kBoundary);
  EXPECT_THROW(parse_fit("inside"), UsageError);
}

TEST_F(FittedFile, PassesThroughItsVerticesAtItsSize) {
  const std::string path = file_of(oracle::box_mesh(4, 4, 4, 10));
  const LoadedMesh loaded =
      load_mesh({.mesh = path, .size = {.size = "60"}, .meaning = {.smooth = true, .fit = "all"}});
  EXPECT_TRUE(loaded.mesh.interpolating);
  const LimitShape shape = measure_limit(loaded.mesh);
  EXPECT_NEAR(shape.bounding_box.sizes().maxCoeff(), 60, 1e-6) << "--size is that of the limit";
  EXPECT_NEAR(shape.deviation.control_volume_mm3, std::pow(shape.deviation.control_box.sizes().x(), 3), 1e-6)
      << "the mesh that it interpolates is a box still";
  EXPECT_THAT(
      loaded.warnings,
      ElementsAre(HasSubstr("--size 60 scales by"), "control points fitted: the limit passes through every vertex",
                  AllOf(ContainsRegex("swells between the vertices by more than a tenth of an edge at [0-9]+ "
                                      "faces of the boundary, most by [0-9.]+ mm off the middle of the mesh's "
                                      "face of vertices [0-9]+, [0-9]+, [0-9]+, [0-9]+, by 0\\.[0-9]+ of an "
                                      "edge, near \\("),
                        EndsWith("keep more edges sharp (--sharp-angle, --sharp-reentrant), or use a finer "
                                 "mesh there; --fit=boundary swells as much"))))
      << "and nothing of edges that --smooth lets it round";
  const LoadedMesh boundary = load_mesh({.mesh = path, .meaning = {.smooth = true, .fit = "boundary"}});
  EXPECT_THAT(boundary.warnings, Contains(EndsWith("or use a finer mesh there"))) << "as whoever gave it knows";
}

TEST_F(FittedFile, NotesHaveLengthsOfThePrintedSize) {
  const std::string path = file_of(oracle::box_mesh(4, 4, 4, 10));
  const std::vector<std::string> grades = {"d=distance:0..1:150"};
  const LoadedMesh scaled = load_mesh(
      {.mesh = path, .grades = grades, .meaning = {.smooth = true, .fit = "all"}, .scale = Vec3::Constant(10)});
  const LoadedMesh in_cm =
      load_mesh({.mesh = path, .grades = grades, .size = {.units = "cm"}, .meaning = {.smooth = true, .fit = "all"}});
  EXPECT_GE(scaled.warnings.size(), 3u);
  EXPECT_EQ(scaled.warnings, in_cm.warnings);
  EXPECT_EQ(scaled.mesh.channel_values, in_cm.mesh.channel_values);
}

TEST_F(FittedFile, NotesHavePlacesAndOffsetsOfThePrintedPart) {
  const std::string path = file_of(oracle::box_mesh(4, 4, 4, 10));
  const auto swelling = [&](const Vec3& scale) {
    std::smatch found;
    const std::string note =
        load_mesh({.mesh = path, .meaning = {.smooth = true, .fit = "all"}, .scale = scale}).warnings.back();
    EXPECT_TRUE(std::regex_search(note, found,
                                  std::regex("by ([0-9.]+) mm off .*near \\(([-0-9.]+), ([-0-9.]+), ([-0-9.]+)\\)")))
        << note;
    return std::array{std::stod(found[1]), std::stod(found[2]), std::stod(found[3]), std::stod(found[4])};
  };
  const auto plain = swelling(Vec3::Ones()), mirrored = swelling(Vec3(1, 1, -1)), tall = swelling(Vec3(1, 1, 10));
  EXPECT_EQ(mirrored[0], plain[0]);
  EXPECT_NEAR(mirrored[3], -plain[3], 1e-4);
  EXPECT_NEAR(tall[3], 10 * plain[3], 1e-3);
  const bool is_across_z = plain[3] < 0 || plain[3] > 40;  // The face is the bottom or the top of the box.
  EXPECT_NEAR(tall[0], (is_across_z ? 10 : 1) * plain[0], 1e-3);
}

TEST_F(FittedFile, OfSharpEdgesSwellsNowhere) {
  const std::string path = file_of(oracle::box_mesh(3, 3, 3, 10));
  const LoadedMesh loaded = load_mesh({.mesh = path, .meaning = {.sharp = {.angle_deg = 40}, .fit = "boundary"}});
  const Deviation deviation = measure_limit(loaded.mesh).deviation;
  EXPECT_NEAR(deviation.limit_volume_mm3, 27000, 1e-6);
  EXPECT_THAT(loaded.warnings,
              Contains("control points fitted to the boundary: the limit passes through every vertex"));
}

/// Grades are those of the part, not of its control points.
TEST_F(FittedFile, HasItsGradesAtItsVertices) {
  const ControlMesh box = oracle::box_mesh(4, 4, 4, 10);
  const LoadedMesh loaded = load_mesh(
      {.mesh = file_of(box), .grades = {"h=z:1..5", "d=distance:0..1:20"}, .meaning = {.smooth = true, .fit = "all"}});
  const ControlMesh meant = mesh_of_limit_points(loaded.mesh);
  for (std::size_t v = 0; v < meant.vertex_count(); ++v) {
    const Vec3& p = meant.positions[v];
    EXPECT_NEAR(meant.channel_values[2 * v], 1 + p.z() / 10, 1e-5) << v;
    EXPECT_NEAR(meant.channel_values[2 * v + 1], std::min(p.minCoeff(), 40 - p.maxCoeff()) / 20, 1e-5) << v;
  }
}

/// Vertices that the limit misses have the grade of the place where they are, whether graded at once or later.
TEST_F(FittedFile, HasItsGradesWhereItsVerticesEndUp) {
  ControlMesh box = oracle::box_mesh(4, 4, 4, 1);
  for (Vec3& p : box.positions) {
    const bool inside = (p.array() > 0.5).all() && (p.array() < 3.5).all();
    if (inside && std::lround(p.x()) == 2) p.x() = 1.1;
  }
  const LoadedMesh at_once =
      load_mesh({.mesh = file_of(box), .grades = {"h=x:0..4"}, .meaning = {.smooth = true, .fit = "boundary"}});
  const ControlMesh met = mesh_of_limit_points(at_once.mesh);
  double farthest = 0;
  for (std::size_t v = 0; v < met.vertex_count(); ++v) {
    EXPECT_NEAR(met.channel_values[v], met.positions[v].x(), 1e-5) << v;
    farthest = std::max(farthest, (met.positions[v] - box.positions[v]).norm());
  }
  EXPECT_GT(farthest, 0.1);
  EXPECT_THAT(at_once.warnings, Contains(HasSubstr("channel h is 0 to 4 at vertices, and ")));
}

TEST_F(FittedFile, MayBeGradedAndSizedAfterwards) {
  const ControlMesh box = oracle::box_mesh(3, 3, 3, 10);
  const LoadedMesh at_once = load_mesh(
      {.mesh = file_of(box), .grades = {"h=z"}, .size = {.size = "20"}, .meaning = {.smooth = true, .fit = "all"}});
  const LoadedMesh fitted = load_mesh({.mesh = file_of(box), .meaning = {.smooth = true, .fit = "all"}});
  const LoadedMesh later =
      load_mesh({.mesh = file_of(fitted.mesh, "fitted.ccmesh"), .grades = {"h=z"}, .size = {.size = "20"}});
  ASSERT_TRUE(later.mesh.interpolating);
  for (std::size_t v = 0; v < box.vertex_count(); ++v) {
    EXPECT_LT((later.mesh.positions[v] - at_once.mesh.positions[v]).norm(), 1e-9) << v;
    EXPECT_NEAR(later.mesh.channel_values[v], at_once.mesh.channel_values[v], 1e-6) << v;
  }
  for (const MeshOptions& again :
       {MeshOptions{.mesh = file_of(fitted.mesh, "fitted.ccmesh"), .meaning = {.smooth = true, .fit = "all"}},
        MeshOptions{.mesh = file_of(fitted.mesh, "fitted.ccmesh"), .meaning = {.sharp = {.angle_deg = 40}}}}) {
    EXPECT_THAT(error_of(again), HasSubstr("fitted.ccmesh are fitted already"));
  }
}

/// However it is written, sized, moved and graded afterwards.
TEST_F(FittedFile, KnowsWhatItsFitMissed) {
  ControlMesh dented = oracle::box_mesh(1, 1, 1, 10);
  dented.positions[0] += Vec3(1, 1, 1);
  const double missed_mm = std::sqrt(3.0) / 8, volume = measure_limit(dented).deviation.control_volume_mm3;
  const LoadedMesh fitted = load_mesh({.mesh = file_of(dented), .meaning = {.smooth = true, .fit = "boundary"}});
  const std::string json = (folder_.path() / "fitted.json").string();
  write_file(json, to_json(to_proto(fitted.mesh)));
  for (const std::string& path : {file_of(fitted.mesh, "fitted.ccmesh"), json}) {
    const LoadedMesh read = load_mesh({.mesh = path});
    EXPECT_EQ(read.bytes->id(), fitted.bytes->id());
    const Deviation as_it_is = measure_limit(read.mesh).deviation;
    EXPECT_NEAR(as_it_is.farthest.distance_mm(), missed_mm, 1e-6);
    EXPECT_NEAR(as_it_is.control_volume_mm3, volume, 1e-6);
    const LoadedMesh cm = load_mesh({.mesh = path, .grades = {"h=z"}, .size = {.units = "cm"}});
    EXPECT_NEAR(measure_limit(cm.mesh).deviation.farthest.distance_mm(), 10 * missed_mm, 1e-5);
    const LoadedMesh placed = load_mesh({.mesh = path, .size = {.size = "z=30", .center = true, .on_bed = true}});
    const Deviation deviation = measure_limit(placed.mesh).deviation;
    const double scale = std::cbrt(deviation.limit_volume_mm3 / as_it_is.limit_volume_mm3);
    EXPECT_NE(scale, 1);
    EXPECT_NEAR(deviation.farthest.distance_mm(), scale * missed_mm, 1e-5);
    EXPECT_NEAR(deviation.control_volume_mm3, std::pow(scale, 3) * volume, 1e-4);
  }
  const LoadedMesh sized =
      load_mesh({.mesh = file_of(dented), .size = {.units = "in"}, .meaning = {.smooth = true, .fit = "boundary"}});
  EXPECT_NEAR(measure_limit(sized.mesh).deviation.farthest.distance_mm(), 25.4 * missed_mm, 1e-5);
}

/// The mesh that its channels are measured on isn't the one that was fitted.
TEST_F(FittedFile, OfSeveralRegionsMayBeGradedThoughItsFitMissed) {
  ControlMesh box =
      oracle::with_regions(oracle::box_mesh(2, 1, 1, 10), 2, [](const Vec3& p) { return p.x() < 10 ? 0 : 1; });
  box.interpolating = true;
  box.missed_vertices = {{0, Vec3(-1, 0, 0)}};
  const LoadedMesh graded = load_mesh({.mesh = file_of(box), .grades = {"h=z", "d=distance"}});
  ASSERT_EQ(graded.mesh.missed_vertices.size(), 1u);
  EXPECT_EQ(graded.mesh.missed_vertices[0].position, Vec3(-1, 0, 0));
}

TEST_F(FittedFile, SaysWhichChannelsRingAndWhere) {
  ControlMesh box = oracle::box_mesh(6, 3, 3, 10);
  box.channel_names = {"step", "slope"};
  for (const Vec3& p : box.positions) {
    for (const double value : {p.x() < 25 ? 20.0 : 30.0, p.x()})
      box.channel_values.push_back(static_cast<float>(value));
  }
  const std::string path = file_of(box);
  const auto rings = HasSubstr("rings: it is 20 to 30 at vertices, and the limit reaches ");
  const LoadedMesh fitted = load_mesh({.mesh = path, .meaning = {.sharp = {.angle_deg = 40}, .fit = "all"}});
  EXPECT_THAT(fitted.warnings,
              Contains(AllOf(HasSubstr("channel step "), rings, HasSubstr(", in cell 7 near (15, 10, 0) mm: use a"))));
  EXPECT_THAT(fitted.warnings, Not(Contains(HasSubstr("channel slope"))));
  // The remedies that the note names.
  EXPECT_THAT(load_mesh({.mesh = path, .meaning = {.sharp = {.angle_deg = 40}}}).warnings, Not(Contains(rings)));
  for (std::size_t v = 0; v < box.vertex_count(); ++v) {
    box.channel_values[2 * v] = static_cast<float>(20 + std::clamp((box.positions[v].x() - 10) / 4, 0.0, 10.0));
  }
  const LoadedMesh wider =
      load_mesh({.mesh = file_of(box, "wider.ccmesh"), .meaning = {.sharp = {.angle_deg = 40}, .fit = "all"}});
  EXPECT_THAT(wider.warnings, Not(Contains(rings)));
}

TEST_F(FittedFile, MistakesTeach) {
  EXPECT_EQ(error_of({.mesh = "x", .meaning = {.smooth = true, .fit = "inside"}}),
            "usage: --fit takes nothing, or =boundary, not 'inside'");
  ControlMesh dented = oracle::box_mesh(1, 1, 1, 10);
  dented.positions[0] += Vec3(1, 1, 1);
  EXPECT_THAT(error_of({.mesh = file_of(dented), .meaning = {.smooth = true, .fit = "all"}}),
              HasSubstr("(--fit=boundary)"));
  ControlMesh uneven = oracle::box_mesh(5, 5, 5, 1);
  for (Vec3& p : uneven.positions)
    p = p.unaryExpr([](double x) { return std::ceil(x / 2) + (x == 2 || x == 4) * 0.02; });
  EXPECT_THAT(error_of({.mesh = file_of(uneven), .meaning = {.smooth = true, .fit = "all"}}),
              ContainsRegex("would fold in cells [0-9, ]+ and [0-9]+ more: the first is near \\([-0-9., ]+\\) mm; keep "
                            "such places back, or edges sharp \\(--fit=boundary\\)$"))
      << "with one place";
  const LoadedMesh near =
      load_mesh({.mesh = file_of(dented), .grades = {"a=x"}, .meaning = {.smooth = true, .fit = "boundary"}});
  EXPECT_THAT(near.warnings, Contains(HasSubstr("all vertices of the boundary but 8, which stay behind")));
  const MeshOptions on_server{.mesh = "sha256:" + std::string(64, '0'), .meaning = {.smooth = true, .fit = "all"}};
  EXPECT_THROW(names_mesh_id(on_server), UsageError);
}

/// What isn't scaled keeps its bits, negative zeros too, and so the mesh keeps its id.
TEST_F(FittedFile, LeavesPositionsThatNothingChangesAlone) {
  ControlMesh box = oracle::box_mesh(2, 2, 2, 10);
  box.positions[0].x() = -0.0;
  const LoadedMesh graded = load_mesh({.mesh = file_of(box), .grades = {"h=z"}});
  EXPECT_TRUE(std::signbit(graded.mesh.positions[0].x()));
}

}  // namespace
}  // namespace ccslice::cli
