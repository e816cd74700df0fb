// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/paint_guard.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <set>
#include <span>
#include <vector>

#include "core/interpolation/slab_materials.h"
#include "core/job/slice_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

constexpr double kOff = 0.125;

/// The real one, but for a channel that is off: no polynomial agrees with it.
class ShiftedField final : public MaterialField {
 public:
  explicit ShiftedField(std::unique_ptr<MaterialField> field) : field_(std::move(field)) {}
  std::optional<InversionResult> invert(const Vec3& world, const std::optional<CellParam>& hint) override {
    return field_->invert(world, hint);
  }
  std::optional<InversionResult> nearest(const Vec3& world) override { return field_->nearest(world); }
  void mat(const CellParam& at, std::span<double> out) override {
    field_->mat(at, out);
    out[0] += kOff;
  }
  bool is_ambiguous(const Box3& world) const override { return field_->is_ambiguous(world); }
  std::size_t channel_count() const override { return field_->channel_count(); }

 private:
  std::unique_ptr<MaterialField> field_;
};

class PaintGuardTest : public testing::Test {
 protected:
  PaintGuardTest()
      : solid_(prepare_solid(make_box())),
        job_(job_of(solid_, {0.15, 0.15, 0.15})),
        spec_{job_.placement, job_.grid, {{0, 1e-3}}, 2e-3},
        field_(make_material_field(solid_, job_.placement, 2e-3)) {}

  std::set<std::uint32_t> chosen(std::uint32_t layer, const VoxelRun& run) {
    PaintGuard guard(*field_, spec_);
    const std::span<const std::uint32_t> columns = guard.chosen(layer, run);
    return {columns.begin(), columns.end()};
  }

  Solid solid_;
  SliceJob job_;
  InterpolationSpec spec_;
  std::unique_ptr<MaterialField> field_;
};

TEST_F(PaintGuardTest, ChoosesAboutAsManyVoxelsAsItSays) {
  std::size_t columns = 0, ends = 0;
  constexpr std::uint32_t kRows = 2000, kColumns = 40'000, kRuns = 100'000;
  for (std::uint32_t row = 0; row < kRows; ++row) columns += chosen(row % 7, {row, 3, 3 + kColumns}).size();
  const double expected = double{kRows} * kColumns / PaintGuard::kVoxelsApart + 2.0 * kRows / PaintGuard::kRunsApart;
  EXPECT_NEAR(static_cast<double>(columns), expected, 0.05 * expected);
  for (std::uint32_t run = 0; run < kRuns; ++run) {
    const std::set<std::uint32_t> of_run = chosen(5, {run / 50, run % 50 * 20, run % 50 * 20 + 10});
    ends += of_run.contains(run % 50 * 20) + of_run.contains(run % 50 * 20 + 9);
  }
  EXPECT_NEAR(static_cast<double>(ends), 2.0 * kRuns / PaintGuard::kRunsApart, 50);
}

