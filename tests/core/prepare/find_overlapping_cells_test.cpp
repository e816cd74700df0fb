// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using std::numbers::pi;

/// Cubes of 10 mm with sharp edges.
ControlMesh box(int x, int y, int z) {
  ControlMesh mesh = oracle::box_mesh(x, y, z);
  oracle::sharpen_by_cells(mesh, 1);
  return mesh;
}

Overlaps overlaps_of(const ControlMesh& mesh, int threads = 1) {
  PrepareOptions options;
  options.threads = threads;
  return prepare_solid(mesh, options)->summary().overlaps;
}

/// A box, and one inside or beside it as a part of its own.
Overlaps overlaps_of(const ControlMesh& first, const ControlMesh& second, const Vec3& offset) {
  ControlMesh mesh = first;
  oracle::append_mesh(mesh, second, offset);
  return overlaps_of(mesh);
}

void scale(ControlMesh& mesh, double factor) {
  for (Vec3& p : mesh.positions) p *= factor;
}

TEST(FindOverlappingCells, TellsHowDeepTheArmsOfASpiralOverlap) {
  for (const bool as_meshed : {false, true}) {
    for (const double depth_mm : {0.02, 0.1, 0.3}) {
      SCOPED_TRACE(std::to_string(depth_mm) + (as_meshed ? " mm as meshed" : " mm"));
      ControlMesh mesh = oracle::spiral(-depth_mm);
      mesh.as_meshed = as_meshed;
      const Overlaps found = overlaps_of(mesh);
      EXPECT_NEAR(found.depth_mm, depth_mm, 0.1 * depth_mm);
      EXPECT_FALSE(found.at_least);
      ASSERT_FALSE(found.places.empty());
      for (const OverlapPlace& place : found.places) {
        // The two turns meet about 48 cells of each of the band's four rows apart.
        EXPECT_LT(place.cell, place.other);
        EXPECT_NEAR(static_cast<double>(place.other - place.cell), 4 * oracle::kBandCellsPerTurn, 10);
        const double radius = place.position.head<2>().norm();
        EXPECT_GT(radius, 4.9 - depth_mm);
        EXPECT_LT(radius, 6.1);
        EXPECT_LE(place.depth_mm, found.depth_mm);
      }
    }
  }
}

TEST(FindOverlappingCells, MeasuresTheVolumeThatIsThereTwice) {
  ControlMesh mesh = oracle::spiral(-0.02);
  mesh.as_meshed = true;
  // One turn of 2 mm height, at radii from 4.98 to 5.96 mm.
  EXPECT_NEAR(overlaps_of(mesh).volume_mm3, 0.02 * 2 * 2 * pi * 5.47, 0.1);
  // The overlap is a box. Its cells' faces are those of the overlap in no direction.
  EXPECT_NEAR(overlaps_of(box(3, 3, 3), box(3, 3, 3), Vec3(17, 13, 14)).volume_mm3, 13 * 17 * 16, 350);
}

TEST(FindOverlappingCells, FindsNoneAcrossASlit) {
  for (const bool as_meshed : {false, true}) {
    for (const double gap_mm : {0.02, 0.005, 0.5}) {
      ControlMesh mesh = oracle::spiral(gap_mm);
      mesh.as_meshed = as_meshed;
      const Overlaps found = overlaps_of(mesh);
      EXPECT_EQ(found.cells, 0u) << gap_mm;
      EXPECT_TRUE(found.places.empty());
      EXPECT_EQ(found.depth_mm, 0);
      EXPECT_EQ(found.volume_mm3, 0);
    }
  }
}

TEST(FindOverlappingCells, FindsNoneWhereAPartTouchesItself) {
  for (const bool as_meshed : {false, true}) {
    ControlMesh ring = oracle::band_along(std::vector<double>(oracle::kBandCellsPerTurn + 1, 4)),
                turns = oracle::spiral(0);
    ring.as_meshed = turns.as_meshed = as_meshed;
    EXPECT_EQ(overlaps_of(ring).cells, 0u);
    EXPECT_EQ(overlaps_of(turns).cells, 0u);
  }
}

TEST(FindOverlappingCells, FindsNoneBetweenPartsSideBySide) {
  for (const Vec3& offset : {Vec3(30, 0, 0), Vec3(30, 5, 5), Vec3(30, 30, 0), Vec3(30, 30, 30), Vec3(30.0005, 3, 0)}) {
    EXPECT_EQ(overlaps_of(box(3, 3, 3), box(3, 3, 3), offset).cells, 0u) << offset.transpose();
  }
  // A ring in a ring, of the same faces where they meet.
  ControlMesh inner = make_ring(), outer = make_ring();
  for (Vec3& p : inner.positions) p.head<2>() *= 54.47 / 83.53;
  oracle::append_mesh(outer, inner, Vec3::Zero());
  EXPECT_EQ(overlaps_of(outer).cells, 0u);
}

TEST(FindOverlappingCells, FindsPartsInsideOthers) {
  ControlMesh core = box(1, 1, 1);
  const Overlaps inside = overlaps_of(box(3, 3, 3), core, Vec3(11, 12, 13));
  EXPECT_NEAR(inside.volume_mm3, 1000, 200);
  EXPECT_GT(inside.cells, 8u);
  EXPECT_GT(inside.depth_mm, 0.5);
  // Flush with the other part's face, and in the middle of one of its cells.
  EXPECT_GT(overlaps_of(box(3, 3, 3), core, Vec3(10, 10, 0)).cells, 0u);
  scale(core, 0.1);
  EXPECT_NEAR(overlaps_of(box(1, 1, 1), core, Vec3(4.3, 4.5, 4.2)).volume_mm3, 1, 0.3);
}

