// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/cell_block.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr std::size_t kNodes = std::tuple_size_v<BlockPoints>;

Vec3 parameter(const ParamBox& box, std::size_t node) {
  Vec3 uvw;
  for (int a = 0; a < 3; ++a) {
    const auto place = static_cast<double>(node / kBlockStride[static_cast<std::size_t>(a)] % kBlockNodes);
    uvw[a] = box.low[a] + place / (kBlockNodes - 1) * (box.high[a] - box.low[a]);
  }
  return uvw;
}

double at(const BlockValues& values, std::size_t slot) { return values[slot / kLanes][slot % kLanes]; }

void expect_samples(LimitEvaluator& evaluator, CellBlockSampler& sampler, LimitCellId cell, const ParamBox& box,
                    const std::string& where) {
  CellBlock block;
  sampler.sample(cell, box, block);
  std::vector<double> channels(evaluator.solid().channel_count());
  for (std::size_t node = 0; node < kNodes; ++node) {
    const CellParam param{cell, parameter(box, node)};
    const Vec3 position = evaluator.geo(param);
    evaluator.mat(param, channels);
    const std::size_t slot = block_slot(node);
    for (std::size_t a = 0; a < 3; ++a) {
      ASSERT_NEAR(at(block.position[a], slot), position[static_cast<Eigen::Index>(a)], 1e-11) << where << " " << node;
    }
    ASSERT_NEAR(at(block.values[0], slot), channels[1], 1e-12) << where << " " << node;
    ASSERT_NEAR(at(block.values[1], slot), channels[0], 1e-12) << where << " " << node;
  }
}

TEST(CellBlock, SamplesWhatTheEvaluatorFinds) {
  const ParamBox whole, inner{Vec3(0.1, 0.3, 0.55), Vec3(0.2, 0.45, 0.9)}, octant{Vec3(0.5, 0, 0), Vec3(1, 0.5, 0.5)},
      thin{Vec3(0, 0.25, 0.5), Vec3(1, 0.375, 0.5625)}, corner{Vec3(0.75, 0.75, 0.75), Vec3(1, 1, 1)};
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() < 2) continue;
    LimitEvaluator evaluator(*solid), other(*solid);
    CellBlockSampler sampler(evaluator, {1, 0});
    const std::uint32_t step = std::max(1u, solid->cell_count() / 6);
    for (LimitCellId cell; cell < solid->cell_count(); cell += step) {
      for (const ParamBox& box : {whole, inner, octant, thin, corner}) expect_samples(other, sampler, cell, box, name);
    }
  }
}

// Cells whose neighbourhoods are rare are sampled patch by patch, frequent ones by stencils.
TEST(CellBlock, SamplesByStencilsToo) {
  const auto solid = prepare_solid(make_bracket());
  const LimitSolid::Data& data = solid->data();
  const BlockStencils stencils(data);
  LimitEvaluator evaluator(*solid), other(*solid);
  const std::vector<std::uint32_t> channels(6, 0);
  CellBlockSampler sampler(evaluator, channels);
  std::map<CellClass, std::size_t> by_stencils;
  const ParamBox boxes[] = {{}, {Vec3(0, 0.5, 0.25), Vec3(0.25, 1, 0.75)}};
  for (LimitCellId cell; cell < solid->cell_count(); cell += 3) {
    for (const ParamBox& box : boxes) {
      if (solid->cell_class(cell) == CellClass::kRegular || !stencils.are_worth_it(data.cells[cell], box)) continue;
      ++by_stencils[solid->cell_class(cell)];
      CellBlock block;
      std::vector<double> expected(solid->channel_count());
      sampler.sample(cell, box, block);
      for (std::size_t node = 0; node < kNodes; ++node) {
        const Vec3 position = other.geo_and_mat({cell, parameter(box, node)}, expected);
        const std::size_t slot = block_slot(node);
        const Vec3 found = at_slot(block.position, slot);
        ASSERT_LT((found - position).norm(), 1e-10) << "cell " << cell << " node " << node;
        for (const BlockValues& values : block.values) ASSERT_NEAR(at(values, slot), expected[0], 1e-11);
      }
      sampler.sample_between_nodes(cell, box, block);
      for (std::size_t slot = 0; slot < kGroupsBetweenNodes * kLanes; ++slot) {
        const Vec3 share = at_slot(block_shares(BlockPlaces::kBetweenNodes), slot);
        const Vec3 uvw = box.low + share.cwiseProduct(box.high - box.low);
        const Vec3 position = other.geo_and_mat({cell, uvw}, expected);
        const Vec3 found = at_slot(block.position, slot);
        ASSERT_LT((found - position).norm(), 1e-10) << "cell " << cell << " slot " << slot;
        for (const BlockValues& values : block.values) ASSERT_NEAR(at(values, slot), expected[0], 1e-11);
      }
    }
  }
  EXPECT_GT(by_stencils[CellClass::kLine], 20u);
  EXPECT_GT(by_stencils[CellClass::kVertex], 20u);
}

