// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// PolyJet resins by the names that GrabCAD has for them.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ccslice::cli {

/// The colour that stands for a resin in pictures, 0xRRGGBBAA, by the name that GrabCAD has for it. Nothing for other
/// names.
std::optional<std::uint32_t> resin_colour(std::string_view name);
/// "VeroCY-V, VeroMGT-V, ...".
std::string resin_names();

}  // namespace ccslice::cli
