// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Random jobs of several parts, against what a loop over voxels makes of the same parts sliced one by one.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/job/validate_job.h"
#include "core/mesh_authoring/grade.h"
#include "core/models/models.h"
#include "core/output/encode.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

constexpr unsigned kJobs = 200;
constexpr std::size_t kOccupancy = 0, kMaterials = 3;  // Planes of job_of_part().

/// Solids whose channels have the same names at different places, and of two cell regions each.
std::vector<std::shared_ptr<const LimitSolid>> make_solids() {
  const auto with_channels = [](ControlMesh mesh, const std::vector<std::string>& grades, bool several_regions) {
    mesh.channel_names.clear();
    mesh.channel_values.clear();
    for (const std::string& grade : grades) apply_grade(parse_grade(grade), mesh);
    mesh.cell_region_names = {"shell", "core"};
    for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
      mesh.cell_regions.push_back(static_cast<std::uint8_t>(several_regions ? cell % 2 : 0));
    }
    return prepare_solid(std::move(mesh));
  };
  ControlMesh smooth = make_box({Vec3(10, 8, 9), 2, 2, 2});
  smooth.sharp_edges.clear();
  smooth.sharp_vertices.clear();
  return {with_channels(make_box({Vec3(12, 8, 6), 3, 2, 2}), {"soft=x:0..12", "hard=z:0..6"}, true),
          with_channels(make_ring({8, 1, 2, 14, 6, 7}), {"hard=x:-7..7", "other=y:-7..7", "soft=z:0..7"}, false),
          with_channels(std::move(smooth), {"other=x:0..10", "soft=y:0..8", "hard=z:0..9"}, true)};
}

using Random = std::mt19937;