/// A cell that is sampled by stencils as a whole.
LimitCellId frequent_cell(const LimitSolid& solid) {
  const BlockStencils stencils(solid.data());
  for (const LimitCellId c : solid.cells()) {
    const LimitCell& cell = solid.data().cells[c];
    if (cell.cell_class != CellClass::kRegular && stencils.are_worth_it(cell, {})) return c;
  }
  throw std::logic_error("all neighbourhoods are rare");
}

// Position and one channel come together, then four channels at a time.
TEST(CellBlock, SamplesManyChannels) {
  const std::vector<std::uint32_t> channels = {1, 0, 0, 1, 1, 0, 1, 0, 0, 1};
  const auto rare = prepare_solid(oracle::tiny_mesh("boundary_edge_4_hexes"));
  const auto frequent = prepare_solid(oracle::tiny_mesh("plate_4x4x1"));
  for (const auto& [solid, cell] : {std::pair(rare, LimitCellId{0}), std::pair(frequent, frequent_cell(*frequent))}) {
    ASSERT_GE(solid->channel_count(), 2u);
    for (const ParamBox& box : {ParamBox{}, ParamBox{Vec3(0.5, 0.5, 0.5), Vec3(0.75, 1, 0.5625)}}) {
      for (std::size_t count = 0; count <= channels.size(); ++count) {
        LimitEvaluator evaluator(*solid), other(*solid);
        CellBlock block;
        CellBlockSampler(evaluator, {channels.begin(), channels.begin() + static_cast<std::ptrdiff_t>(count)})
            .sample(cell, box, block);
        ASSERT_EQ(block.values.size(), count);
        std::vector<double> values(solid->channel_count());
        for (std::size_t node = 0; node < kNodes; ++node) {
          const Vec3 position = other.geo_and_mat({cell, parameter(box, node)}, values);
          EXPECT_NEAR(at(block.position[2], block_slot(node)), position.z(), 1e-11);
          for (std::size_t c = 0; c < count; ++c) {
            EXPECT_NEAR(at(block.values[c], block_slot(node)), values[channels[c]], 1e-12);
          }
        }
      }
    }
  }
}

/// Of all nodes.
std::vector<double> numbers_of(const CellBlock& block) {
  std::vector<double> numbers;
  for (std::size_t slot = 0; slot < kBlockSlots; ++slot) {
    for (const BlockValues& axis : block.position) numbers.push_back(at(axis, slot));
    for (const BlockValues& channel : block.values) numbers.push_back(at(channel, slot));
  }
  return numbers;
}