TEST_F(PaintGuardTest, ChoosesVoxelsInAboutAsManyGapsAsItSays) {
  PaintGuard guard(*field_, spec_);
  constexpr std::uint32_t kGaps = 200'000;
  std::size_t found = 0, columns = 0;
  for (std::uint32_t gap = 0; gap < kGaps; ++gap) {
    const VoxelRun run{gap / 100, gap % 100 * 20, gap % 100 * 20 + 4};
    const std::optional<std::uint32_t> column = guard.chosen_in_gap(gap / 50'000, run);
    if (!column) continue;
    ++found;
    columns += *column - run.begin;
    EXPECT_LT(*column, run.end);
    EXPECT_GE(*column, run.begin);
    EXPECT_EQ(PaintGuard(*field_, spec_).chosen_in_gap(gap / 50'000, run), column) << "alone";
  }
  const double expected = double{kGaps} / PaintGuard::kGapsApart;
  EXPECT_NEAR(static_cast<double>(found), expected, 0.1 * expected);
  EXPECT_NEAR(static_cast<double>(columns), 1.5 * expected, 0.15 * expected);
}

// A row that is cut in two has the same voxels between its ends compared.
TEST_F(PaintGuardTest, ChoosesVoxelsByTheirAbsoluteIndices) {
  for (std::uint32_t row = 0; row < 200; ++row) {
    std::set<std::uint32_t> whole = chosen(9, {row, 0, 60'000}), parts = chosen(9, {row, 0, 25'001});
    const std::set<std::uint32_t> rest = chosen(9, {row, 25'001, 60'000});
    parts.insert(rest.begin(), rest.end());
    for (const std::uint32_t end : {0u, 25'000u, 25'001u, 59'999u}) {
      whole.erase(end);
      parts.erase(end);
    }
    EXPECT_EQ(whole, parts);
  }
}

// Runs that come one after the other are chosen from as each would be alone.
TEST_F(PaintGuardTest, ChoosesAlikeInAnyOrder) {
  PaintGuard guard(*field_, spec_);
  std::mt19937 random(20'261);
  std::uniform_int_distribution<std::uint32_t> any_row(0, 2), any_column(0, 60'000), any_length(1, 2000);
  std::size_t found = 0;
  for (int n = 0; n < 20'000; ++n) {
    const std::uint32_t layer = any_row(random), begin = any_column(random);
    VoxelRun run{any_row(random), begin, begin + any_length(random)};
    for (int part = 0; part < 3; ++part) {
      const std::span<const std::uint32_t> columns = guard.chosen(layer, run);
      EXPECT_EQ(std::set(columns.begin(), columns.end()), chosen(layer, run));
      found += columns.size();
      run = {run.row, run.end, run.end + any_length(random)};
    }
  }
  EXPECT_GT(found, 1000);
}

TEST_F(PaintGuardTest, AgreesWithWhatInversionFinds) {
  PaintGuard guard(*field_, spec_);
  const Vec3 first = job_.grid.lattice().centre(0, 0, job_.grid.layer_z_mm(0));
  std::vector<double> low(field_->channel_count()), high(low);
  field_->mat(field_->invert(first, {})->at, low);
  field_->mat(field_->invert(first + Vec3(0.15 * 50, 0, 0), {})->at, high);
  CubicPolynomial linear{};  // The box's channel is linear along x.
  linear[0] = low[0];
  linear[10] = (high[0] - low[0]) / 50;
  EXPECT_TRUE(guard.agrees(3, 20, 70, {}, {&linear, 1}, {}));
  linear[0] += 0.9e-3;
  EXPECT_TRUE(guard.agrees(3, 20, 70, {}, {&linear, 1}, {}));
  linear[0] += 0.2e-3;
  EXPECT_FALSE(guard.agrees(3, 20, 70, {}, {&linear, 1}, {}));
  linear[0] = std::nan("");
  EXPECT_FALSE(guard.agrees(3, 20, 70, {}, {&linear, 1}, {}));
}

// 160 x 107 voxels a layer: one or two of them are chosen.
TEST_F(PaintGuardTest, BlocksOfRowsWithAMissAreInverted) {
  ShiftedField shifted(make_material_field(solid_, job_.placement, 2e-3));
  SlabMaterials slab(solid_, shifted, spec_);
  const LayerLattice lattice = job_.grid.lattice();
  std::vector<VoxelRun> spans;
  for (std::uint32_t y = 0; y < lattice.height; ++y) spans.push_back({y, 0, lattice.width});
  std::uint64_t repainted = 0, inside = 0;
  slab.start(0, kSlabLayers);
  for (std::uint32_t layer = 0; layer < kSlabLayers; ++layer) {
    PlaneSpec plane_spec;
    plane_spec.content = PlaneContent::kChannel;
    plane_spec.sample_type = SampleType::kFloat32;
    ContonePlane plane(plane_spec, solid_->summary().channels[0], 0);
    plane.clear(lattice.width, lattice.height);
    LayerStats stats;
    const CancellationToken never;
    const LayerWindow all = window_of(lattice);
    const LayerTarget target{lattice, job_.grid.layer_z_mm(layer), {&plane, 1}, stats, never, all, all};
    ASSERT_EQ(slab.paint(target, layer, [&](std::uint32_t) { return std::span<const VoxelRun>(spans); }),
              WindowOutcome::kComplete);
    inside += std::uint64_t{lattice.width} * lattice.height;
    repainted += stats.voxels_repainted;
    EXPECT_EQ(stats.voxels_interpolated + stats.voxels_repainted, std::uint64_t{lattice.width} * lattice.height);
    std::uint64_t shifted_voxels = 0;
    std::vector<double> expected(field_->channel_count());
    for (std::uint32_t y = 0; y < lattice.height; y += 5) {
      field_->mat(field_->invert(lattice.centre(60, y, target.z_mm), {})->at, expected);
      float value;
      std::memcpy(&value, &plane.image().samples[4 * (std::size_t{lattice.width} * y + 60)], sizeof value);
      const bool is_shifted = std::abs(value - expected[0] - kOff) < 1e-3;
      EXPECT_TRUE(is_shifted || std::abs(value - expected[0]) < 1e-3) << layer << " " << y;
      shifted_voxels += is_shifted;
    }
    EXPECT_EQ(shifted_voxels > 0, stats.voxels_repainted > 0);
  }
  EXPECT_GT(repainted, inside / 10);
  EXPECT_LT(repainted, inside);
}

}  // namespace
}  // namespace ccslice