TEST(FindOverlappingCells, FindsPartsThatOverlapFlush) {
  // Sides of both lie in the same planes.
  for (const Vec3& offset : {Vec3(15, 0, 0), Vec3(20, 0, 0), Vec3(29.9, 0, 0), Vec3(29.98, 29.98, 0)}) {
    const Overlaps found = overlaps_of(box(3, 3, 3), box(3, 3, 3), offset);
    EXPECT_GT(found.cells, 0u) << offset.transpose();
    const Vec3 common = Vec3::Constant(30) - offset;
    if (offset.y() == 0) {
      EXPECT_NEAR(found.volume_mm3, common.prod(), 0.3 * common.prod()) << offset.transpose();
    }
  }
}

TEST(FindOverlappingCells, FindsAPartThatIsThereTwice) {
  const Overlaps found = overlaps_of(box(3, 3, 3), box(3, 3, 3), Vec3::Zero());
  EXPECT_EQ(found.cells, 2 * 27u);
  EXPECT_NEAR(found.volume_mm3, 27000, 1);
}

TEST(FindOverlappingCells, LeavesFoldsAlone) {
  ControlMesh folding = oracle::folding_box_mesh();
  folding.allow_folds = true;
  EXPECT_EQ(overlaps_of(folding).cells, 0u);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) EXPECT_EQ(overlaps_of(mesh).cells, 0u) << name;
}

TEST(FindOverlappingCells, FindsNoneInTheSamples) {
  for (const SampleModel& sample : sample_models()) {
    ControlMesh mesh = sample.make();
    EXPECT_EQ(overlaps_of(mesh).cells, 0u) << sample.name;
    mesh.sharp_edges.clear(), mesh.sharp_vertices.clear();
    mesh.as_meshed = true;
    EXPECT_EQ(overlaps_of(mesh).cells, 0u) << sample.name << " as meshed";
  }
}

TEST(FindOverlappingCells, IsTheSameForAnyNumberOfThreads) {
  for (const double gap_mm : {-0.02, -0.7}) {
    const Overlaps one = overlaps_of(oracle::spiral(gap_mm), 1), four = overlaps_of(oracle::spiral(gap_mm), 4);
    EXPECT_EQ(one.cells, four.cells);
    EXPECT_EQ(one.volume_mm3, four.volume_mm3);
    EXPECT_EQ(one.depth_mm, four.depth_mm);
    ASSERT_EQ(one.places.size(), four.places.size());
    for (std::size_t n = 0; n < one.places.size(); ++n) {
      EXPECT_EQ(one.places[n].cell, four.places[n].cell);
      EXPECT_EQ(one.places[n].other, four.places[n].other);
      EXPECT_EQ(one.places[n].position, four.places[n].position);
      EXPECT_EQ(one.places[n].depth_mm, four.places[n].depth_mm);
    }
  }
}

TEST(FindOverlappingCells, MakesWhatItFindsAmbiguous) {
  const auto solid = prepare_solid(oracle::spiral(-0.3));
  const LimitSolid::Data& data = solid->data();
  EXPECT_TRUE(data.fold_cells.empty());
  // Half a turn on the two arms have radii from 5.35 to 5.5 mm in common; a quarter of the height is as good as any.
  for (const double turn : {0.25, 0.5, 0.75}) {
    const double radius = 5.0 - 0.15 + 0.7 * turn, angle = 2 * pi * turn;
    const Vec3 both(radius * std::cos(angle), radius * std::sin(angle), 1);
    EXPECT_TRUE(data.is_ambiguous(Box3(both, both)));
  }
  const Vec3 first_arm(4.2, 0.6, 1);
  EXPECT_FALSE(data.is_ambiguous(Box3(first_arm, first_arm)));
  EXPECT_EQ(prepare_solid(oracle::spiral(0.02))->data().fold_boxes.size(), 0u);
}

TEST(FindOverlappingCells, FindsNoneBetweenCurvedPartsInContact) {
  const Overlaps found = overlaps_of(oracle::nested_shells(2));
  EXPECT_EQ(found.cells, 0u);
  EXPECT_FALSE(found.at_least);
}

// Contacts use up the work that may be done.
TEST(FindOverlappingCells, FindsAPartInsideAnotherBesideManyInContact) {
  ControlMesh mesh = oracle::nested_shells(16);
  EXPECT_EQ(overlaps_of(mesh).cells, 0u);
  EXPECT_TRUE(overlaps_of(mesh).at_least) << "a search that was cut short has to say so";
  ControlMesh small = box(1, 1, 1);
  scale(small, 0.01);
  oracle::append_mesh(mesh, small, Vec3(10.2, 10.2, 10));
  const Overlaps found = overlaps_of(mesh);
  ASSERT_FALSE(found.places.empty());
  EXPECT_EQ(found.places.back().other, mesh.cell_count() - 1);
}

TEST(FindOverlappingCells, EndsWhereEverythingOverlaps) {
  ControlMesh mesh = box(3, 3, 3);
  const ControlMesh one = mesh;
  for (int n = 1; n < 40; ++n) oracle::append_mesh(mesh, one, Vec3::Constant(0.01 * n));
  const Overlaps found = overlaps_of(mesh);
  EXPECT_TRUE(found.at_least);
  EXPECT_GT(found.cells, 100u);
  EXPECT_EQ(found.places.size(), 32u);
}

TEST(FindOverlappingCells, EndsWhenCancelled) {
  PrepareOptions options;
  options.cancel = CancellationToken::make();
  ControlMesh mesh = oracle::spiral(-0.02);
  options.cancel.cancel();
  EXPECT_THROW((void)prepare_solid(mesh, options), Error);
}

}  // namespace
}  // namespace ccslice
