// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The client's side of a health check: `ccsliced --health-check`.

#pragma once

#include <string>

namespace ccslice::server {

/// Whether the server at `address` serves. If it doesn't, `explanation` says why.
[[nodiscard]] bool check_health(const std::string& address, std::string& explanation);

}  // namespace ccslice::server