double random_in(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
std::uint32_t random_below(Random& random, std::uint32_t end) { return random() % end; }

Placement random_placement(Random& random) {
  Placement placement = Placement::Identity();
  placement.translate(Vec3(random_in(random, -4, 16), random_in(random, -4, 16), random_in(random, -4, 8)));
  const Vec3 axis(random_in(random, -1, 1), random_in(random, -1, 1), random_in(random, -1, 1));
  if (random_below(random, 2) == 0) placement.rotate(Eigen::AngleAxisd(random_in(random, 0, 6), axis.normalized()));
  if (random_below(random, 4) == 0) placement.scale(Vec3(-1, 1, 1));
  return placement;
}

PlaneSpec plane_of(PlaneContent content, SampleType type) {
  PlaneSpec plane;
  plane.content = content;
  plane.sample_type = type;
  plane.encoding = Encoding::kRaw;
  return plane;
}

/// What is the same in all parts of a job.
struct Common {
  Grid grid;
  std::optional<VoxelBox> region;
  PictureOrder order;
  double tolerance;
  HalftoneMethod method;
  double outside;
  bool leaves_empty;  // One of the materials does.
};

Common random_common(Random& random) {
  Common common;
  common.grid.origin_mm = Vec3(-2, -2, -1);
  // Two shapes of voxels: each has a mask of its own, which takes a second to make.
  common.grid.pitch = std::array<VoxelPitch, 2>{{{0.4, 0.45, 0.9}, {0.6, 0.35, 0.8}}}[random_below(random, 2)];
  common.grid.extent = {20 + random_below(random, 80), 20 + random_below(random, 80), 18};
  if (random_below(random, 2) == 0) {
    const std::uint32_t column = random_below(random, 10), row = random_below(random, 10);
    common.region = VoxelBox{column,
                             row,
                             2,
                             {1 + random_below(random, common.grid.extent.columns - column),
                              1 + random_below(random, common.grid.extent.rows - row), 16}};
  }
  common.order = {random_below(random, 2) == 0, random_below(random, 2) == 0};
  common.tolerance = random_below(random, 3) == 0 ? 0 : 1.0 / 1024;
  common.method = std::array{HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion,
                             HalftoneMethod::kLargestFraction, HalftoneMethod::kWhiteNoise}[random_below(random, 4)];
  common.outside = random_below(random, 256);
  common.leaves_empty = random_below(random, 3) == 0;
  return common;
}

SliceJob job_of_part(const Common& common, Random& random) {
  SliceJob job;
  job.placement = random_placement(random);
  job.grid = common.grid;
  job.region = common.region;
  job.order = common.order;
  job.channel_tolerance = common.tolerance;
  job.contours = true;
  const std::string soft = "soft", hard = "hard";
  PlaneSpec bytes = plane_of(PlaneContent::kChannel, SampleType::kUint8);
  bytes.channel = soft;
  bytes.range = ValueRange{-1, 15};
  bytes.outside_sample = common.outside;
  PlaneSpec floats = plane_of(PlaneContent::kChannels, SampleType::kFloat32);
  floats.channels = {hard, soft};
  PlaneSpec mask = plane_of(PlaneContent::kMaterialMask, SampleType::kBit);
  mask.material = 2;
  job.planes = {plane_of(PlaneContent::kOccupancy, SampleType::kBit),
                bytes,
                floats,
                plane_of(PlaneContent::kMaterials, SampleType::kUint8),
                mask,
                plane_of(PlaneContent::kCellRegions, SampleType::kUint8)};
  Printing printing;
  printing.materials = {{"white", 0xffffffff}, {"clear", 0x808080ff}, {"black", 0x101010ff}};
  printing.materials[1].leaves_empty = common.leaves_empty;
  printing.map.kind = BlendMap{random_below(random, 2) == 0 ? soft : hard, {{0, 1}, {5, 2}, {9, 3}}};
  if (random_below(random, 3) == 0) {
    CellRegionMap core;
    core.cell_region = 1;
    core.map.kind = BlendMap{hard, {{0, 3}, {6, 1}}};
    printing.cell_region_maps.push_back(core);
  }
  printing.halftone = {common.method, random()};
  job.printing = printing;
  return job;
}

PlacedParts random_parts(const std::vector<std::shared_ptr<const LimitSolid>>& solids, const Common& common,
                         Random& random) {
  PlacedParts parts;
  const std::uint32_t count = 2 + random_below(random, 19);
  for (std::uint32_t p = 0; p < count; ++p) {
    const auto& solid = solids[random_below(random, static_cast<std::uint32_t>(solids.size()))];
    parts.push_back({"part " + std::to_string(p), solid, job_of_part(common, random),
                     static_cast<std::int32_t>(random_below(random, 3)) - 1});
    validate_job(*solid, parts.back().job);
  }
  return parts;
}

/// A plane's samples, a voxel each: its bytes, or its bit.
class Samples {
 public:
  Samples(const SliceJob& job, std::size_t plane, std::vector<std::uint8_t>& bytes)
      : columns_(region_of(job).extent.columns),
        bits_(job.planes[plane].sample_type == SampleType::kBit),
        size_(bits_ ? 1 : sample_bytes(job.planes[plane].sample_type, 1, 1, channel_count(job.planes[plane]))),
        bytes_(bytes) {}

  std::vector<std::uint8_t> get(std::uint32_t x, std::uint32_t y) const {
    if (bits_) return {static_cast<std::uint8_t>(bytes_[byte_of(x, y)] >> (7 - x % 8) & 1)};
    const auto first = bytes_.begin() + static_cast<std::ptrdiff_t>(size_ * (std::size_t{columns_} * y + x));
    return {first, first + static_cast<std::ptrdiff_t>(size_)};
  }
  void set(std::uint32_t x, std::uint32_t y, const std::vector<std::uint8_t>& sample) {
    if (bits_) {
      const auto bit = static_cast<std::uint8_t>(1u << (7 - x % 8));
      std::uint8_t& byte = bytes_[byte_of(x, y)];
      byte = static_cast<std::uint8_t>(sample[0] != 0 ? byte | bit : byte & ~bit);
    } else {
      std::ranges::copy(sample, bytes_.begin() + static_cast<std::ptrdiff_t>(size_ * (std::size_t{columns_} * y + x)));
    }
  }

 private:
  std::size_t byte_of(std::uint32_t x, std::uint32_t y) const { return std::size_t{(columns_ + 7) / 8} * y + x / 8; }

  std::uint32_t columns_;
  bool bits_;
  std::size_t size_;
  std::vector<std::uint8_t>& bytes_;
};

struct Composed {
  std::vector<std::vector<std::uint8_t>> planes;
  std::uint64_t inside = 0, covered = 0, computed = 0;
  std::array<std::uint64_t, 4> materials{};
};

/// From the parts' own layers, voxel by voxel.
Composed compose(const PlacedParts& parts, std::vector<Layer> layers) {
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return parts[a].priority > parts[b].priority; });
  const SliceJob& job = parts.front().job;
  Composed composed;
  for (const Layer& layer : layers) {
    composed.computed += layer.stats.voxels_coherent + layer.stats.voxels_full + layer.stats.voxels_interpolated +
                         layer.stats.voxels_unresolved;
  }
  // Outside of all parts any part's samples are those outside.
  for (std::size_t plane = 0; plane < job.planes.size(); ++plane) {
    std::vector<std::uint8_t>& bytes = composed.planes.emplace_back(layers[order.back()].planes[plane].bytes);
    for (std::uint32_t y = 0; y < region_of(job).extent.rows; ++y) {
      for (std::uint32_t x = 0; x < region_of(job).extent.columns; ++x) {
        Samples out(job, plane, bytes);
        bool owned = false;
        for (const std::size_t p : order) {
          if (Samples(job, kMaterials, layers[p].planes[kMaterials].bytes).get(x, y)[0] == 0) continue;
          composed.covered += owned && plane == kOccupancy ? 1 : 0;
          if (owned) continue;
          owned = true;
          std::vector<std::uint8_t> sample = Samples(job, plane, layers[p].planes[plane].bytes).get(x, y);
          if (plane == kOccupancy) composed.inside += sample[0];
          if (plane == kMaterials) ++composed.materials[sample[0]];
          out.set(x, y, sample);
        }
        if (owned) continue;
        out.set(x, y, [&]() -> std::vector<std::uint8_t> {
          if (plane == 1) return {static_cast<std::uint8_t>(job.planes[1].outside_sample)};
          return std::vector<std::uint8_t>(out.get(x, y).size());
        }());
      }
    }
  }
  return composed;
}