// Halves take nodes over from the box before, if it was sampled just before.
TEST(CellBlock, IsTheSameToTheBitWhateverWasSampledBefore) {
  const auto half_of = [](const ParamBox& box, unsigned axes, unsigned child) {
    ParamBox half = box;
    for (int a = 0; a < 3; ++a) {
      if (axes >> a & 1) (child >> a & 1 ? half.low : half.high)[a] = 0.5 * (box.low[a] + box.high[a]);
    }
    return half;
  };
  std::vector<oracle::TinyMesh> meshes = oracle::tiny_meshes();
  meshes.push_back({"bracket", make_bracket()});
  for (const auto& [name, mesh] : meshes) {
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() == 0) continue;
    LimitEvaluator evaluator(*solid), other(*solid);
    CellBlockSampler sampler(evaluator, {0});
    for (LimitCellId cell; cell < solid->cell_count(); cell += 1 + solid->cell_count() / 4) {
      ParamBox box;
      for (unsigned depth = 0; depth < 9; ++depth) {
        CellBlock block, alone;
        sampler.sample(cell, box, block);
        CellBlockSampler(other, {0}).sample(cell, box, alone);
        ASSERT_EQ(numbers_of(block), numbers_of(alone)) << name << " cell " << cell << " depth " << depth;
        const unsigned axes = 1 + depth * 5 % 7;
        for (const unsigned child : {7u, depth % 8}) {  // The last one is halved on.
          sampler.sample(cell, half_of(box, axes, child), block);
          CellBlockSampler(other, {0}).sample(cell, half_of(box, axes, child), alone);
          ASSERT_EQ(numbers_of(block), numbers_of(alone)) << name << " cell " << cell << " depth " << depth;
        }
        box = half_of(box, axes, depth % 8);
      }
    }
  }
}

// Places of an axis stand together: near both ends of the edges along it, nearer to them, and near the corners of the
// faces across it.
TEST(CellBlock, SamplesEdgesAndFacesBetweenNodes) {
  const ParamBox box{Vec3(0, 0.25, 0.5), Vec3(1, 0.75, 1)};
  const std::array<Vec3, 3> nearest_corner = {Vec3(3.0 / 32, 0, 0), Vec3(1.0 / 32, 0, 0), Vec3(0, 3.0 / 32, 3.0 / 32)};
  for (const char* name : {"boundary_edge_4_hexes", "edge_valence_5_layers_2"}) {
    const auto solid = prepare_solid(oracle::tiny_mesh(name));
    LimitEvaluator evaluator(*solid), other(*solid);
    CellBlockSampler sampler(evaluator, {0});
    CellBlock block;
    sampler.sample_between_nodes(LimitCellId{0}, box, block);
    std::vector<double> channels(solid->channel_count());
    for (int part = 0; part < 9; ++part) {
      for (int place = 0; place < 8; ++place) {
        Vec3 uvw;
        for (int a = 0; a < 3; ++a) {
          const double near = nearest_corner[static_cast<std::size_t>(part / 3)][a];
          const double share = place >> a & 1 ? 1 - near : near;
          const int turned = (part + a) % 3;
          uvw[turned] = box.low[turned] + share * (box.high[turned] - box.low[turned]);
        }
        const Vec3 position = other.geo_and_mat({LimitCellId{0}, uvw}, channels);
        bool found = false;
        for (std::size_t k = 0; k < 2 * kLanes; ++k) {
          const std::size_t slot = 2 * kLanes * static_cast<std::size_t>(part) + k;
          const Vec3 sampled = at_slot(block.position, slot);
          if ((sampled - position).norm() > 1e-11) continue;
          found = true;
          EXPECT_NEAR(at(block.values[0], slot), channels[0], 1e-12);
        }
        EXPECT_TRUE(found) << name << " at " << uvw.transpose();
      }
    }
  }
}

TEST(CellBlock, FillsSpareSlotsWithNodes) {
  const auto solid = prepare_solid(oracle::tiny_mesh("boundary_edge_4_hexes"));
  LimitEvaluator evaluator(*solid);
  CellBlockSampler sampler(evaluator, {0});
  CellBlock block;
  sampler.sample(LimitCellId{0}, {}, block);
  EXPECT_EQ(at(block.values[0], 63), at(block.values[0], block_slot(124)));
  EXPECT_EQ(at(block.values[0], 127), at(block.values[0], block_slot(123)));
}

}  // namespace
}  // namespace ccslice
