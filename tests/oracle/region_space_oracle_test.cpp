// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels of cell regions, halftoned and as masks, against the winding number of each region's limit surface in space,
// which OpenSubdiv evaluates. Nothing here knows the core's contours or cells.

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/support/brute_force.h"
#include "tests/support/cell_regions.h"
#include "tests/support/solid_angle.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kSpaceToleranceMm = 1e-3;
/// What the oracle's own quads and Newton may be off.
constexpr double kOracleMm = 2e-4;

/// A ball in a shell: cubes whose shells are drawn towards spheres. Channel "depth" goes from the middle outwards.
ControlMesh nested_balls() {
  ControlMesh mesh = box_mesh(5, 5, 5, 6);
  const Vec3 middle = Vec3::Constant(15);
  mesh.channel_names = {"depth"};
  mesh.channel_values.clear();
  for (Vec3& p : mesh.positions) {
    const Vec3 arm = p - middle;
    const double shell = arm.cwiseAbs().maxCoeff();
    if (shell > 0) p = middle + arm * (0.4 + 0.6 * shell / arm.norm());
    mesh.channel_values.push_back(static_cast<float>(shell / 15));
  }
  return with_regions(mesh, 2, [=](const Vec3& p) { return (p - middle).norm() < 10 ? 0 : 1; });
}

/// A bent bar of five regions, one after the other.
ControlMesh bar_of_five() {
  ControlMesh mesh = box_mesh(10, 2, 2, 5);
  mesh.channel_names = {"along"};
  mesh.channel_values.clear();
  for (Vec3& p : mesh.positions) {
    mesh.channel_values.push_back(static_cast<float>(p.x() / 50));
    p.z() += 0.006 * (p.x() - 25) * (p.x() - 25);
  }
  return with_regions(mesh, 5, [](const Vec3& p) { return static_cast<int>(p.x() / 10); });
}

/// Each region of a pure material of its own but the last, which blends two. Planes: regions, materials, and the mask
/// of each material.
SliceJob printed_job(const ControlMesh& mesh) {
  SliceJob job;
  Printing& printing = job.printing.emplace();
  const auto regions = static_cast<std::uint32_t>(mesh.cell_region_names.size());
  for (std::uint32_t m = 1; m <= regions + 1; ++m) {
    printing.materials.push_back({.name = "m" + std::to_string(m), .rgba = m << 24 | 0xffu});
  }
  for (std::uint32_t r = 0; r + 1 < regions; ++r) {
    printing.cell_region_maps.push_back(
        {.cell_region = static_cast<std::uint8_t>(r), .map = {.kind = PureMap{.material = r + 1}}});
  }
  printing.map.kind = BlendMap{.channel = mesh.channel_names[0], .stops = {{0, regions}, {1, regions + 1}}};
  const auto add_plane = [&](PlaneContent content, SampleType type) -> PlaneSpec& {
    PlaneSpec& plane = job.planes.emplace_back();
    plane.content = content;
    plane.sample_type = type;
    plane.encoding = Encoding::kRaw;
    return plane;
  };
  add_plane(PlaneContent::kCellRegions, SampleType::kUint8);
  add_plane(PlaneContent::kMaterials, SampleType::kUint8);
  for (std::uint32_t m = 1; m <= regions + 1; ++m) {
    add_plane(PlaneContent::kMaterialMask, SampleType::kBit).material = m;
  }
  return job;
}

/// The limit surface of each region.
class RegionsInSpace {
 public:
  explicit RegionsInSpace(const ControlMesh& mesh) {
    for (std::size_t r = 0; r < mesh.cell_region_names.size(); ++r) {
      const BruteMesh part = to_brute_mesh(region_as_mesh(mesh, static_cast<int>(r)));
      surfaces_.emplace_back(part, build_topology(part.cells, part.vertex_count()));
    }
    for (const BfrSurface& surface : surfaces_) {
      windings_.emplace_back(surface, 64);
      nearest_.emplace_back(surface, 16);
    }
  }

  bool has(std::size_t region, const Vec3& point) const { return windings_[region].number_at(point) > 0.5; }
  double distance(std::size_t region, const Vec3& point) const { return nearest_[region].distance(point); }
  std::size_t count() const { return surfaces_.size(); }

 private:
  std::vector<BfrSurface> surfaces_;
  std::vector<SurfaceWinding> windings_;
  std::deque<NearestOnSurface> nearest_;
};

struct Met {
  std::vector<std::size_t> voxels;  // By region.
  std::size_t beside = 0;           // On the wrong side, within the tolerance.
};

bool bit_of(const EncodedPlane& plane, std::uint32_t columns, std::uint32_t x, std::uint32_t y) {
  return plane.bytes[std::size_t{(columns + 7) / 8} * y + x / 8] >> (7 - x % 8) & 1;
}

