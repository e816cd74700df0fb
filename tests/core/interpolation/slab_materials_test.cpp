// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/slab_materials.h"
#include "core/channel/channel_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr double kSlabTolerance = 1.0 / 1024;  // Of a job that has none.
constexpr double kRoundingOfFloats = 1e-7;

struct Comparison {
  std::uint64_t voxels = 0, interpolated = 0;
  double worst = 0;  // Share of the channel's range.
};

/// Of a plane of floats.
double largest_difference(const EncodedPlane& a, const EncodedPlane& b) {
  std::vector<float> x(a.bytes.size() / sizeof(float)), y(x.size());
  std::memcpy(x.data(), a.bytes.data(), a.bytes.size());
  std::memcpy(y.data(), b.bytes.data(), b.bytes.size());
  double largest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) largest = std::max<double>(largest, std::abs(x[i] - y[i]));
  return largest;
}

/// Layers against the same ones with every voxel inverted.
Comparison compare(const Solid& solid, SliceJob job, std::span<const std::uint32_t> layers) {
  if (!job.channel_tolerance) job.channel_tolerance = kSlabTolerance;
  SliceJob exact_job = job;
  exact_job.channel_tolerance = 0;
  LayerSlicer slicer(solid, job), exact(solid, exact_job);
  Comparison result;
  for (const std::uint32_t k : layers) {
    const Layer a = slicer.slice(k, {}), b = exact.slice(k, {});
    result.voxels += a.stats.voxels_inside;
    result.interpolated += a.stats.voxels_interpolated;
    EXPECT_EQ(a.stats.voxels_interpolated + a.stats.voxels_coherent + a.stats.voxels_full + a.stats.voxels_unresolved,
              a.stats.voxels_inside);
    for (std::size_t p = 1; p < job.planes.size(); ++p) {
      const ChannelRange range = ChannelTable(solid->summary().channels).at(job.planes[p].channel).range;
      result.worst = std::max(result.worst, largest_difference(a.planes[p], b.planes[p]) / (range.max - range.min));
    }
  }
  return result;
}

/// Every third layer.
Comparison compare(const Solid& solid, const SliceJob& job) {
  std::vector<std::uint32_t> layers;
  for (std::uint32_t k = 1; k < job.grid.extent.layers; k += 3) layers.push_back(k);
  return compare(solid, job, layers);
}

Placement tilted() {
  Placement placement = Placement::Identity();
  placement.linear() = Mat3(Eigen::AngleAxisd(0.7, Vec3(1, 2, -0.5).normalized())) * Vec3(1, 1.2, -0.9).asDiagonal();
  placement.translation() = Vec3(5, -3, 40);
  return placement;
}

// All cells have irregular edges or vertices.
TEST(SlabMaterials, PaintASmoothBoxWithinTheTolerance) {
  ControlMesh mesh = oracle::box_mesh(2, 3, 2);
  oracle::grade_by_coordinates(mesh);
  const Solid solid = prepare_solid(mesh);
  for (const Placement& placement : {Placement(Placement::Identity()), tilted()}) {
    const Comparison found = compare(solid, job_of(solid, {0.3, 0.35, 0.25}, placement));
    EXPECT_LE(found.worst, kSlabTolerance);
    EXPECT_GT(static_cast<double>(found.interpolated), 0.98 * static_cast<double>(found.voxels));
  }
}

TEST(SlabMaterials, InvertWhereTheSolidFolds) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  oracle::grade_by_coordinates(mesh);
  const Solid solid = prepare_solid(mesh);
  const Comparison found = compare(solid, job_of(solid, {0.8, 0.8, 0.8}));
  EXPECT_LE(found.worst, kSlabTolerance);
  EXPECT_LT(found.interpolated, found.voxels);
}

// A thin saddle: its faces have straight sides, and are missed by flat triangles all the same.
TEST(SlabMaterials, KeepTheToleranceAtTwistedFaces) {
  constexpr double kHeight = 1.5;
  for (const double middle : {0.8, 0.3}) {
    ControlMesh mesh = oracle::box_mesh(2, 2, 3);
    oracle::sharpen_by_cells(mesh, 1);
    mesh.channel_names = {"m"};
    for (Vec3& p : mesh.positions) {
      const double x = (p.x() - 10) / 10, y = (p.y() - 10) / 10, w = p.z() / 10;
      const double of_layer = std::lround(w) == 1 ? middle : std::lround(w) == 2 ? -0.6 : 0.1;
      mesh.channel_values.push_back(static_cast<float>(0.5 + 0.1 * of_layer + 0.07 * x * x * y - 0.05 * w * x));
      p.z() = kHeight * w + 10 * kHeight * x * y;
    }
    const Solid solid = prepare_solid(mesh);
    SliceJob job = job_of(solid, {0.25, 0.25, kHeight / 3.3});
    for (double tolerance = 0.04; tolerance > 3e-4; tolerance /= 1.5) {
      job.channel_tolerance = tolerance;
      EXPECT_LE(compare(solid, job).worst, tolerance);
    }
  }
}

