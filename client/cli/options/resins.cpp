// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/resins.h"

#include <algorithm>
#include <array>

#include "core/base/choice_text.h"

namespace ccslice::cli {
namespace {

struct Resin {
  std::string name;
  std::uint32_t rgba;
};

/// Colours tell resins apart in pictures; they aren't what a print looks like. Those of the first four, and the grey of
/// clear resins, are what public writers and viewers of .gcvf have. Black is the background's.
const std::array<Resin, 11>& resins() {
  static const std::array<Resin, 11> all = {{{"VeroCY-V", 0x00ffffff},
                                             {"VeroMGT-V", 0xff00ffff},
                                             {"VeroYL-V", 0xffff00ff},
                                             {"VUltraWhite", 0xffffffff},
                                             {"VeroUltraClear", 0x898989ff},
                                             {"VeroClear", 0x9a9a9aff},
                                             {"VeroPureWht", 0xf0f0f0ff},
                                             {"VeroBlack", 0x1e1e1eff},
                                             {"Agilus30Clr", 0xc8d2dcff},
                                             {"Agilus30Wht", 0xe6e6dcff},
                                             {"Agilus30Blk", 0x3c3c3cff}}};
  return all;
}

}  // namespace

std::optional<std::uint32_t> resin_colour(std::string_view name) {
  const auto found = std::ranges::find(resins(), name, &Resin::name);
  if (found == resins().end()) return std::nullopt;
  return found->rgba;
}

std::string resin_names() { return choice_text(resins()); }

}  // namespace ccslice::cli
