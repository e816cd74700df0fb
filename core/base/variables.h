// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The variables of the environment that begin with CCSLICE_. A misspelled one would change nothing, and nobody would
// notice, so the server and the command line refuse those that none of our programs reads. Each takes those of the
// others: they start each other, and are started by scripts.

#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ccslice {

inline constexpr std::string_view kVariablePrefix = "CCSLICE_";

/// The variables of ccsliced's options, without the prefix, in order.
std::span<const std::string_view> server_variables();

/// Says which variable is unknown, which one is nearest to it, and what to do. Empty if there is none. What Kubernetes
/// tells of services of such a name (CCSLICE_SERVICE_HOST) is known.
/// `environment`: NAME=VALUE each, and null at the end, as `environ` is.
std::string describe_unknown_variable(const char* const* environment);

}  // namespace ccslice
