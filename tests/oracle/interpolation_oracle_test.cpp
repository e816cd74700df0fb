// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Interpolated layers against the same layers with every voxel inverted: no voxel's value may be off by more than the
// tolerance.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "core/slicer/layer_slicer.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/slicing.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1.0 / 1024;

struct Difference {
  std::uint64_t voxels = 0, interpolated = 0, unresolved = 0, beyond = 0;
  double tolerance = kTolerance;
  double worst = 0;  // As a share of the channel's range.
  std::string worst_at;
};

void add_difference(const LayerView& exact, const LayerView& other, const std::vector<ChannelRange>& channels,
                    std::uint32_t layer, Difference& difference) {
  for (std::uint32_t y = 0; y < exact.grid().extent.rows; ++y) {
    for (std::uint32_t x = 0; x < exact.grid().extent.columns; ++x) {
      ASSERT_EQ(exact.inside(x, y), other.inside(x, y));
      if (!exact.inside(x, y)) continue;
      for (std::uint32_t c = 0; c < channels.size(); ++c) {
        const double range = std::max(channels[c].max - channels[c].min, 1e-30);
        const double error = std::abs(other.channel(c, x, y) - exact.channel(c, x, y)) / range;
        difference.beyond += !(error <= difference.tolerance);
        if (error <= difference.worst) continue;
        difference.worst = error;
        difference.worst_at = "voxel " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(layer) +
                              ", channel " + std::to_string(c) + ": " + std::to_string(other.channel(c, x, y)) +
                              " instead of " + std::to_string(exact.channel(c, x, y));
      }
    }
  }
}

/// Layers at `places` equidistant heights, at most each once.
Difference compare(const Subject& subject, int columns, std::uint32_t places, double tolerance = kTolerance) {
  SliceJob exact_job = float_job(subject, columns);
  exact_job.contours = false;
  SliceJob job = exact_job;
  job.channel_tolerance = tolerance;
  LayerSlicer exact(subject.shared_solid(), exact_job), interpolating(subject.shared_solid(), job);
  Difference difference;
  difference.tolerance = tolerance;
  const std::uint32_t layers = job.grid.extent.layers;
  places = std::min(places, layers);
  for (std::uint32_t place = 0; place < places; ++place) {
    const std::uint32_t k = (2 * place + 1) * layers / (2 * places);
    const Layer a = exact.slice(k, {}), b = interpolating.slice(k, {});
    EXPECT_EQ(b.stats.voxels_interpolated + b.stats.voxels_coherent + b.stats.voxels_full + b.stats.voxels_unresolved,
              b.stats.voxels_inside);
    difference.voxels += b.stats.voxels_inside;
    difference.interpolated += b.stats.voxels_interpolated;
    difference.unresolved += a.stats.voxels_unresolved + b.stats.voxels_unresolved;
    add_difference(LayerView(exact_job, a), LayerView(job, b), subject.solid().summary().channels, k, difference);
  }
  return difference;
}

void expect_within_tolerance(const Difference& difference) {
  testing::Test::RecordProperty("voxels", std::to_string(difference.voxels));
  testing::Test::RecordProperty("interpolated", std::to_string(difference.interpolated));
  testing::Test::RecordProperty("unresolved", std::to_string(difference.unresolved));
  testing::Test::RecordProperty("worst_share_of_tolerance", std::to_string(difference.worst / difference.tolerance));
  std::printf("%llu voxels, %llu interpolated, %llu unresolved, %llu beyond, worst error %.3f of the tolerance\n",
              static_cast<unsigned long long>(difference.voxels),
              static_cast<unsigned long long>(difference.interpolated),
              static_cast<unsigned long long>(difference.unresolved),
              static_cast<unsigned long long>(difference.beyond), difference.worst / difference.tolerance);
  EXPECT_GT(difference.voxels, 0u);
  EXPECT_EQ(difference.beyond, 0u) << "worst " << difference.worst / difference.tolerance << " of the tolerance at "
                                   << difference.worst_at;
}

