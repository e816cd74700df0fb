// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/part_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/base/text_values.h"
#include "client/job.h"

namespace ccslice::cli {
namespace {

using testing::ElementsAre;

v1::SliceJob placed(const PartOptions& options) {
  v1::Placement lifted;
  for (const double entry : {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 5.0}) lifted.add_matrix(entry);
  v1::SliceJob job = client::job_of("", lifted);
  place_parts("parts/ring.ccmesh", options, job);
  return job;
}

TEST(PartPlaces, LeaveAJobOfOnePartAsItIs) {
  const v1::SliceJob job = placed({});
  ASSERT_EQ(job.parts_size(), 1);
  EXPECT_EQ(job.parts(0).name(), "");
  EXPECT_THAT(job.parts(0).placements(0).matrix(), ElementsAre(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5));
}

TEST(PartPlaces, AreThoseOfCopiesOfASinglePart) {
  const v1::SliceJob job = placed({{}, {"1,2,3", "-4,0,0"}});
  ASSERT_EQ(job.parts_size(), 1);
  ASSERT_EQ(job.parts(0).placements_size(), 2);
  EXPECT_THAT(job.parts(0).placements(0).matrix(), ElementsAre(1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 8));
  EXPECT_THAT(job.parts(0).placements(1).matrix(), ElementsAre(1, 0, 0, -4, 0, 1, 0, 0, 0, 0, 1, 5));
}

TEST(PartPlaces, AreOneForEachOfSeveralParts) {
  const v1::SliceJob job = placed({{"lid.vtk", "other/ring.vtk"}, {"0,0,0", "40,0,0", "0,60,0"}});
  ASSERT_EQ(job.parts_size(), 3);
  EXPECT_EQ(job.parts(0).name(), "ring");
  EXPECT_EQ(job.parts(1).name(), "lid");
  EXPECT_EQ(job.parts(2).name(), "ring-2");
  EXPECT_THAT(job.parts(1).placements(0).matrix(), ElementsAre(1, 0, 0, 40, 0, 1, 0, 0, 0, 0, 1, 5));
  EXPECT_THAT(job.parts(2).placements(0).matrix(), ElementsAre(1, 0, 0, 0, 0, 1, 0, 60, 0, 0, 1, 5));
}

TEST(PartPlaces, MayBeLeftOut) {
  const v1::SliceJob job = placed({{"lid.vtk"}, {}});
  EXPECT_THAT(job.parts(1).placements(0).matrix(), ElementsAre(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5));
}

TEST(PartPlaces, AreAsManyAsParts) {
  EXPECT_THROW(placed({{"lid.vtk"}, {"1,2,3"}}), UsageError);
  EXPECT_THROW(placed({{"lid.vtk"}, {"1,2,3", "1,2,3", "1,2,3"}}), UsageError);
  EXPECT_THROW(placed({{}, {"1,2"}}), UsageError);
}

}  // namespace
}  // namespace ccslice::cli