// Cells of some hundred voxels.
TEST(SlabMaterials, LeaveSmallCellsToTiles) {
  const Solid solid = prepare_solid(make_ring({64, 16, 16}));
  const Comparison found = compare(solid, job_of(solid, {0.3, 0.3, 0.3}));
  EXPECT_LE(found.worst, kSlabTolerance);
  EXPECT_GT(found.interpolated, 0u);
}

// One control point in many small cells that is off by a few times the tolerance: at its own place three tenths of it
// are left, a tenth in the middles of cells, where tiles are judged.
TEST(SlabMaterials, SeeWhatASingleControlPointHolds) {
  ControlMesh mesh = oracle::box_mesh(24, 12, 8, 0.6);
  mesh.channel_names = {"bumps"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) {
    const Vec3 at = p / 0.6;
    const auto is_every_sixth = [&](int a) { return std::lround(at[a]) % 6 == 3; };
    const bool bump = is_every_sixth(0) && is_every_sixth(1) && std::lround(at.z()) == 4;
    mesh.channel_values.push_back(static_cast<float>(at.x() / 24 + (bump ? 4.4 * kSlabTolerance : 0)));
  }
  const Solid solid = prepare_solid(mesh);
  const Comparison found =
      compare(solid, job_of(solid, {0.05, 0.05, 0.05}), std::vector<std::uint32_t>{38, 46, 47, 48, 54});
  EXPECT_LE(found.worst, kSlabTolerance);
  EXPECT_GT(static_cast<double>(found.interpolated), 0.9 * static_cast<double>(found.voxels));
}

// Rows a hundred and more to a cell, columns and layers far fewer.
TEST(SlabMaterials, KeepTheToleranceInVoxelsOfUnequalSides) {
  ControlMesh mesh = oracle::box_mesh(12, 1, 1, 3);
  mesh.channel_names = {"a", "b", "c"};
  for (const Vec3& p : mesh.positions) {
    const double x = (p.x() - 18) / 18;
    for (const double value :
         {p.z() / 3, std::sqrt((1 + x * x) / 2), 0.5 + 0.5 * std::sin(p.x() / 6 + p.y() * p.z() / 3)})
      mesh.channel_values.push_back(static_cast<float>(value));
  }
  const Solid solid = prepare_solid(mesh);
  SliceJob job = job_of(solid, {0.1073067024728656, 0.013619929671635878, 0.02826310380267215});
  job.planes.push_back(channel(solid, 1, SampleType::kFloat32));
  job.planes.push_back(channel(solid, 2, SampleType::kFloat32));
  const Comparison found = compare(solid, job, std::vector<std::uint32_t>{3, 4, 7, 10, 14, 18});
  EXPECT_LE(found.worst, kSlabTolerance);
  EXPECT_GT(static_cast<double>(found.interpolated), 0.8 * static_cast<double>(found.voxels));
}

// Positions and materials odd about the middle of each cell's row: errors of the fifth degree, which vanish at
// equidistant nodes of a cell in the middle.
TEST(SlabMaterials, SeeErrorsBetweenTheNodes) {
  ControlMesh mesh = oracle::box_mesh(7, 1, 1);
  oracle::sharpen_by_cells(mesh, 1);
  mesh.channel_names = {"odd"};
  mesh.channel_values.clear();
  for (Vec3& p : mesh.positions) {
    const double x = (p.x() - 35) / 35;
    mesh.channel_values.push_back(static_cast<float>(x * x * x));
    p.x() += 20 * x * x * x;
  }
  const Solid solid = prepare_solid(mesh);
  SliceJob job = job_of(solid, {0.1, 0.7, 0.7});
  for (double tolerance = 1.0 / 256; tolerance > 1e-6; tolerance /= 1.5) {
    job.channel_tolerance = tolerance;
    EXPECT_LE(compare(solid, job, std::vector<std::uint32_t>{7}).worst, tolerance) << tolerance;
  }
}

