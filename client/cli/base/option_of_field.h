// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Servers speak of the fields of a request; people have written options.

#pragma once

#include <string>
#include <string_view>

namespace ccslice::cli {

/// "--pitch" for "job.grid.pitch.x_mm", and for "grid.pitch.x_mm", as messages have it. Empty for fields that no option
/// sets.
std::string_view option_of_field(std::string_view field);

/// A server's message that begins with a field, with options in place of fields: "--pitch: -0.2 is not ...".
std::string in_terms_of_options(const std::string& message);

}  // namespace ccslice::cli