std::vector<Layer> layers_of(LayerSlicer slicer, const std::vector<std::uint32_t>& wanted) {
  std::vector<Layer> layers;
  for (const std::uint32_t layer : wanted) layers.push_back(slicer.slice(layer, {}));
  return layers;
}

TEST(ComposedParts, AreTheirPartsVoxelByVoxel) {
  const auto solids = make_solids();
  std::uint64_t covered = 0, inside = 0;
  for (unsigned seed = 1; seed <= kJobs; ++seed) {
    Random random(seed);
    const Common common = random_common(random);
    const PlacedParts parts = random_parts(solids, common, random);
    const std::vector<std::uint32_t> wanted = {2, 3 + random_below(random, 8), 17};
    const std::vector<Layer> layers = layers_of(LayerSlicer(parts), wanted);
    std::vector<std::vector<Layer>> alone;
    for (const PlacedPart& part : parts) alone.push_back(layers_of(LayerSlicer(part.solid, part.job), wanted));
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      std::vector<Layer> of_parts;
      for (const std::vector<Layer>& part : alone) of_parts.push_back(part[k]);
      const Composed expected = compose(parts, std::move(of_parts));
      for (std::size_t plane = 0; plane < expected.planes.size(); ++plane) {
        ASSERT_EQ(layers[k].planes[plane].bytes, expected.planes[plane])
            << "seed " << seed << ", layer " << wanted[k] << ", plane " << plane;
      }
      const LayerStats& stats = layers[k].stats;
      ASSERT_EQ(stats.voxels_inside, expected.inside) << "seed " << seed;
      ASSERT_EQ(stats.voxels_covered, expected.covered) << "seed " << seed;
      ASSERT_EQ(stats.voxels_coherent + stats.voxels_full + stats.voxels_interpolated + stats.voxels_unresolved,
                expected.computed)
          << "seed " << seed;
      for (std::size_t m = 0; m < stats.material_voxels.size(); ++m) {
        ASSERT_EQ(stats.material_voxels[m], expected.materials[m + 1]) << "seed " << seed;
      }
      covered += stats.voxels_covered;
      inside += stats.voxels_inside;
    }
  }
  EXPECT_GT(covered, 20000u);
  EXPECT_GT(inside, 200000u);
}

