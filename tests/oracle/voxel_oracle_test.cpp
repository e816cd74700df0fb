// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whole layers, voxel by voxel: occupancy against the literal winding number, materials against the literal Algorithm
// 1, residuals against the voxel's own place, bytes against other ways of splitting the work.

#include <gtest/gtest.h>

#include <cmath>

#include "core/inversion/point_inverter.h"
#include "core/models/models.h"
#include "core/raster/occupancy.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/slicing.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kMicrometreMm = 1e-3;

void expect_occupancy_is_winding_number(const LayerView& view, const Layer& layer) {
  const std::vector<Polygon> polygons = polygons_of(layer.contours);
  std::uint64_t inside = 0;
  for (std::uint32_t y = 0; y < view.grid().extent.rows; ++y) {
    for (std::uint32_t x = 0; x < view.grid().extent.columns; ++x) {
      const Vec2 centre = view.centre(x, y).head<2>();
      inside += view.inside(x, y);
      if (view.inside(x, y) == (winding_number(polygons, centre) != 0)) continue;
      EXPECT_LE(distance_to(polygons, centre), kMicrometreMm) << "voxel " << x << " " << y;
    }
  }
  EXPECT_EQ(inside, layer.stats.voxels_inside);
}

class Voxels : public testing::TestWithParam<std::size_t> {};

TEST_P(Voxels, OccupancyIsTheWindingNumber) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const SliceJob job = float_job(subject, 97);
  LayerSlicer slicer(subject.shared_solid(), job);
  for (const double place : {0.03, 0.5, 0.8}) {
    const Layer layer = slicer.slice(static_cast<std::uint32_t>(place * job.grid.extent.layers), {});
    expect_occupancy_is_winding_number(LayerView(job, layer), layer);
  }
}

TEST_P(Voxels, EveryVoxelTakesItsMaterialFromItsOwnPlace) {
  ControlMesh mesh = tiny_meshes()[GetParam()].mesh;
  mesh.channel_names.clear();
  grade_by_coordinates(mesh);
  const Subject subject(mesh);
  const SliceJob job = float_job(subject, 61);
  LayerSlicer slicer(subject.shared_solid(), job);
  for (std::uint32_t k = 0; k < job.grid.extent.layers; k += 1 + job.grid.extent.layers / 8) {
    const Layer layer = slicer.slice(k, {});
    const LayerView view(job, layer);
    EXPECT_EQ(layer.stats.voxels_unresolved, 0u) << "layer " << k;
    EXPECT_EQ(layer.stats.voxels_coherent + layer.stats.voxels_full, layer.stats.voxels_inside);
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
        if (!view.inside(x, y)) {
          ASSERT_EQ(place, Vec3::Zero());
        } else {
          ASSERT_LT((place - view.centre(x, y)).norm(), 1e-3 + job.contour_tolerance_mm) << x << " " << y << " " << k;
        }
      }
    }
  }
}

