// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Text for manual pages.

#pragma once

#include <string>

namespace ccslice {

/// The text as roff shows it as it is: backslashes, hyphens, and dots that begin a line are no commands.
std::string roff(const std::string& text);

}  // namespace ccslice
