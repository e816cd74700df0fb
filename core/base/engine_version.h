// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a client compares before it puts layers of two servers together.

#pragma once

#include <string_view>

namespace ccslice {

/// Changes whenever the same request may give other bytes than before: clients refuse to mix layers of different
/// versions.
inline constexpr std::string_view kEngineVersion = "38";

}  // namespace ccslice
