// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Every pixel of planes against exact inversion.

#include "core/preview/plane_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/field/material_pass.h"
#include "core/mesh_authoring/grade.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/preview/painted_plane.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr double kTolerance = 1.0 / 256, kRoughTolerance = 1.0 / 32;
constexpr double kBoth = 1.25;  // The tolerances of a picture and of a layer, in the picture's.

float value_at(const ContonePlane& plane, std::size_t pixel) {
  float value = 0;
  std::memcpy(&value, plane.image().samples.data() + sizeof value * pixel, sizeof value);
  return value;
}

struct Errors {
  std::uint64_t pixels = 0, beyond = 0;  // Of all channels.
  double worst = 0;                      // In tolerances.
  std::string worst_at;
};

/// The least error by what inversion finds a little beside a pixel, on whichever side of an interface that is.
double error_beside(PaintedPlane& plane, std::uint32_t column, std::uint32_t row, std::size_t channel, double value) {
  constexpr double kBeside = 0.15;  // Pixels: interfaces are traced to a tenth.
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> values(plane.solid->channel_count());
  for (const Vec2& step : {Vec2(kBeside, 0), Vec2(-kBeside, 0), Vec2(0, kBeside), Vec2(0, -kBeside)}) {
    const Vec3 place = plane.lattice.centre(column, row, plane.layer.grid.layer_z_mm(0)) +
                       Vec3(step.x() * plane.lattice.dx_mm, step.y() * plane.lattice.dy_mm, 0);
    const auto found = plane.field->invert(place, {});
    if (!found) continue;
    plane.field->mat(found->at, values);
    least = std::min(least, std::abs(value - values[channel]) / plane.spec.channels[channel].tolerance);
  }
  return least;
}

void add_errors(PlaneSampler& sampler, const Vec3& normal, double share, std::uint32_t pixels,
                const std::shared_ptr<const LimitSolid>& solid, bool rough, Errors& errors) {
  PaintedPlane plane(solid, normal, share, pixels, rough ? kRoughTolerance : kTolerance);
  PartPlanes sampled(plane.layer, solid->summary()), exact(plane.layer, solid->summary());
  sampler.paint(plane.target(sampled), plane.spec, *plane.field, plane.spans, plane.regions, {.rough = rough});
  const auto field = make_material_field(solid, plane.layer.placement, plane.spec.outside_mm);
  MaterialPass pass(*field);
  ASSERT_EQ(pass.run(plane.target(exact), plane.spans), WindowOutcome::kComplete);
  for (std::size_t c = 0; c < plane.spec.channels.size(); ++c) {
    for (const VoxelRun& span : plane.spans) {
      for (std::uint32_t x = span.begin; x < span.end; ++x) {
        const std::size_t at = std::size_t{pixels} * span.row + x;
        const double value = value_at(sampled.channels()[c], at);
        double error = std::abs(value - value_at(exact.channels()[c], at)) / plane.spec.channels[c].tolerance;
        if (error > kBoth && solid->has_several_regions()) error = error_beside(plane, x, span.row, c, value);
        ++errors.pixels;
        errors.beyond += error <= kBoth ? 0 : 1;  // NaN is beyond.
        if (error <= errors.worst) continue;
        errors.worst = error;
        errors.worst_at = std::to_string(x) + ", " + std::to_string(span.row) + " of channel " + std::to_string(c);
      }
    }
  }
}

/// Planes along the axes and oblique ones.
Errors errors_of(ControlMesh mesh, std::uint32_t pixels, bool rough = false) {
  const auto solid = prepare_solid(std::move(mesh));
  PlaneSampler sampler(solid);
  Errors errors;
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 2, 3), Vec3(-3, 1, 0.1)}) {
    for (const double share : {0.27, 0.52}) add_errors(sampler, normal, share, pixels, solid, rough, errors);
  }
  return errors;
}

class SampledModels : public testing::TestWithParam<std::string> {};