TEST(ComposedParts, AreTheSameForAnyNumberOfThreadsAndAnySplit) {
  const auto solids = make_solids();
  for (unsigned seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const Common common = random_common(random);
    const PlacedParts parts = random_parts(solids, common, random);
    constexpr std::uint32_t kFirst = 2, kEnd = 18;
    std::vector<Layer> all;
    slice_range(parts, kFirst, kEnd - kFirst, [&](Layer&& layer) { all.push_back(std::move(layer)); },
                {.threads = 3, .cancel = {}});
    ASSERT_EQ(all.size(), kEnd - kFirst);
    std::vector<std::uint32_t> backwards;
    for (std::uint32_t layer = kEnd; layer-- > kFirst;) backwards.push_back(layer);
    const std::vector<Layer> alone = layers_of(LayerSlicer(parts), backwards);
    for (const Layer& layer : alone) {
      const Layer& same = all[layer.index - kFirst];
      ASSERT_EQ(same.index, layer.index);
      EXPECT_EQ(same.stats.voxels_covered, layer.stats.voxels_covered);
      EXPECT_EQ(same.contours.loops.size(), layer.contours.loops.size());
      for (std::size_t plane = 0; plane < layer.planes.size(); ++plane) {
        ASSERT_EQ(same.planes[plane].bytes, layer.planes[plane].bytes) << "seed " << seed << ", layer " << layer.index;
      }
    }
  }
}

/// A layer as it is when its part moves by whole voxels: zeros outside.
Layer moved(const Layer& layer, const SliceJob& job, std::int64_t columns, std::int64_t rows) {
  Layer result = layer;
  for (std::size_t plane = 0; plane < job.planes.size(); ++plane) {
    std::vector<std::uint8_t> from = layer.planes[plane].bytes, held = layer.planes[kMaterials].bytes;
    std::vector<std::uint8_t>& to = result.planes[plane].bytes;
    std::ranges::fill(to, 0);
    for (std::uint32_t y = 0; y < job.grid.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < job.grid.extent.columns; ++x) {
        if (Samples(job, kMaterials, held).get(x, y)[0] == 0) continue;
        Samples(job, plane, to)
            .set(static_cast<std::uint32_t>(x + columns), static_cast<std::uint32_t>(y + rows),
                 Samples(job, plane, from).get(x, y));
      }
    }
  }
  return result;
}

/// Copies whole voxels apart of a few parts, some of which the grid cuts off.
struct SnappedTray {
  struct Copy {
    std::size_t first;           // The part that it is a copy of, and
    std::int64_t columns, rows;  // how far from it.
  };
  PlacedParts parts;
  std::vector<Copy> copies;  // By part; a part itself is its own.
};