TEST_P(Voxels, SameBytesHoweverTheRangeIsSplit) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  SliceJob job = float_job(subject, 25);
  job.channel_tolerance.reset();
  std::vector<std::vector<std::uint8_t>> bytes;
  LayerSlicer upwards(subject.shared_solid(), job);
  const std::uint32_t layers = std::min(job.grid.extent.layers, kSlabLayers + 3);
  for (std::uint32_t k = 0; k < layers; ++k) {
    for (const EncodedPlane& plane : upwards.slice(k, {}).planes) bytes.push_back(plane.bytes);
  }
  LayerSlicer downwards = upwards.twin();
  for (std::uint32_t k = layers; k-- > 0;) {
    LayerSlicer alone(subject.shared_solid(), job);
    const Layer once = downwards.slice(k, {}), again = alone.slice(k, {});
    for (std::size_t p = 0; p < job.planes.size(); ++p) {
      EXPECT_TRUE(bytes[k * job.planes.size() + p] == once.planes[p].bytes)
          << "downwards, layer " << k << " plane " << p;
      EXPECT_TRUE(bytes[k * job.planes.size() + p] == again.planes[p].bytes) << "alone, layer " << k << " plane " << p;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Voxels, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

class Materials : public testing::TestWithParam<std::string> {};

TEST_P(Materials, AgreeWithAlgorithm1) {
  const Subject subject(tiny_mesh(GetParam()));
  ASSERT_EQ(subject.solid().summary().folding_cells, 0u);
  LimitSolidForAlgorithm1 solid(subject.solid(), brute_force_boxes(subject));
  const SliceJob job = float_job(subject, 50);
  LayerSlicer slicer(subject.shared_solid(), job);
  for (const double place : {0.25, 0.6}) {
    const Layer layer = slicer.slice(static_cast<std::uint32_t>(place * job.grid.extent.layers), {});
    const Algorithm1Comparison result = compare_with_algorithm1(subject, solid, LayerView(job, layer));
    EXPECT_LT(result.worst, 1e-4);
    EXPECT_GT(result.compared, 9 * result.not_found);
    EXPECT_GT(result.compared, 100u);
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Materials,
                         testing::Values("single_hex", "box_3", "edge_valence_3_inside", "edge_valence_5_inside",
                                         "vertex_link_icosahedron", "vertex_link_capped_octahedron", "concave_corner",
                                         "cross_of_seven", "sharp_box", "sharp_3_hexes", "hex_wedge_tet",
                                         "cube_of_tets"),
                         [](const auto& info) { return info.param; });

/// Rotated, mirrored and sheared.
std::vector<Placement> oblique_placements() {
  std::vector<Placement> placements(3, Placement::Identity());
  placements[0].rotate(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())).pretranslate(Vec3(100, -50, 3));
  placements[1].scale(Vec3(-1, 1, 1)).rotate(Eigen::AngleAxisd(1.9, Vec3::UnitX()));
  placements[2].linear() << 1.2, 0.4, 0, -0.1, 0.8, 0.3, 0, 0.2, 0.9;
  return placements;
}

class PlacedVoxels : public testing::TestWithParam<std::string> {};

TEST_P(PlacedVoxels, AreThePlacedPart) {
  ControlMesh mesh = tiny_mesh(GetParam());
  mesh.channel_names.clear();
  grade_by_coordinates(mesh);
  const Subject subject(mesh);
  PointInverter inverter(subject.solid());
  for (const Placement& placement : oblique_placements()) {
    SliceJob job = float_job(subject, 40);
    GridRequest request;
    request.pitch = {0.7, 0.9, 0.8};
    job.placement = placement;
    job.grid = plan_grid(subject.solid(), placement, request);
    LayerSlicer slicer(subject.shared_solid(), job);
    const Placement to_mesh = placement.inverse();
    std::size_t voxels = 0;
    for (std::uint32_t k = 0; k < job.grid.extent.layers; k += 5) {
      const Layer layer = slicer.slice(k, {});
      const LayerView view(job, layer);
      const std::vector<Polygon> polygons = polygons_of(layer.contours);
      for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
        for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
          const Vec3 centre = view.centre(x, y);
          const bool near_contour = distance_to(polygons, centre.head<2>()) < 0.01;
          if (!near_contour) {
            ASSERT_EQ(view.inside(x, y), inverter.invert(to_mesh * centre).has_value()) << centre.transpose();
          }
          if (!view.inside(x, y)) continue;
          ++voxels;
          const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
          ASSERT_LT((placement * place - centre).norm(), 1e-3 + job.contour_tolerance_mm) << x << " " << y << " " << k;
        }
      }
    }
    EXPECT_GT(voxels, 200u);
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, PlacedVoxels,
                         testing::Values("box_2", "edge_valence_5_layers_2", "vertex_link_capped_octahedron",
                                         "concave_corner", "sharp_box", "hex_wedge_tet", "hollow_cube"),
                         [](const auto& info) { return info.param; });

TEST(LinearGradient, OnABoxIsReproduced) {
  const BoxShape shape;
  const Subject subject(make_box(shape));
  const SliceJob job = float_job(subject, VoxelPitch{0.11, 0.13, 0.5});
  LayerSlicer slicer(subject.shared_solid(), job);
  for (std::uint32_t k = 0; k < job.grid.extent.layers; ++k) {
    const Layer layer = slicer.slice(k, {});
    const LayerView view(job, layer);
    EXPECT_EQ(layer.stats.voxels_inside, std::uint64_t{job.grid.extent.columns} * job.grid.extent.rows);
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        ASSERT_NEAR(view.channel(0, x, y), view.centre(x, y).x() / shape.size_mm.x(), 1e-6) << x << " " << y;
      }
    }
  }
}

TEST(RingLayer, ResolvesEveryVoxelOfTheSampleAtItsOwnPitch) {
  ControlMesh ring = make_ring();
  ring.channel_names.clear();
  grade_by_coordinates(ring);
  const Subject subject(ring);
  const SliceJob job = float_job(subject, VoxelPitch{0.0846, 0.1692, 0.03});
  LayerSlicer slicer(subject.shared_solid(), job);
  const Layer layer = slicer.slice(job.grid.extent.layers / 3, {});
  EXPECT_EQ(layer.stats.voxels_unresolved, 0u);
  EXPECT_GT(layer.stats.voxels_inside, 200'000u);
  const LayerView view(job, layer);
  for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
    for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
      if (!view.inside(x, y)) continue;
      const Vec3 place(view.channel(0, x, y), view.channel(1, x, y), view.channel(2, x, y));
      ASSERT_LT((place - view.centre(x, y)).norm(), 1e-3 + job.contour_tolerance_mm) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace ccslice::oracle
