// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/job_field.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace ccslice::server {
namespace {

/// What at_job() makes of an error of this field.
Error moved(const std::string& path, const std::string& field, const std::string& message) {
  try {
    at_job(path, [&] { throw Error(ErrorCode::kToleranceInvalid, message, field, {7}); });
  } catch (const Error& error) {
    return error;
  }
  return Error(ErrorCode::kInternal, "nothing was thrown");
}

TEST(AtJob, PutsThePathOfTheJobBeforeFieldAndMessage) {
  const Error error = moved("job", "planes[2].encoding", "planes[2].encoding: 17 is none; planes[2] has others");
  EXPECT_EQ(error.code(), ErrorCode::kToleranceInvalid);
  EXPECT_EQ(error.field(), "job.planes[2].encoding");
  EXPECT_STREQ(error.what(), "job.planes[2].encoding: 17 is none; planes[2] has others");
  EXPECT_EQ(error.ids(), std::vector<std::int64_t>{7});
}

TEST(AtJob, NamesFieldsAsTheContractDoes) {
  const auto field_of = [](const std::string& field) { return moved(kLayerJobPath, field, field + ": no").field(); };
  EXPECT_EQ(field_of("contour_tolerance_mm"), "plane.layer.job.tolerances.contour_mm");
  EXPECT_EQ(field_of("channel_tolerance"), "plane.layer.job.tolerances.channel");
  EXPECT_EQ(field_of("contours_by_cell_region"), "plane.layer.job.contours.by_cell_region");
  EXPECT_EQ(field_of("placements"), "plane.layer.job.placements") << "another field";
  EXPECT_EQ(field_of("content.channel"), "content.channel") << "beside the job";
}

TEST(AtJob, LeavesOtherErrorsAsTheyAre) {
  EXPECT_EQ(moved("job", "", "grid: no").field(), "");
  EXPECT_STREQ(moved("job", "", "grid: no").what(), "grid: no");
  EXPECT_STREQ(moved("job", "grid", "no grid").what(), "no grid");
  EXPECT_THROW(at_job("job", [] { throw std::runtime_error("grid"); }), std::runtime_error);
  EXPECT_EQ(at_job("job", [] { return 3; }), 3);
  try {
    at_job("job", [] { throw ServiceError(ServiceErrorCode::kPrinterUnknown, "printer: no", "printer", "a mesh"); });
    ADD_FAILURE() << "nothing was thrown";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.field(), "job.printer");
    EXPECT_EQ(error.mesh_id(), "a mesh");
  }
}

}  // namespace
}  // namespace ccslice::server
