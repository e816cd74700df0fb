// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The samples after [Luu19, Fig. 7 and Table 2].

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "core/job/grid.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/cell_complex.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "core/subdivision/refine.h"
#include "core/subdivision/refine_rules.h"

namespace ccslice {
namespace {

struct Sample {
  const char* name;
  // As in the table.
  std::array<std::size_t, 3> cells;  // Hexahedra, tetrahedra, wedges.
  std::array<std::uint32_t, 3> grid;
  double voxels_inside;
  // The mesh M, after so many refinements: ours, and the table's for comparison.
  int refinements;
  std::size_t refined_cells, edges, vertices;
  const char* table;
  int layer_step;  // For measuring: every so manyth layer of 0.3 mm.
};

void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

constexpr std::array<Sample, 4> kSamples = {
    {{"coyote", {35, 2, 11}, {1494, 991, 738}, 218.87e6, 2, 2832, 60, 2, "177 / 8", 3},
     {"engine", {301, 0, 0}, {1090, 547, 688}, 138.31e6, 2, 19264, 456, 8, "360 / 8", 3},
     {"bracket", {163, 0, 0}, {3397, 478, 142}, 57.12e6, 1, 1304, 72, 8, "76 / 7", 1},
     {"grid", {1000, 0, 0}, {1335, 357, 866}, 156.01e6, 1, 8000, 4160, 832, "5040 / 1539", 8}}};

ControlMesh make(const Sample& sample) { return find_sample_model(sample.name)->make(); }

CellComplex refined(const Sample& sample) {
  CellComplex complex = make_cell_complex(make(sample));
  for (int i = 0; i < sample.refinements; ++i) {
    const std::vector<CellId> all = complex.cells().to_vector();
    complex = refine(complex, all).complex;
  }
  return complex;
}

std::size_t count_extraordinary_edges(const CellComplex& complex) {
  std::size_t count = 0;
  for (const EdgeId e : complex.edges()) {
    count += !complex.edge_on_boundary(e) && complex.edge_cells(e).size() != 4;
  }
  return count;
}

std::size_t count_extraordinary_vertices(const CellComplex& complex) {
  std::size_t count = 0;
  for (const VertexId v : complex.vertices()) {
    if (complex.vertex_on_boundary(v) || on_straight_extraordinary_edge(complex, v)) continue;
    const auto edges = complex.vertex_edges(v);
    count += std::any_of(edges.begin(), edges.end(), [&](auto e) { return complex.edge_cells(e).size() != 4; });
  }
  return count;
}

class SampleModels : public testing::TestWithParam<Sample> {};

TEST_P(SampleModels, HaveTheCellsOfTheTable) {
  const ControlMesh mesh = make(GetParam());
  std::array<std::size_t, 3> cells{};
  for (const CellKind kind : mesh.cell_kinds) ++cells[static_cast<std::size_t>(kind)];
  EXPECT_EQ(cells, GetParam().cells);
}

Grid grid_of(const LimitSolid& solid, const VoxelPitch& pitch) {
  GridRequest request;
  request.pitch = pitch;
  return plan_grid(solid, Placement::Identity(), request);
}

TEST_P(SampleModels, HaveTheBitmapsAndLayersOfTheTable) {
  const auto solid = prepare_solid(make(GetParam()));
  const Grid grid = grid_of(*solid, {0.0423, 0.0846, 0.03});
  EXPECT_EQ((std::array{grid.extent.columns, grid.extent.rows, grid.extent.layers}), GetParam().grid);
  EXPECT_LT(solid->summary().bounding_box.min().norm(), 1e-4) << "a corner of its box is the origin";
}

TEST_P(SampleModels, HaveTheVoxelsInsideOfTheTableWithinAFifth) {
  const auto solid = prepare_solid(make(GetParam()));
  SliceJob job;
  const double pitch = 0.3;
  job.grid = grid_of(*solid, {pitch, pitch, pitch});
  job.planes.resize(1);
  job.planes[0].encoding = Encoding::kRaw;
  LayerSlicer slicer(solid, job);
  double sum = 0, layers = 0;
  for (std::uint32_t layer = 0; layer < job.grid.extent.layers;
       layer += static_cast<std::uint32_t>(GetParam().layer_step)) {
    sum += static_cast<double>(slicer.slice(layer, {}).stats.voxels_inside);
    ++layers;
  }
  const double volume_mm3 = sum / layers * job.grid.extent.layers * std::pow(pitch, 3);
  const double voxels = volume_mm3 / (0.0423 * 0.0846 * 0.03);
  RecordProperty("voxels_inside", std::to_string(voxels));
  EXPECT_NEAR(voxels / GetParam().voxels_inside, 1, 0.2);
}

TEST_P(SampleModels, AreAsIrregularAsTheTable) {
  const Sample& sample = GetParam();
  const CellComplex complex = refined(sample);
  EXPECT_EQ(complex.cell_count(), sample.refined_cells);
  EXPECT_EQ(count_extraordinary_edges(complex), sample.edges) << "the table has " << sample.table;
  EXPECT_EQ(count_extraordinary_vertices(complex), sample.vertices) << "the table has " << sample.table;
}

TEST_P(SampleModels, HaveSmoothIrregularBoundaryEdgesOnly) {
  const auto solid = prepare_solid(make(GetParam()));
  EXPECT_GT(solid->summary().irregular_boundary_edges, 100u);
  EXPECT_EQ(solid->summary().sharp_edges, 0u);
}

/// Moves every control point by up to `share` of its shortest edge.
void jitter(ControlMesh& mesh, double share, std::mt19937& random) {
  const CellComplex complex = make_cell_complex(mesh);
  std::uniform_real_distribution<double> offset(-1, 1);
  const std::vector<Vec3> before = mesh.positions;
  for (const VertexId v : complex.vertices()) {
    double shortest = 1e9;
    for (const EdgeId e : complex.vertex_edges(v)) {
      shortest = std::min(shortest, (before[complex.edge_other(e, v)] - before[v]).norm());
    }
    mesh.positions[v] += share * shortest * Vec3(offset(random), offset(random), offset(random)) / std::sqrt(3.0);
  }
}

TEST_P(SampleModels, DoNotFoldEvenWhenTheirControlPointsAreMovedALittle) {
  ControlMesh mesh = make(GetParam());
  EXPECT_EQ(prepare_solid(mesh)->summary().folding_cells, 0u);
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  jitter(mesh, 0.1, random);
  EXPECT_EQ(prepare_solid(mesh)->summary().folding_cells, 0u) << "seed " << kSeed;
}

TEST_P(SampleModels, HaveOneChannelThatUsesItsRange) {
  const ControlMesh mesh = make(GetParam());
  ASSERT_EQ(mesh.channel_count(), 1u);
  const auto [low, high] = std::minmax_element(mesh.channel_values.begin(), mesh.channel_values.end());
  EXPECT_GE(*low, 0);
  EXPECT_LE(*low, 0.2f);
  EXPECT_GE(*high, 0.9f);
  EXPECT_LE(*high, 1);
}

TEST_P(SampleModels, AreTheSameEachTime) {
  const ControlMesh a = make(GetParam()), b = make(GetParam());
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.channel_values, b.channel_values);
  EXPECT_EQ(a.cell_vertices, b.cell_vertices);
}

INSTANTIATE_TEST_SUITE_P(Table2, SampleModels, testing::ValuesIn(kSamples),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(Engine, HasHardLinersRoundSixBores) {
  const ControlMesh mesh = make_engine();
  constexpr int kBores = 6, kLevels = 8, kRing = 4, kShaft = 12;
  EXPECT_EQ(std::count(mesh.channel_values.begin(), mesh.channel_values.end(), 1.0f),
            kBores * kLevels * kRing + kShaft);
  EXPECT_EQ(std::count(mesh.channel_values.begin(), mesh.channel_values.end(), 0.2f), 6 * 6 * kLevels);
}

}  // namespace
}  // namespace ccslice
