// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer depends on its job and its absolute index only: the same bytes for any number of threads, any split of a
// range and whatever a worker did before.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/slice_range.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

void expect_same_layer(const Layer& a, const Layer& b) {
  ASSERT_EQ(a.index, b.index);
  EXPECT_EQ(a.z_mm, b.z_mm);
  EXPECT_EQ(a.stats.voxels_inside, b.stats.voxels_inside);
  EXPECT_EQ(a.stats.voxels_coherent, b.stats.voxels_coherent);
  EXPECT_EQ(a.stats.voxels_full, b.stats.voxels_full);
  EXPECT_EQ(a.stats.voxels_interpolated, b.stats.voxels_interpolated);
  EXPECT_EQ(a.stats.voxels_unresolved, b.stats.voxels_unresolved);
  EXPECT_EQ(a.stats.max_residual_mm, b.stats.max_residual_mm);
  EXPECT_EQ(a.stats.contour_loops, b.stats.contour_loops);
  EXPECT_EQ(a.stats.contour_points, b.stats.contour_points);
  ASSERT_EQ(a.planes.size(), b.planes.size());
  for (std::size_t i = 0; i < a.planes.size(); ++i) {
    EXPECT_EQ(a.planes[i].crc32, b.planes[i].crc32);
    EXPECT_TRUE(a.planes[i].bytes == b.planes[i].bytes) << "layer " << a.index << ", plane " << i;
  }
}

std::vector<Layer> slice_all(const Solid& solid, const SliceJob& job, int threads) {
  std::vector<Layer> layers;
  SliceRangeOptions options;
  options.threads = threads;
  const auto keep = [&](Layer&& layer) { layers.push_back(std::move(layer)); };
  slice_range(solid, job, 0, job.grid.extent.layers, keep, options);
  return layers;
}

// The ring has regular cells only; a box without sharp edges is irregular all along its edges.
struct Part {
  const char* name;
  ControlMesh (*make)();
  double tilt_rad;
  VoxelPitch pitch;
};

ControlMesh make_ring_of_table_2() { return make_ring(); }

ControlMesh make_smooth_box() {
  ControlMesh mesh = make_box();
  mesh.sharp_edges.clear();
  mesh.sharp_vertices.clear();
  return mesh;
}

// Two smooth boxes without a common vertex that run through each other.
ControlMesh make_crossing_boxes() {
  ControlMesh mesh = make_smooth_box();
  ControlMesh other = mesh;
  for (Vec3& p : other.positions) p = Vec3(20 - p.y(), p.x() - 5, p.z() + 3);
  for (float& value : other.channel_values) value = 1 - value;
  oracle::append_mesh(mesh, other, Vec3::Zero());
  return mesh;
}

class SlicePart : public testing::TestWithParam<Part> {
 protected:
  SlicePart() : solid_(prepare_solid(GetParam().make())) {
    Placement placement = Placement::Identity();
    placement.rotate(Eigen::AngleAxisd(GetParam().tilt_rad, Vec3(1, 2, -0.3).normalized()));
    job_ = job_of(solid_, GetParam().pitch, placement);
    job_.planes = {occupancy(), channel(solid_, 0, SampleType::kUint16, Encoding::kRawZstd),
                   channel(solid_, 0, SampleType::kFloat32)};
    whole_ = slice_all(solid_, job_, 1);
  }

  Solid solid_;
  SliceJob job_;
  std::vector<Layer> whole_;
};

TEST_P(SlicePart, IsResolvedEverywhere) {
  for (const Layer& layer : whole_) {
    EXPECT_EQ(layer.stats.voxels_unresolved, 0u);
    EXPECT_EQ(layer.stats.voxels_interpolated + layer.stats.voxels_coherent + layer.stats.voxels_full,
              layer.stats.voxels_inside);
    EXPECT_LE(layer.stats.max_residual_mm, 1e-3 + job_.contour_tolerance_mm);
  }
}

TEST_P(SlicePart, GivesTheSameBytesOnAnyNumberOfThreads) {
  ASSERT_EQ(whole_.size(), job_.grid.extent.layers);
  for (const int threads : {2, 5}) {
    const std::vector<Layer> parallel = slice_all(solid_, job_, threads);
    ASSERT_EQ(parallel.size(), whole_.size());
    for (std::size_t i = 0; i < whole_.size(); ++i) expect_same_layer(parallel[i], whole_[i]);
  }
}

TEST_P(SlicePart, GivesTheSameBytesForSplitsAtEveryLayer) {
  ASSERT_GT(whole_.size(), 2 * kSlabLayers);
  for (std::uint32_t split = 1; split < 2 * kSlabLayers; ++split) {
    for (const auto& [first, count] : {std::pair{split - 1, 1u}, std::pair{split, 2u}}) {
      std::uint32_t next = first;
      slice_range(solid_, job_, first, count, [&](Layer&& layer) { expect_same_layer(layer, whole_[next++]); });
      EXPECT_EQ(next, first + count);
    }
  }
}

TEST_P(SlicePart, GivesTheSameBytesInAnyOrderOfLayers) {
  LayerSlicer slicer(solid_, job_);
  LayerSlicer twin = slicer.twin();
  for (std::uint32_t k = 12; k-- > 0;) {
    expect_same_layer(slicer.slice(k, {}), whole_[k]);
    expect_same_layer(twin.slice(11 - k, {}), whole_[11 - k]);
  }
}

TEST_P(SlicePart, ASlicerIsAsGoodAsNewAfterACancel) {
  LayerSlicer slicer(solid_, job_);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(slicer.slice(5, cancel), Error);
  expect_same_layer(slicer.slice(5, {}), whole_[5]);
}

std::string name_of(const testing::TestParamInfo<Part>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Parts, SlicePart,
                         testing::Values(Part{"Ring", make_ring_of_table_2, 0, {1.6, 1.3, 0.5}},
                                         Part{"CrossingBoxes", make_crossing_boxes, 0.2, {0.5, 0.4, 0.35}},
                                         Part{"SmoothBox", make_smooth_box, 0, {0.5, 0.4, 0.2}},
                                         Part{"TiltedSmoothBox", make_smooth_box, 0.6, {0.5, 0.4, 0.4}}),
                         name_of);

// Layers that lie beside small cells, but more than a layer from them: a new worker, which looks at them alone, against
// one that looks at the slab. (Voxels are far flatter than wide here.)
TEST(SameBytes, WhateverAWorkerSlicedBefore) {
  struct Case {
    ControlMesh (*make)();
    VoxelPitch pitch;
    std::vector<std::uint32_t> layers;
  };
  for (const auto& [make, pitch, layers] : {Case{[] { return make_grid(); }, {0.3, 0.3, 0.05}, {396, 397, 398, 399}},
                                            Case{[] { return make_bracket(); }, {0.0846, 0.1692, 0.06}, {53, 54}}}) {
    const Solid solid = prepare_solid(make());
    SliceJob job = job_of(solid, pitch);
    LayerSlicer experienced(solid, job);
    for (const std::uint32_t layer : {0u, kSlabLayers, layers[0] - layers[0] % kSlabLayers}) {
      experienced.slice(layer, {});
    }
    for (const std::uint32_t layer : layers) {
      expect_same_layer(LayerSlicer(solid, job).slice(layer, {}), experienced.slice(layer, {}));
    }
  }
}

}  // namespace
}  // namespace ccslice