TEST_P(SampledModels, KeepTheToleranceInEveryPixel) {
  for (const SampleModel& model : sample_models()) {
    if (model.name != GetParam()) continue;
    const Errors errors = errors_of(model.make(), 512);
    EXPECT_GT(errors.pixels, 5000u);
    // Samples don't prove a bound: of a hundred thousand pixels one may be a little beyond it.
    EXPECT_LE(errors.beyond, errors.pixels / 100'000) << errors.worst_at;
    EXPECT_LE(errors.worst, 2) << errors.worst_at;
  }
}

TEST_P(SampledModels, KeepARoughToleranceToo) {
  for (const SampleModel& model : sample_models()) {
    if (model.name != GetParam()) continue;
    const Errors errors = errors_of(model.make(), 64, true);
    EXPECT_GT(errors.pixels, 100u);
    EXPECT_LE(errors.beyond, errors.pixels / 1000) << errors.worst << " at " << errors.worst_at;
    EXPECT_LE(errors.worst, 2) << errors.worst_at;
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, SampledModels, testing::Values("ring", "coyote", "engine", "bracket", "grid"),
                         [](const auto& info) { return info.param; });

class SampledTinyMeshes : public testing::TestWithParam<std::size_t> {};

TEST_P(SampledTinyMeshes, KeepTheToleranceInEveryPixel) {
  const Errors errors = errors_of(oracle::tiny_meshes()[GetParam()].mesh, 100);
  EXPECT_GT(errors.pixels, 1000u);
  EXPECT_EQ(errors.beyond, 0u) << errors.worst << " at " << errors.worst_at;
}

TEST_P(SampledTinyMeshes, KeepARoughToleranceToo) {
  const Errors errors = errors_of(oracle::tiny_meshes()[GetParam()].mesh, 48, true);
  EXPECT_GT(errors.pixels, 200u);
  EXPECT_LE(errors.beyond, errors.pixels / 1000) << errors.worst << " at " << errors.worst_at;
  EXPECT_LE(errors.worst, 2) << errors.worst_at;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, SampledTinyMeshes, testing::Range<std::size_t>(0, oracle::tiny_meshes().size()),
                         [](const auto& info) { return oracle::tiny_meshes()[info.param].name; });

struct MeshAsMeshed {
  const char* name;
  ControlMesh (*make)();
};

/// Faces of hexahedra are bent where their vertices were moved.
const MeshAsMeshed kMeshesAsMeshed[] = {
    {"hexahedra", [] { return oracle::box_mesh(9, 9, 9); }},
    {"large_hexahedra", [] { return oracle::box_mesh(2, 2, 2); }},
    {"moved_hexahedra",
     [] {
       ControlMesh mesh = oracle::box_mesh(4, 4, 4);
       oracle::jitter(mesh, 1.5, 3);
       return mesh;
     }},
    {"skew_tetrahedra", [] { return oracle::tiny_mesh("vertex_link_tetrahedron_inside"); }},
    {"tetrahedra", [] { return oracle::kuhn_box(2); }},
    {"moved_tetrahedra",
     [] {
       ControlMesh mesh = oracle::kuhn_box(4);
       oracle::jitter(mesh, 0.5, 5);
       return mesh;
     }},
};

class SampledAsMeshed : public testing::TestWithParam<MeshAsMeshed> {
 protected:
  ControlMesh mesh() const {
    ControlMesh mesh = GetParam().make();
    if (mesh.channel_count() == 0) oracle::add_random_channels(mesh, 2, 17);
    mesh.as_meshed = true;
    mesh.sharp_edges.clear();
    mesh.sharp_vertices.clear();
    return mesh;
  }
};

TEST_P(SampledAsMeshed, KeepTheToleranceInEveryPixelThoughSlopesJump) {
  const Errors errors = errors_of(mesh(), 200);
  EXPECT_GT(errors.pixels, 50'000u);
  EXPECT_EQ(errors.beyond, 0u) << errors.worst << " at " << errors.worst_at;
}

TEST_P(SampledAsMeshed, KeepARoughToleranceToo) {
  const Errors errors = errors_of(mesh(), 48, true);
  EXPECT_GT(errors.pixels, 2000u);
  EXPECT_EQ(errors.beyond, 0u) << errors.worst << " at " << errors.worst_at;
}

INSTANTIATE_TEST_SUITE_P(Meshes, SampledAsMeshed, testing::ValuesIn(kMeshesAsMeshed),
                         [](const auto& info) { return info.param.name; });

TEST(PlaneSampler, ChannelsThatJumpBetweenRegionsDontMix) {
  for (const oracle::RegionMesh& given : oracle::region_meshes()) {
    ControlMesh mesh =
        oracle::with_jumping_channels(given.mesh, {"jumping"}, [](std::uint32_t vertex, std::uint8_t region) {
          return std::vector<float>{static_cast<float>(10 * region) + 0.01f * static_cast<float>(vertex % 5)};
        });
    const Errors errors = errors_of(std::move(mesh), 80);
    EXPECT_GT(errors.pixels, 1000u) << given.name;
    EXPECT_EQ(errors.beyond, 0u) << given.name << ": " << errors.worst << " at " << errors.worst_at;
  }
}

TEST(PlaneSampler, FoldsAreInvertedPixelByPixel) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  if (mesh.channel_count() == 0) apply_grade(parse_grade("stiffness=x"), mesh);
  const Errors errors = errors_of(std::move(mesh), 120);
  EXPECT_GT(errors.pixels, 1000u);
  EXPECT_EQ(errors.beyond, 0u) << errors.worst << " at " << errors.worst_at;
}

TEST(PlaneSampler, SeveralChannelsKeepTheirOwnTolerances) {
  ControlMesh mesh = make_bracket();
  apply_grade(parse_grade("steep=radial:0..1000"), mesh);
  apply_grade(parse_grade("skin=distance:1..0"), mesh);
  const Errors errors = errors_of(std::move(mesh), 256);
  EXPECT_EQ(errors.beyond, 0u) << errors.worst << " at " << errors.worst_at;
}

TEST(PlaneSampler, TakesTheToleranceFromThePicturesOwnRange) {
  // Along the grade's own axis a plane hardly changes its values; what it shows of them is to be as fine all the same.
  ControlMesh mesh = make_engine();
  apply_grade(parse_grade("height=z"), mesh);
  const auto solid = prepare_solid(std::move(mesh));
  PlaneSampler sampler(solid);
  const std::size_t height = solid->channel_count() - 1;
  struct Cut {
    Vec3 normal;
    std::uint32_t pixels;
  };
  // In the small one no corner of a block is inside.
  for (const Cut& cut : {Cut{Vec3(0, 0, 1), 256}, Cut{Vec3(0.02, 0.01, 1), 256}, Cut{Vec3(0.02, 0.01, 1), 6}}) {
    PaintedPlane plane(solid, cut.normal, 0.52, cut.pixels, kTolerance);
    plane.spec.channels = {plane.spec.channels[height]};
    PartPlanes sampled(plane.layer, solid->summary()), exact(plane.layer, solid->summary());
    sampler.paint(plane.target(sampled), plane.spec, *plane.field, plane.spans, plane.regions, {.own_range = true});
    const auto field = make_material_field(solid, plane.layer.placement, plane.spec.outside_mm);
    ASSERT_EQ(MaterialPass(*field).run(plane.target(exact), plane.spans), WindowOutcome::kComplete);
    double low = std::numeric_limits<double>::infinity(), high = -low, worst = 0;
    for (const VoxelRun& span : plane.spans) {
      for (std::uint32_t x = span.begin; x < span.end; ++x) {
        const std::size_t at = std::size_t{cut.pixels} * span.row + x;
        const double value = value_at(exact.channels()[height], at);
        low = std::min(low, value);
        high = std::max(high, value);
        worst = std::max(worst, std::abs(value - value_at(sampled.channels()[height], at)));
      }
    }
    const ChannelRange& whole = solid->summary().channels[height];
    EXPECT_LT(high - low, 0.3 * (whole.max - whole.min));
    // Floats round, and what reaches over a thousandth of the channel's range only counts as constant.
    EXPECT_LE(worst, 1.25 * kTolerance * std::max(high - low, 1e-3 * (whole.max - whole.min)));
  }
}

TEST(PlaneSampler, SamplesDependOnNothingBefore) {
  const auto solid = prepare_solid(make_bracket());
  PlaneSampler used(solid);
  for (const double share : {0.3, 0.5, 0.7}) {
    PaintedPlane plane(solid, Vec3(1, 2, 3), share, 256, kTolerance);
    PartPlanes one(plane.layer, solid->summary()), other(plane.layer, solid->summary());
    used.paint(plane.target(one), plane.spec, *plane.field, plane.spans, plane.regions);
    const auto field = make_material_field(solid, plane.layer.placement, plane.spec.outside_mm);
    PlaneSampler(solid).paint(plane.target(other), plane.spec, *field, plane.spans, plane.regions);
    const auto a = one.channels().front().image().samples, b = other.channels().front().image().samples;
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << share;
  }
}

TEST(PlaneSampler, IsCancelled) {
  const auto solid = prepare_solid(make_box());
  PaintedPlane plane(solid, Vec3(1, 2, 3), 0.5, 64, kTolerance);
  PartPlanes planes(plane.layer, solid->summary());
  const LayerTarget target = plane.target(planes);
  plane.cancel = CancellationToken::make();
  plane.cancel.cancel();
  EXPECT_THROW(PlaneSampler(solid).paint(target, plane.spec, *plane.field, plane.spans, plane.regions), Error);
}

}  // namespace
}  // namespace ccslice