// The engine's walls are cells of few voxels' thickness, through which its material changes from one end to the other:
// pieces thinner than a voxel, bulging, and voxels that lie off the surface by as much as contours may.
TEST(SlabMaterials, KeepTheToleranceInThinSteepCells) {
  struct Case {
    double coarser, tolerance;  // Times the printer's pitch.
    std::vector<std::uint32_t> layers;
  };
  const Solid solid = prepare_solid(make_engine());
  for (const auto& [coarser, tolerance, layers] :
       {Case{1, kSlabTolerance, {11, 35, 179, 219}}, Case{3, kSlabTolerance, {12, 23, 165, 177}},
        Case{4, kSlabTolerance, {17, 60}}, Case{3, 4e-3, {161, 163}}, Case{2, 2e-3, {26, 53, 89}}}) {
    SliceJob job = job_of(solid, {coarser * 0.0423, coarser * 0.0846, coarser * 0.03});
    job.channel_tolerance = tolerance;
    const Comparison found = compare(solid, job, layers);
    EXPECT_LE(found.worst, tolerance) << coarser;
    EXPECT_GT(static_cast<double>(found.interpolated), 0.45 * static_cast<double>(found.voxels)) << coarser;
  }
}

/// Rings of eight hexes each, side by side and on top of each other.
struct Rings {
  std::uint32_t radii = 0, levels = 0;                      // Of vertices.
  std::function<Vec3(std::uint32_t, std::uint32_t)> place;  // Radius, 0, height.
  std::function<bool(std::uint32_t, std::uint32_t)> has_cells = [](auto, auto) { return true; };
  std::function<double(std::uint32_t, std::uint32_t)> value = [](auto, auto) { return 0.0; };

  ControlMesh mesh() const {
    constexpr std::uint32_t kRound = 8;
    const auto vertex = [&](std::uint32_t i, std::uint32_t ring, std::uint32_t level) {
      return (level * radii + ring) * kRound + i % kRound;
    };
    ControlMesh mesh;
    mesh.channel_names = {"m"};
    for (std::uint32_t level = 0; level < levels; ++level) {
      for (std::uint32_t ring = 0; ring < radii; ++ring) {
        for (std::uint32_t i = 0; i < kRound; ++i) {
          const Eigen::AngleAxisd turn(2 * std::numbers::pi * i / kRound, Vec3::UnitZ());
          mesh.positions.push_back(turn * place(ring, level));
          mesh.channel_values.push_back(static_cast<float>(value(ring, level)));
        }
      }
    }
    for (std::uint32_t level = 0; level + 1 < levels; ++level) {
      for (std::uint32_t ring = 0; ring + 1 < radii; ++ring) {
        for (std::uint32_t i = 0; i < kRound && has_cells(ring, level); ++i) {
          mesh.cell_kinds.push_back(CellKind::kHex);
          for (const std::uint32_t v :
               {vertex(i, ring, level), vertex(i, ring + 1, level), vertex(i + 1, ring + 1, level),
                vertex(i + 1, ring, level), vertex(i, ring, level + 1), vertex(i, ring + 1, level + 1),
                vertex(i + 1, ring + 1, level + 1), vertex(i + 1, ring, level + 1)}) {
            mesh.cell_vertices.push_back(v);
          }
        }
      }
    }
    return mesh;
  }
};

/// A thin coat inside a ring, a region of its own: its channel is 1 there and 0 in the ring. All cells are regular.
ControlMesh coated_ring() {
  constexpr std::array kRadii = {19.5, 20.0, 24.0, 28.0};
  const Rings rings{kRadii.size(), 4, [&](auto ring, auto level) { return Vec3(kRadii[ring], 0, 2 * level); }};
  constexpr double kInTheCoat = 19.75;
  const ControlMesh mesh = oracle::with_regions(
      rings.mesh(), 2, [](const Vec3& middle) { return middle.head<2>().norm() < kInTheCoat ? 1 : 0; });
  return oracle::with_jumping_channels(mesh, {"coat"}, [](std::uint32_t, std::uint8_t region) {
    return std::vector<float>{static_cast<float>(region)};
  });
}

