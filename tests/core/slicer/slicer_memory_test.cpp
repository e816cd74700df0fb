// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slicer_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/allocation_count.h"
#include "tests/support/channel_functions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

struct NamedJob {
  std::string name;
  SliceJob job;
};

VoxelPitch pitch_for(const Solid& solid, double columns) {
  const double length = solid->summary().bounding_box.sizes().x() / columns;
  return {length, length, length};
}

/// Jobs that differ in what slicers hold.
std::vector<NamedJob> jobs_of(const Solid& solid, double columns) {
  const SliceJob plain = job_of(solid, pitch_for(solid, columns));
  std::vector<NamedJob> jobs;
  const auto add = [&](const char* name) -> SliceJob& { return jobs.emplace_back(NamedJob{name, plain}).job; };
  add("occupancy").planes = {occupancy()};
  add("channel").planes = {channel(solid, 0, SampleType::kUint8, Encoding::kRawZstd)};
  add("float").planes = {occupancy(), channel(solid, 0, SampleType::kFloat32)};
  add("exact").channel_tolerance = 0;
  add("proved").prove_channels = true;
  SliceJob& contours = add("contours");
  contours.planes = {};
  contours.contours = true;
  SliceJob& region = add("region");
  region.region = whole_region(region.grid);
  region.region->extent.rows = region.grid.extent.rows / 3 + 1;
  region.region->first_row = region.grid.extent.rows / 3;
  return jobs;
}

/// Slices two slabs in the middle, and compares what is held with what was told: that is enough, and not too much where
/// it counts. What isn't in the middle may take more.
void expect_enough(const std::string& what, const PlacedParts& parts) {
  for (const PlacedPart& part : parts) validate_job(*part.solid, part.job);
  const SliceJob& job = parts.front().job;
  const SlicerMemory told = slicer_memory(parts);
  const oracle::HeldMemory held;
  const LayerSlicer prototype(parts);
  LayerSlicer slicer = prototype.twin();
  const std::uint32_t middle = job.grid.extent.layers / 2, end = std::min(middle + 20, job.grid.extent.layers);
  for (std::uint32_t layer = middle - std::min(middle, 20u); layer < end; ++layer) (void)slicer.slice(layer, {});
  EXPECT_LE(held.most_bytes(), told.shared_bytes + told.slicer_bytes) << what;
  const std::uint64_t little = parts.size() * (32u << 20);
  EXPECT_LE(told.shared_bytes + told.slicer_bytes, 3 * held.most_bytes() + little) << what;
}

void expect_enough(const std::string& what, const Solid& solid, const SliceJob& job) {
  expect_enough(what, PlacedParts{{"", solid, job}});
}

void expect_enough_for_sample(const std::string& name, std::initializer_list<int> column_counts) {
  const Solid solid = prepare_solid(find_sample_model(name)->make());
  for (const int columns : column_counts) {
    for (const NamedJob& each : jobs_of(solid, columns)) {
      expect_enough(name + " " + each.name + " " + std::to_string(columns), solid, each.job);
    }
  }
}

TEST(SlicerMemory, IsToldBeforeItIsTaken) {
  for (const SampleModel& model : sample_models()) expect_enough_for_sample(std::string(model.name), {60});
  expect_enough_for_sample("coyote", {400});
}

TEST(SlicerMemory, IsToldOfSeveralParts) {
  const Solid coyote = prepare_solid(make_coyote());
  PlacedParts parts(3, {"", coyote, job_of(coyote, pitch_for(coyote, 60))});
  parts[1].job.placement.translate(Vec3(0.1, 0.2, 0));
  parts[2].job.placement.translate(Vec3(-0.3, 0, 0.1));
  expect_enough("three coyotes", parts);
  const SlicerMemory one = slicer_memory(coyote, parts.front().job), all = slicer_memory(parts);
  EXPECT_GE(all.crossings, 2 * one.crossings);
  EXPECT_EQ(all.tiles_fit.size(), 3u);
}

TEST(SlicerMemory, CountsTheEncodingOfManyCopiesOnce) {
  const Solid box = prepare_solid(make_box({.cells_x = 1, .cells_y = 1, .cells_z = 1}));
  SliceJob job = job_of(box, pitch_for(box, 400));
  job.planes = {occupancy()};
  const auto bytes_of = [&](std::size_t copies) {
    PlacedParts parts(copies, {"", box, job});
    for (std::size_t p = 1; p < copies; ++p) parts[p].is_copy = true;
    return slicer_memory(parts).slicer_bytes;
  };
  constexpr std::uint64_t kCodecs = 4 << 20;
  EXPECT_GT(bytes_of(1), kCodecs);
  EXPECT_LT(bytes_of(65) - bytes_of(1), 64 * (bytes_of(1) - kCodecs));
}

