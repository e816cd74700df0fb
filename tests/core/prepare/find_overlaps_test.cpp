// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "core/limit/solid_data.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Two boxes of 3 x 3 x 3 cubes of 10 mm, the second one moved.
std::shared_ptr<const LimitSolid> two_boxes(const Vec3& offset) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  const ControlMesh one = mesh;
  oracle::append_mesh(mesh, one, offset);
  return prepare_solid(mesh);
}

/// Cells of the first box come first.
std::uint32_t part_of(const LimitSolid& solid, LimitCellId cell) { return cell < solid.cell_count() / 2 ? 0 : 1; }

TEST(FindOverlaps, FindsTheCellsWhoseBoxesMeetThoseOfTheOtherPart) {
  for (const Vec3& offset : {Vec3(25, 1, 1), Vec3(5, -5, 15), Vec3(29, 29, 29), Vec3(0.5, 0.5, 0.5)}) {
    const auto solid = two_boxes(offset);
    const LimitSolid::Data& data = solid->data();
    ASSERT_EQ(data.parts.size(), solid->cell_count());
    for (const LimitCellId cell : solid->cells()) {
      EXPECT_EQ(data.parts[cell], part_of(*solid, cell));
      const Box3 box = data.cell_boxes.box(cell);
      bool meets = false;
      for (const LimitCellId other : solid->cells()) {
        meets |= part_of(*solid, cell) != part_of(*solid, other) && box.intersects(data.cell_boxes.box(other));
      }
      const bool found = data.overlap_boxes.any_meeting(
          box, [&](std::uint32_t item) { return data.overlap_boxes.box(item).isApprox(box, 1e-12); });
      EXPECT_EQ(found, meets) << "cell " << cell << ", offset " << offset.transpose();
    }
    const Vec3 within = Vec3::Constant(15) + 0.5 * offset;  // Half way between the middles, in both.
    EXPECT_TRUE(data.is_ambiguous(Box3(within, within)));
  }
}

TEST(FindOverlaps, FindsNoneWherePartsAreApart) {
  for (const Vec3& offset : {Vec3(31, 0, 0), Vec3(-60, 40, 0)}) {
    const auto solid = two_boxes(offset);
    EXPECT_TRUE(solid->data().parts.empty());
    EXPECT_FALSE(solid->data().is_ambiguous(Box3(Vec3::Constant(-100), Vec3::Constant(100))));
  }
}

TEST(FindOverlaps, FindsNoneInOnePart) {
  const auto solid = prepare_solid(oracle::tiny_mesh("cross_of_seven"));
  EXPECT_TRUE(solid->data().parts.empty());
}

}  // namespace
}  // namespace ccslice
