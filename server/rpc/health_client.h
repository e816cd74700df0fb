// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The client's side of a health check: `ccsliced --health-check`.

#pragma once

#include <string>

namespace ccslice::server {

/// What a container's health check asks: whether the server at `address` serves. `explanation` says why not.
[[nodiscard]] bool check_health(const std::string& address, std::string& explanation);

}  // namespace ccslice::server