// Flat triangles of the ring's pieces reach into the coat, whose cells are too small for pieces.
TEST(SlabMaterials, PaintNothingBeyondAnInterface) {
  const Solid solid = prepare_solid(coated_ring());
  const Comparison found = compare(solid, job_of(solid, {0.15, 0.15, 0.3}));
  EXPECT_LE(found.worst, kSlabTolerance);
  EXPECT_GT(static_cast<double>(found.interpolated), 0.8 * static_cast<double>(found.voxels));
}

// One body: a plate holds a tube of small cells and, `gap` around it, a ring of large ones, whose faces flat triangles
// miss by more than that. Both lobes have materials of their own.
TEST(SlabMaterials, PaintNothingBeyondASlit) {
  constexpr std::uint32_t kSlit = 3;
  for (const double gap : {0.03, 0.005}) {
    const std::array<double, 7> radii = {18.5 - gap, 19 - gap, 19.5 - gap, 20 - gap, 20, 24, 28};
    const Rings rings{radii.size(), 5, [&](auto ring, auto level) { return Vec3(radii[ring], 0, 2 * level); },
                      [](auto ring, auto level) { return ring != kSlit || level < 1; },
                      [](auto ring, auto level) { return ring <= kSlit && level >= 2 ? 1 : 0; }};
    const Solid solid = prepare_solid(rings.mesh());
    const Comparison found = compare(solid, job_of(solid, {0.15, 0.15, 0.4}));
    EXPECT_LE(found.worst, kSlabTolerance) << gap;
    EXPECT_GT(static_cast<double>(found.interpolated), 0.5 * static_cast<double>(found.voxels)) << gap;
  }
}

// A smooth material that is constant in the large cells of a ring and begins to rise in a coat of small ones, of which
// some lie within the large ones' bulge. Upwards the coat gets thinner.
TEST(SlabMaterials, FollowNoSmoothMaterialIntoThinCells) {
  for (const double thinnest : {0.1, 1.0}) {
    constexpr std::array kRadii = {19.6, 19.7, 19.8, 19.9, 20.0, 24.0, 28.0};
    const Rings rings{kRadii.size(), 3,
                      [&](auto ring, auto level) {
                        return Vec3(20 + (kRadii[ring] - 20) * (1 - (1 - thinnest) * level / 2), 0, 2 * level);
                      },
                      [](auto, auto) { return true; }, [](auto ring, auto) { return ring <= 2 ? 1 : 0; }};
    const Solid solid = prepare_solid(rings.mesh());
    SliceJob job = job_of(solid, {0.15, 0.15, 0.15});
    job.channel_tolerance = 1.0 / 65536;
    const Comparison found = compare(solid, job);
    EXPECT_LE(found.worst, 1.0 / 65536 + kRoundingOfFloats) << thinnest;
    EXPECT_GT(static_cast<double>(found.interpolated), 0.5 * static_cast<double>(found.voxels)) << thinnest;
  }
}

class PaintedSlabs : public testing::Test {
 protected:
  PaintedSlabs() : solid_(prepare_solid(make_bracket())), job_(job_of(solid_, {0.3, 0.3, 0.25})) {
    job_.channel_tolerance = kSlabTolerance;
  }
  Solid solid_;
  SliceJob job_;
};

TEST_F(PaintedSlabs, DependOnThemselvesAlone) {
  LayerSlicer upwards(solid_, job_), downwards(solid_, job_);
  std::vector<Layer> up, down;
  for (std::uint32_t k = 0; k < job_.grid.extent.layers; ++k) up.push_back(upwards.slice(k, {}));
  for (std::uint32_t k = job_.grid.extent.layers; k-- > 0;) down.push_back(downwards.slice(k, {}));
  std::reverse(down.begin(), down.end());
  for (std::size_t k = 0; k < up.size(); ++k) {
    EXPECT_TRUE(up[k].planes[1].bytes == down[k].planes[1].bytes) << k;
    EXPECT_EQ(up[k].stats.voxels_interpolated, down[k].stats.voxels_interpolated) << k;
  }
}

TEST_F(PaintedSlabs, CanBeCancelled) {
  LayerSlicer cancelled(solid_, job_), other(solid_, job_);
  const CancellationToken token = CancellationToken::make();
  token.cancel();
  EXPECT_THROW(cancelled.slice(2, token), Error);
  EXPECT_TRUE(cancelled.slice(2, {}).planes[1].bytes == other.slice(2, {}).planes[1].bytes);
}

}  // namespace
}  // namespace ccslice
