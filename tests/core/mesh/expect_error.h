// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/error.h"

namespace ccslice {

/// Expects `action` to throw an Error of that code whose message holds `part`.
template <typename Action>
void expect_error(const Action& action, ErrorCode code, const std::string& part) {
  try {
    action();
    ADD_FAILURE() << "no error, expected " << reason(code);
  } catch (const Error& error) {
    EXPECT_EQ(reason(error.code()), reason(code)) << error.what();
    EXPECT_THAT(error.what(), testing::HasSubstr(part));
  }
}

}  // namespace ccslice
