// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/status.h"

#include <gtest/gtest.h>

#include <new>

#include "ccslice/v1/errors.pb.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

/// The contract's name of a number.
std::string name_of(int number) { return v1::ErrorReason_Name(static_cast<v1::ErrorReason>(number)); }

TEST(ToStatus, EveryCoreErrorHasAStatusAndTheContractsReason) {
  int reasons = 0;
  for (int number = 100; number < 400; ++number) {
    const auto code = static_cast<ErrorCode>(number);
    if (!v1::ErrorReason_IsValid(number)) {
      EXPECT_EQ(reason(code), "INTERNAL") << number << " is missing in errors.proto";
      continue;
    }
    ++reasons;
    EXPECT_EQ("ERROR_REASON_" + std::string(reason(code)), name_of(number));
    const Failure failure = failure_of(to_status(Error(code, "message", "field", {3, 5})));
    EXPECT_NE(failure.code, grpc::StatusCode::OK);
    EXPECT_EQ(failure.reason, reason(code));
    EXPECT_EQ(failure.domain, "ccslice");
    EXPECT_EQ(failure.field, "field");
    EXPECT_EQ(failure.ids, "3,5");
    EXPECT_EQ(failure.message, "message");
  }
  EXPECT_EQ(reasons, 80);
}

TEST(ToStatus, EveryServiceErrorHasAStatusAndTheContractsReason) {
  for (const ServiceErrorCode code : kServiceErrorCodes) {
    EXPECT_EQ("ERROR_REASON_" + std::string(reason(code)), name_of(static_cast<int>(code)));
    const Failure failure = failure_of(to_status(ServiceError(code, "message", "", "sha256:1")));
    EXPECT_NE(failure.code, grpc::StatusCode::OK);
    EXPECT_NE(failure.code, grpc::StatusCode::INTERNAL);
    EXPECT_EQ(failure.reason, reason(code));
  }
}

TEST(ToStatus, EveryReasonOfTheContractBelongsToAnError) {
  const google::protobuf::EnumDescriptor& reasons = *v1::ErrorReason_descriptor();
  for (int i = 0; i < reasons.value_count(); ++i) {
    const int number = reasons.value(i)->number();
    const std::string name = reasons.value(i)->name().substr(std::string("ERROR_REASON_").size());
    if (number == 0) continue;
    EXPECT_EQ(number < 500 ? reason(static_cast<ErrorCode>(number)) : reason(static_cast<ServiceErrorCode>(number)),
              name);
  }
}

TEST(ToStatus, AMissingMeshIsAFailedPreconditionThatNamesIt) {
  const Failure failure =
      failure_of(to_status(ServiceError(ServiceErrorCode::kMeshMissing, "message", "", "sha256:1")));
  EXPECT_EQ(failure.code, grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(failure.missing, "sha256:1");
}

TEST(ToStatus, PassingShortagesSayWhenToTryAgain) {
  EXPECT_TRUE(failure_of(to_status(ServiceError(ServiceErrorCode::kServerBusy, ""))).retry);
  EXPECT_TRUE(failure_of(to_status(ServiceError(ServiceErrorCode::kCacheFull, ""))).retry);
  EXPECT_FALSE(failure_of(to_status(ServiceError(ServiceErrorCode::kMeshExceedsCache, ""))).retry);
}

TEST(ToStatus, AnythingElseIsOutOfMemoryOrInternal) {
  EXPECT_EQ(failure_of(to_status(std::make_exception_ptr(std::bad_alloc()))).reason, "OUT_OF_MEMORY");
  EXPECT_EQ(failure_of(to_status(std::make_exception_ptr(std::runtime_error("x")))).reason, "INTERNAL");
  EXPECT_EQ(failure_of(to_status(std::make_exception_ptr(7))).code, grpc::StatusCode::INTERNAL);
}

}  // namespace
}  // namespace ccslice::server