TEST(SlicerMemory, GrowsByLittleWithCopiesThatAreComputedOnce) {
  const Solid coyote = prepare_solid(make_coyote());
  const auto copies = [&](std::size_t count) {
    SliceJob job = job_of(coyote, pitch_for(coyote, 60));
    job.snap_copies = true;
    job.grid.extent.columns *= 20;
    job.grid.extent.rows *= 10;
    PlacedParts parts;
    for (std::size_t p = 0; p < count; ++p) {
      PlacedPart& part = parts.emplace_back(PlacedPart{"", coyote, job, 0, p > 0});
      const VoxelPitch& pitch = job.grid.pitch;
      const double column = 65.0 * static_cast<double>(p % 15), row = 75.0 * static_cast<double>(p / 15);
      part.job.placement.pretranslate(Vec3(column * pitch.x_mm, row * pitch.y_mm, 0));
    }
    return parts;
  };
  expect_enough("many coyotes", copies(60));
  const auto told = [&](std::size_t count) { return slicer_memory(copies(count)).slicer_bytes; };
  EXPECT_LE(told(60) - told(10), 50u << 20) << "a mebibyte a copy";
}

TEST(SlicerMemory, CountsTheRowsOfSources) {
  const Solid box = prepare_solid(make_box({.cells_x = 1, .cells_y = 1, .cells_z = 1}));
  SliceJob job = job_of(box, pitch_for(box, 100));
  job.planes = {occupancy()};
  job.planes.push_back(channel(box, 0, SampleType::kUint8));
  job.planes.back().channel = "x";
  const auto told = [&](std::uint32_t columns) {
    job.grid.extent.columns = columns;
    job.region = VoxelBox{0, 0, 0, {1, 1, 1}};
    job.sources = {std::make_shared<const ChannelFunction>(ChannelRange{"x", 0, 1}, std::vector<std::string>{},
                                                           [](const Vec3&, const Vec3&, auto) { return 0.0f; })};
    return slicer_memory(box, job).slicer_bytes;
  };
  EXPECT_GE(told(2'000'000) - told(1'000'000), 1'000'000 * sizeof(float));
}

TEST(SlicerMemory, IsToldOfFineVoxelsAndTolerancesToo) { expect_enough_for_sample("ring", {1200}); }

// Voxels that no piece paints are left to tiles, even where all cells are large.
TEST(SlicerMemory, IsToldOfPartsOfFewCellsToo) {
  for (const char* name : {"sharp_tet", "sharp_plate", "single_tet", "cube_of_tets"}) {
    const Solid solid = prepare_solid(oracle::tiny_mesh(name));
    for (const bool proved : {false, true}) {
      SliceJob job = job_of(solid, pitch_for(solid, 300));
      job.planes = {channel(solid, 0, SampleType::kFloat32)};
      job.prove_channels = proved;
      expect_enough(name + std::string(proved ? ", proved" : ""), solid, job);
    }
  }
}

TEST(NightlySlicerMemory, IsToldBeforeItIsTaken) {
  for (const SampleModel& model : sample_models()) expect_enough_for_sample(std::string(model.name), {60, 400});
}

TEST(NightlySlicerMemory, IsToldOfFineVoxelsAndTolerancesToo) {
  for (const char* name : {"engine", "ring"}) expect_enough_for_sample(name, {1200});
}

TEST(SlicerMemory, TellsOfWhatRowsCross) {
  const Solid solid = prepare_solid(make_box({.cells_x = 1, .cells_y = 1, .cells_z = 1}));
  SliceJob job = job_of(solid, pitch_for(solid, 100));
  const std::uint64_t rows = job.grid.extent.rows, crossings = slicer_memory(solid, job).crossings;
  EXPECT_GE(crossings, 2 * rows);
  EXPECT_LE(crossings, 8 * rows) << "each of the cube's faces may be met in each row, its hull at least";
  job.grid.pitch.y_mm /= 50;
  job.grid.extent.rows *= 50;
  EXPECT_GE(slicer_memory(solid, job).crossings, 50 * crossings / 2);
}

TEST(SlicerMemory, StopsWhenCancelled) {
  const Solid solid = prepare_solid(make_grid());
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW((void)slicer_memory(solid, job_of(solid, pitch_for(solid, 400)), cancel), Error);
}

}  // namespace
}  // namespace ccslice
