// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume/outside_share.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(OutsideShare, IsThatOfThePartsVolume) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.as_meshed = true;
  const auto solid = prepare_solid(mesh);
  const Box3 box = solid->summary().bounding_box;
  const auto share_where = [&](double first, bool in_world, const Placement& placement) {
    VolumeReading reading;
    const Vec3 size = box.sizes();
    reading.index_of_mm = size.cwiseInverse().asDiagonal();  // One cell as large as the part.
    reading.first_index = -(box.min() + first * Vec3(size.x(), 0, 0)).cwiseQuotient(size) - Vec3::Constant(0.5);
    reading.in_world = in_world;
    const auto one = std::make_shared<const Volume>(VolumeShape{}, std::vector<std::byte>(1));
    const VolumeSource source({"v", 0, 1}, one, reading);
    const VolumeSource* const sources[] = {&source, &source};
    const std::vector<double> shares = shares_outside(sources, *solid, placement);
    EXPECT_EQ(shares[0], shares[1]);
    return shares[0];
  };
  const Placement here = Placement::Identity();
  EXPECT_EQ(share_where(0, false, here), 0);
  EXPECT_NEAR(share_where(0.5, false, here), 0.5, 1e-9);
  EXPECT_NEAR(share_where(0.25, false, here), 0.25, 1e-9);
  EXPECT_EQ(share_where(2, false, here), 1);
  const Placement moved(Eigen::Translation3d(0.5 * box.sizes().x(), 0, 0));
  EXPECT_EQ(share_where(0, false, moved), 0);
  EXPECT_NEAR(share_where(0, true, moved), 0.5, 1e-9);
}

}  // namespace
}  // namespace ccslice