SnappedTray random_tray(const std::vector<std::shared_ptr<const LimitSolid>>& solids, Common common, Random& random) {
  common.region.reset();
  common.order = {};
  common.grid.extent.columns = common.grid.extent.rows = 110;
  SnappedTray tray;
  const std::uint32_t parts = 1 + random_below(random, 3);
  for (std::uint32_t p = 0; p < parts; ++p) {
    const auto& solid = solids[random_below(random, static_cast<std::uint32_t>(solids.size()))];
    const SliceJob job = job_of_part(common, random);
    const auto priority = static_cast<std::int32_t>(random_below(random, 3));
    const std::size_t begin = tray.parts.size();
    constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::size_t first = kNone;
    std::vector<Placement> ways = {job.placement, random_placement(random)};
    for (const Placement& way : ways) {
      first = kNone;
      for (std::uint32_t copy = 0; copy < 1 + random_below(random, 5); ++copy) {
        PlacedPart part{"part", solid, job, priority, tray.parts.size() > begin};
        part.name += " " + std::to_string(tray.parts.size());
        part.job.snap_copies = true;
        part.job.placement = way;
        const VoxelPitch& pitch = common.grid.pitch;
        const std::int64_t columns = random_below(random, 90), rows = random_below(random, 90);
        const Box3 box = solid->summary().bounding_box.transformed(way);
        // Two voxels from the grid's corner, and further.
        const double x0 = common.grid.origin_mm.x() + 2 * pitch.x_mm, y0 = common.grid.origin_mm.y() + 2 * pitch.y_mm;
        const Vec3 to(
            std::ceil((x0 - box.min().x()) / pitch.x_mm) * pitch.x_mm + static_cast<double>(columns) * pitch.x_mm,
            std::ceil((y0 - box.min().y()) / pitch.y_mm) * pitch.y_mm + static_cast<double>(rows) * pitch.y_mm, 0);
        part.job.placement.translation() += to;
        const Box3 there = solid->summary().bounding_box.transformed(part.job.placement);
        const double end_x = common.grid.origin_mm.x() + common.grid.extent.columns * pitch.x_mm;
        const double end_y = common.grid.origin_mm.y() + common.grid.extent.rows * pitch.y_mm;
        const double over = std::max((there.max().x() - end_x) / pitch.x_mm, (there.max().y() - end_y) / pitch.y_mm);
        if (over > -2 && over < 2) continue;  // Whether that is cut off follows from rounding.
        validate_job(*solid, part.job);
        const bool is_cut = over > 0;
        const std::size_t number = tray.parts.size();
        if (!is_cut && first == kNone) first = number;
        if (is_cut || first == number) {
          tray.copies.push_back({number, 0, 0});
        } else {
          const Vec3 from = tray.parts[first].job.placement.translation();
          const Vec3 by = part.job.placement.translation() - from;
          tray.copies.push_back({first, std::llround(by.x() / pitch.x_mm), std::llround(by.y() / pitch.y_mm)});
        }
        tray.parts.push_back(std::move(part));
      }
    }
  }
  return tray;
}

/// The loops of a part in a layer are its own ones, moved.
void expect_moved_loops(const std::vector<ContourLoop>& own, const Vec2& by_mm, const std::vector<ContourLoop>& all,
                        std::uint32_t part) {
  constexpr double kRoundingMm = 1e-12;
  std::vector<ContourLoop> of_part;
  std::ranges::copy_if(all, std::back_inserter(of_part), [&](const ContourLoop& loop) { return loop.part == part; });
  ASSERT_EQ(of_part.size(), own.size());
  for (std::size_t k = 0; k < own.size(); ++k) {
    ASSERT_EQ(of_part[k].points.size(), own[k].points.size());
    for (std::size_t i = 0; i < own[k].points.size(); ++i) {
      const Vec2 apart = of_part[k].points[i].xy - own[k].points[i].xy - by_mm;
      ASSERT_LT(apart.cwiseAbs().maxCoeff(), kRoundingMm) << "part " << part;
    }
  }
}

/// Halftones but those that follow from the fractions alone are other ones in other places.
bool prints_alike(const SliceJob& job) { return job.printing->halftone.method == HalftoneMethod::kLargestFraction; }

TEST(SnappedCopies, AreTheirFirstMovedVoxelByVoxel) {
  const auto solids = make_solids();
  std::uint64_t copies = 0, cut = 0, inside = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    Common common = random_common(random);
    common.method = HalftoneMethod::kLargestFraction;
    const SnappedTray tray = random_tray(solids, common, random);
    if (tray.parts.size() < 2) continue;
    const std::vector<std::uint32_t> wanted = {1 + random_below(random, 16)};
    const Layer layer = layers_of(LayerSlicer(tray.parts), wanted).front();
    std::vector<Layer> of_parts;
    for (std::size_t p = 0; p < tray.parts.size(); ++p) {
      const auto& [first, columns, rows] = tray.copies[p];
      const Layer own = layers_of(LayerSlicer(tray.parts[p].solid, tray.parts[first].job), wanted).front();
      of_parts.push_back(moved(own, tray.parts[first].job, columns, rows));
      const VoxelPitch& pitch = common.grid.pitch;
      const Vec2 by_mm(static_cast<double>(columns) * pitch.x_mm, static_cast<double>(rows) * pitch.y_mm);
      expect_moved_loops(own.contours.loops, by_mm, layer.contours.loops, static_cast<std::uint32_t>(p));
      copies += first != p ? 1 : 0;
      cut += first == p ? 1 : 0;
    }
    const Composed expected = compose(tray.parts, std::move(of_parts));
    for (std::size_t plane = 0; plane < expected.planes.size(); ++plane) {
      ASSERT_EQ(layer.planes[plane].bytes, expected.planes[plane]) << "seed " << seed << ", plane " << plane;
    }
    ASSERT_EQ(layer.stats.voxels_inside, expected.inside) << "seed " << seed;
    ASSERT_EQ(layer.stats.voxels_covered, expected.covered) << "seed " << seed;
    std::uint64_t of_all = 0, overlaps = 0;
    for (const PartVoxels& part : layer.stats.parts) of_all += part.voxels;
    for (const PartOverlap& overlap : layer.stats.overlaps) overlaps += overlap.voxels;
    ASSERT_EQ(of_all, expected.inside) << "seed " << seed;
    ASSERT_EQ(overlaps, expected.covered) << "seed " << seed;
    inside += expected.inside;
  }
  EXPECT_GT(copies, 150u);
  EXPECT_GT(cut, 100u);
  EXPECT_GT(inside, 50000u);
}