class InterpolatedTinyMeshes : public testing::TestWithParam<std::size_t> {};

TEST_P(InterpolatedTinyMeshes, KeepTheTolerance) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  expect_within_tolerance(compare(subject, 60, 20));
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, InterpolatedTinyMeshes, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

// What is across the slit has the other end of the range.
TEST(InterpolatedSlits, BesideALobeThatTapersKeepTheTolerance) {
  expect_within_tolerance(compare(Subject(tapered_slit(0.004)), 400, 60));
}

// Some of it lies in cells that touch those across it.
TEST(InterpolatedSlits, BesideLobesThatShareAVertexKeepTheTolerance) {
  expect_within_tolerance(compare(Subject(vertex_slit(0.001)), 300, 40));
}

// Some voxels are in the air between, nearer to one side.
TEST(InterpolatedSlits, OfAFewThousandthsKeepTheTolerance) {
  expect_within_tolerance(compare(Subject(vertex_slit(0.002)), 600, 40));
}

TEST(InterpolatedSlits, RoundWhoseEndASingleCellLiesKeepTheTolerance) {
  expect_within_tolerance(compare(Subject(forked_slit(0.0001)), 400, 100, 0.01));
}

/// Samples of a plane of two bytes that differ by more than one.
std::uint64_t differing_words(const Layer& one, const Layer& other) {
  std::uint64_t count = 0;
  const auto word = [](const Layer& layer, std::size_t k) {
    return layer.planes[0].bytes[2 * k] + 256 * layer.planes[0].bytes[2 * k + 1];
  };
  for (std::size_t k = 0; 2 * k < one.planes[0].bytes.size(); ++k) count += std::abs(word(one, k) - word(other, k)) > 1;
  return count;
}

// From 1,000,000 to 1,000,001, where floats have sixteen steps.
TEST(InterpolatedChannels, FarFromZeroKeepTheToleranceToo) {
  ControlMesh mesh = box_mesh(3, 3, 2);
  mesh.channel_names = {"far"};
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    mesh.channel_values.push_back(1e6f + static_cast<float>(v * v % 17) / 16);
  }
  const Subject subject(mesh);
  SliceJob exact_job = float_job(subject, 100);
  exact_job.planes[1].sample_type = SampleType::kUint16;
  exact_job.planes.erase(exact_job.planes.begin());
  SliceJob job = exact_job;
  job.channel_tolerance.reset();
  LayerSlicer exact(subject.shared_solid(), exact_job), interpolating(subject.shared_solid(), job);
  std::uint64_t interpolated = 0;
  for (std::uint32_t k = 3; k < job.grid.extent.layers; k += 8) {
    const Layer layer = interpolating.slice(k, {});
    interpolated += layer.stats.voxels_interpolated;
    EXPECT_EQ(differing_words(exact.slice(k, {}), layer), 0u) << "layer " << k;
  }
  EXPECT_GT(interpolated, 400u);
}

constexpr double kPrintedMm = 24;  // A pitch of about 0.12 mm, at which tiles are large beside the meshes' cells.

class InterpolatedRealMeshes : public testing::TestWithParam<std::string> {};

TEST_P(InterpolatedRealMeshes, KeepTheTolerance) {
  std::optional<ControlMesh> mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  scale_to(kPrintedMm, *mesh);
  const Subject subject(*mesh);
  const Difference difference = compare(subject, 200, 5);
  expect_within_tolerance(difference);
  if (difference.interpolated > difference.voxels / 10) return;
  const Difference finer = compare(subject, 800, 2);  // Cells of a few dozen voxels are inverted.
  expect_within_tolerance(finer);
  EXPECT_GT(finer.interpolated, 0u) << "nothing is tested here";
}

INSTANTIATE_TEST_SUITE_P(Samples, InterpolatedRealMeshes, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, InterpolatedRealMeshes, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, InterpolatedRealMeshes, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, InterpolatedRealMeshes, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