/// The planes of materials say what the plane of regions says.
void expect_materials_of_regions(const Layer& layer, std::uint32_t columns, std::uint32_t x, std::uint32_t y,
                                 std::size_t regions) {
  const std::size_t at = std::size_t{columns} * y + x;
  const std::uint8_t number = layer.planes[0].bytes[at], material = layer.planes[1].bytes[at];
  if (number < regions) {
    ASSERT_EQ(material, number);
  } else {
    ASSERT_TRUE(material == regions || material == regions + 1) << int{material};
  }
  for (std::size_t m = 1; m <= regions + 1; ++m) {
    ASSERT_EQ(bit_of(layer.planes[1 + m], columns, x, y), m == material) << m;
  }
}

/// Compares all voxels of the job's region.
void compare_voxels(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job, const RegionsInSpace& space,
                    Met& met) {
  met.voxels.resize(space.count());
  const VoxelBox region = region_of(job);
  LayerSlicer slicer(solid, job);
  for (std::uint32_t k = region.first_layer; k < region.end_layer(); ++k) {
    const Layer layer = slicer.slice(k, {});
    for (std::uint32_t y = 0; y < region.extent.rows; ++y) {
      for (std::uint32_t x = 0; x < region.extent.columns; ++x) {
        SCOPED_TRACE("voxel " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(k));
        expect_materials_of_regions(layer, region.extent.columns, x, y, space.count());
        if (testing::Test::HasFatalFailure()) return;
        const std::uint8_t number = layer.planes[0].bytes[std::size_t{region.extent.columns} * y + x];
        if (number > 0) ++met.voxels[number - 1u];
        const Vec3 centre = job.grid.lattice().centre(region.first_column + x, region.first_row + y, layer.z_mm);
        for (std::size_t r = 0; r < space.count(); ++r) {
          if (space.has(r, centre) == (number == r + 1)) continue;
          ++met.beside;
          ASSERT_LE(space.distance(r, centre), kSpaceToleranceMm + kOracleMm)
              << "region " << r << " against " << int{number};
        }
      }
    }
  }
}

void expect_voxels_in_their_regions(const ControlMesh& mesh, const VoxelPitch& pitch) {
  const auto solid = prepare_solid(mesh);
  const RegionsInSpace space(mesh);
  SliceJob job = printed_job(mesh);
  GridRequest request;
  request.pitch = pitch;
  job.grid = plan_grid(*solid, job.placement, request);
  Met met;
  compare_voxels(solid, job, space, met);
  for (const std::size_t count : met.voxels) EXPECT_GT(count, 1000u);
}

/// Voxels of a micrometre round a place of an interface: a grid of their own, for a whole one would be too large.
void expect_micrometres_in_their_regions(const ControlMesh& mesh, const Vec3& near, std::size_t one,
                                         std::size_t other) {
  const auto solid = prepare_solid(mesh);
  const RegionsInSpace space(mesh);
  // Along x from a place of one region to a place of the other.
  Vec3 low = near, high = near;
  while (space.has(one, high)) high.x() += 0.5;
  for (int i = 0; i < 40; ++i) {
    const Vec3 middle = 0.5 * (low + high);
    (space.has(one, middle) ? low : high) = middle;
  }
  SliceJob job = printed_job(mesh);
  constexpr double kPitchMm = 1e-3;
  GridRequest request;
  request.pitch = {kPitchMm, kPitchMm, kPitchMm};
  request.extent = GridExtent{.columns = 24, .rows = 24, .layers = 6};
  request.origin_mm = low - kPitchMm * Vec3(12, 12, 3);
  job.grid = plan_grid(*solid, job.placement, request);
  Met met;
  compare_voxels(solid, job, space, met);
  EXPECT_GT(met.voxels[one], 200u);
  EXPECT_GT(met.voxels[other], 200u);
}

TEST(RegionsInSpace, BallInAShell) { expect_voxels_in_their_regions(nested_balls(), {0.61, 0.67, 0.71}); }

TEST(RegionsInSpace, BarOfFive) { expect_voxels_in_their_regions(bar_of_five(), {0.31, 0.37, 0.41}); }

TEST(RegionsInSpace, BallInAShellByMicrometres) {
  expect_micrometres_in_their_regions(nested_balls(), Vec3(16, 17.3, 13.1), 0, 1);
}

TEST(RegionsInSpace, BarOfFiveByMicrometres) {
  expect_micrometres_in_their_regions(bar_of_five(), Vec3(15, 5.3, 5.1), 1, 2);
}

}  // namespace
}  // namespace ccslice::oracle