TEST(SnappedCopies, HaveTheHalftonesOfTheirPlaces) {
  const auto solids = make_solids();
  std::uint64_t inside = 0, others = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    Common common = random_common(random);
    common.tolerance = 0;
    const SnappedTray tray = random_tray(solids, common, random);
    if (tray.parts.size() < 2 || prints_alike(tray.parts.front().job)) continue;
    const std::vector<std::uint32_t> wanted = {1 + random_below(random, 16)};
    const Layer layer = layers_of(LayerSlicer(tray.parts), wanted).front();
    PlacedParts apart = tray.parts;
    for (PlacedPart& part : apart) part.job.snap_copies = false;
    const Layer expected = layers_of(LayerSlicer(apart), wanted).front();
    const std::vector<std::uint8_t>&materials = layer.planes[3].bytes, &alone = expected.planes[3].bytes;
    for (std::size_t i = 0; i < materials.size(); ++i) {
      inside += materials[i] != 0 ? 1 : 0;
      others += materials[i] != alone[i] ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 20000u);
  EXPECT_LT(others, inside / 2000) << "values differ by rounding";
}

TEST(SnappedCopies, AreTheSameInAnyRegionSplitAndNumberOfThreads) {
  const auto solids = make_solids();
  for (unsigned seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    const Common common = random_common(random);
    const SnappedTray tray = random_tray(solids, common, random);
    if (tray.parts.size() < 2) continue;
    std::vector<Layer> all;
    slice_range(tray.parts, 0, 18, [&](Layer&& layer) { all.push_back(std::move(layer)); },
                {.threads = 3, .cancel = {}});
    ASSERT_EQ(all.size(), 18u);
    PlacedParts parts = tray.parts;
    const VoxelBox region{7 + random_below(random, 40), 5 + random_below(random, 40), 3, {31, 42, 12}};
    for (PlacedPart& part : parts) part.job.region = region;
    for (const Layer& layer : layers_of(LayerSlicer(parts), {14, 3, 8})) {
      const SliceJob &whole = tray.parts.front().job, &cropped = parts.front().job;
      std::uint64_t inside = 0;
      for (std::size_t plane = 0; plane < whole.planes.size(); ++plane) {
        std::vector<std::uint8_t> from = all[layer.index].planes[plane].bytes, to = layer.planes[plane].bytes;
        for (std::uint32_t y = 0; y < region.extent.rows; ++y) {
          for (std::uint32_t x = 0; x < region.extent.columns; ++x) {
            const auto sample = Samples(cropped, plane, to).get(x, y);
            ASSERT_EQ(sample, Samples(whole, plane, from).get(x + region.first_column, y + region.first_row))
                << "seed " << seed << ", layer " << layer.index << ", plane " << plane << ", " << x << ", " << y;
            inside += plane == 0 ? sample[0] : 0;
          }
        }
      }
      EXPECT_EQ(layer.stats.voxels_inside, inside) << "seed " << seed;
      std::uint64_t of_materials = 0;
      for (std::size_t m = 0; m < layer.stats.material_voxels.size(); ++m) {
        const bool is_empty = cropped.printing->materials[m].leaves_empty;
        of_materials += is_empty ? 0 : layer.stats.material_voxels[m];
      }
      EXPECT_EQ(of_materials, inside) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace ccslice
