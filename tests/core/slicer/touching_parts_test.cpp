// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes that touched themselves and were split, against their sides as meshes of their own.

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "core/mesh_import/split_touching.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// All edges and corners of the cells, which are voxels: their limit is what they are.
void keep_sharp(ControlMesh& mesh) {
  std::set<std::array<std::uint32_t, 2>> edges;
  for (std::size_t begin = 0; begin < mesh.cell_vertices.size(); begin += 8) {
    for (const auto& [i, j] : cell_tables::kHexEdges) {
      const std::uint32_t a = mesh.cell_vertices[begin + vtk_to_bits(i)];
      const std::uint32_t b = mesh.cell_vertices[begin + vtk_to_bits(j)];
      edges.insert({std::min(a, b), std::max(a, b)});
    }
  }
  mesh.sharp_edges.assign(edges.begin(), edges.end());
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) mesh.sharp_vertices.push_back(v);
}

ControlMesh cell_of(const ControlMesh& mesh, std::size_t cell) {
  ControlMesh alone;
  alone.cell_kinds = {CellKind::kHex};
  for (std::size_t i = 0; i < 8; ++i) {
    alone.positions.push_back(mesh.positions[mesh.cell_vertices[8 * cell + i]]);
    alone.cell_vertices.push_back(static_cast<std::uint32_t>(i));
  }
  keep_sharp(alone);
  return alone;
}

/// Slices the split mesh, and each of its two cells alone, on one grid whose voxels have their centres at whole mm: in
/// layers, rows and columns through the common edge, too.
void expect_union(ControlMesh mesh) {
  FileNumbers numbers;
  ASSERT_EQ(split_touching(mesh, numbers).new_vertices, 2u);
  keep_sharp(mesh);
  std::vector<Solid> solids = {prepare_solid(mesh), prepare_solid(cell_of(mesh, 0)), prepare_solid(cell_of(mesh, 1))};
  GridRequest request;
  request.pitch = {.x_mm = 1, .y_mm = 1, .z_mm = 1};
  request.origin_mm = Vec3(-2.5, -2.5, -2.5);
  request.extent = GridExtent{.columns = 25, .rows = 25, .layers = 25};
  std::size_t inside = 0;
  for (std::uint32_t layer = 0; layer < 25; ++layer) {
    std::vector<std::vector<std::uint8_t>> bytes;
    for (const Solid& solid : solids) {
      SliceJob job;
      job.grid = plan_grid(*solid, job.placement, request);
      job.planes = {occupancy()};
      LayerSlicer slicer(solid, job);
      const Layer sliced = slicer.slice(layer, {});
      bytes.emplace_back(sliced.planes[0].bytes.begin(), sliced.planes[0].bytes.end());
    }
    for (std::size_t i = 0; i < bytes[0].size(); ++i) {
      EXPECT_EQ(bytes[0][i], bytes[1][i] | bytes[2][i]) << "layer " << layer;
      EXPECT_EQ(bytes[1][i] & bytes[2][i], 0) << "layer " << layer;
      inside += static_cast<std::size_t>(__builtin_popcount(bytes[0][i]));
    }
  }
  EXPECT_EQ(inside, 2000u) << "each side has 10 voxels across, lower faces among them, and upper ones not";
}

TEST(TouchingParts, HaveTheVoxelsOfBothWhereTheyTouchInAnEdgeAcrossLayers) {
  expect_union(oracle::box_mesh(2, 2, 1, 10, [](int x, int y, int) { return x == y; }));
  expect_union(oracle::box_mesh(2, 2, 1, 10, [](int x, int y, int) { return x != y; }));
}

TEST(TouchingParts, HaveTheVoxelsOfBothWhereALayerRunsThroughTheEdge) {
  expect_union(oracle::box_mesh(1, 2, 2, 10, [](int, int y, int z) { return y == z; }));
  expect_union(oracle::box_mesh(1, 2, 2, 10, [](int, int y, int z) { return y != z; }));
  expect_union(oracle::box_mesh(2, 1, 2, 10, [](int x, int, int z) { return x == z; }));
}

}  // namespace
}  // namespace ccslice
