// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/upload.h"

#include <gtest/gtest.h>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

template <class Body>
ServiceErrorCode code_of(Body&& body) {
  try {
    body();
  } catch (const ServiceError& error) {
    return error.code();
  }
  return ServiceErrorCode{};
}

class UploadTest : public ::testing::Test {
 protected:
  MemoryBudget budget_{1000};
  Upload upload_{budget_, 500};
  const std::string abc_ = mesh_id_of("abcdef");
};

TEST_F(UploadTest, CollectsChunksAndChecksTheDigest) {
  upload_.start(abc_, 6);
  upload_.append("abc");
  upload_.append("");
  upload_.append("def");
  upload_.finish();
  EXPECT_EQ(upload_.bytes().blocks(), std::vector<std::string>{"abcdef"}) << "small chunks are put together";
  EXPECT_EQ(budget_.used_bytes(), 6u);
  upload_.bytes().release();
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

TEST_F(UploadTest, RefusesSizesOfZeroAndAboveTheLimit) {
  EXPECT_EQ(code_of([&] { upload_.start(abc_, 0); }), ServiceErrorCode::kUploadSizeInvalid);
  EXPECT_EQ(code_of([&] { upload_.start(abc_, 501); }), ServiceErrorCode::kUploadSizeInvalid);
  EXPECT_FALSE(upload_.started());
}

TEST_F(UploadTest, RefusesWrongIds) {
  EXPECT_EQ(code_of([&] { upload_.start("sha256:x", 6); }), ServiceErrorCode::kMeshIdInvalid);
}

TEST_F(UploadTest, TakesNothingBeforeTheStartNorTwoStarts) {
  EXPECT_EQ(code_of([&] { upload_.append("a"); }), ServiceErrorCode::kRequestMalformed);
  EXPECT_EQ(code_of([&] { upload_.finish(); }), ServiceErrorCode::kRequestMalformed);
  upload_.start(abc_, 6);
  EXPECT_EQ(code_of([&] { upload_.start(abc_, 6); }), ServiceErrorCode::kRequestMalformed);
}

TEST_F(UploadTest, AClaimedSizeAllocatesNothing) {
  upload_.start(abc_, 500);
  EXPECT_EQ(budget_.used_bytes(), 0u);
  EXPECT_TRUE(upload_.bytes().blocks().empty());
}

TEST_F(UploadTest, NoticesTooFewAndTooManyBytes) {
  upload_.start(abc_, 6);
  upload_.append("abcde");
  EXPECT_EQ(code_of([&] { upload_.finish(); }), ServiceErrorCode::kUploadTruncated);
  EXPECT_EQ(code_of([&] { upload_.append("fg"); }), ServiceErrorCode::kUploadOverrun);
}

TEST_F(UploadTest, NoticesOtherBytes) {
  upload_.start(abc_, 6);
  upload_.append("abcdeX");
  EXPECT_EQ(code_of([&] { upload_.finish(); }), ServiceErrorCode::kUploadDigestMismatch);
}

TEST_F(UploadTest, AllUploadsShareTheBudgetAndGiveItBack) {
  MemoryBudget budget(10);
  {
    Upload first(budget, 500);
    Upload second(budget, 500);
    first.start(abc_, 8);
    second.start(abc_, 8);
    first.append("12345678");
    EXPECT_EQ(code_of([&] { second.append("123"); }), ServiceErrorCode::kServerBusy);
    second.append("12");
    EXPECT_EQ(budget.used_bytes(), 10u);
  }
  EXPECT_EQ(budget.used_bytes(), 0u);
}

TEST_F(UploadTest, UploadsOfOneClientLeaveAQuarterToOthersAndTheLargestOneAloneFits) {
  MemoryBudget budget(1000);
  {
    Upload first(budget, 1000, "one"), second(budget, 1000, "one"), other(budget, 1000, "other");
    for (Upload* const upload : {&first, &second, &other}) upload->start(abc_, 1000);
    first.append(std::string(500, 'x'));
    second.append(std::string(250, 'x'));
    EXPECT_EQ(code_of([&] { second.append("x"); }), ServiceErrorCode::kServerBusy);
    other.append(std::string(250, 'x'));
  }
  Upload largest(budget, 1000, "one");
  largest.start(abc_, 1000);
  for (int i = 0; i < 10; ++i) largest.append(std::string(100, 'x'));
  EXPECT_EQ(budget.used_bytes(), 1000u);
}

TEST_F(UploadTest, BytesThatCountElsewhereComeBackWhereThereIsRoom) {
  MemoryBudget budget(10);
  Upload upload(budget, 1000);
  upload.start(abc_, 6);
  upload.append("abcabc");
  upload.bytes().leave_budget();
  EXPECT_EQ(budget.used_bytes(), 0u);
  EXPECT_FALSE(upload.bytes().is_in_budget());
  EXPECT_EQ(upload.bytes().size(), 6u);
  EXPECT_EQ(upload.bytes().blocks().size(), 1u);
  MemoryBudget::Share others(budget);
  ASSERT_TRUE(others.resize(5));
  EXPECT_FALSE(upload.bytes().enter_budget());
  EXPECT_EQ(upload.bytes().size(), 6u);
  others.give_back();
  EXPECT_TRUE(upload.bytes().enter_budget());
  EXPECT_TRUE(upload.bytes().is_in_budget());
  EXPECT_TRUE(upload.bytes().enter_budget());
  EXPECT_EQ(budget.used_bytes(), 6u);
  upload.bytes().release();
  EXPECT_EQ(budget.used_bytes(), 0u);
  EXPECT_EQ(upload.bytes().size(), 0u);
}

TEST(UploadPace, WantsEnoughBytesInEachWhile) {
  using std::chrono::seconds;
  const UploadPace::Clock::time_point begin{};
  UploadPace pace(100, begin);
  EXPECT_NO_THROW(pace.count(1, begin + seconds(1))) << "not before ten seconds are over";
  EXPECT_NO_THROW(pace.count(1000, begin + seconds(10)));
  EXPECT_NO_THROW(pace.count(999, begin + seconds(19)));
  try {
    pace.count(0, begin + seconds(20));
    ADD_FAILURE() << "999 bytes in ten seconds";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), ServiceErrorCode::kUploadTooSlow);
    EXPECT_NE(std::string(error.what()).find("100 a second"), std::string::npos);
  }
  UploadPace any(0, begin);
  EXPECT_NO_THROW(any.count(0, begin + seconds(1000)));
}

}  // namespace
}  // namespace ccslice::server
