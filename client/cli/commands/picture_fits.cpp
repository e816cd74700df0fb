// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/picture_fits.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/base/text_values.h"
#include "core/base/choice_text.h"

namespace ccslice::cli {
namespace {

/// Each bit is a kind of picture.
enum Trait : unsigned {
  kSpace = 1 << 0,
  kPlane = 1 << 1,
  kLayer = 1 << 2,
  kSweep = 1 << 3,
  kFile = 1 << 4,
  kTerminal = 1 << 5,
  kAnimation = 1 << 6,
  kChannel = 1 << 7,
  kMix = 1 << 8,
  kHalftone = 1 << 9,
  kPrinted = 1 << 10,
  kCut = kPlane | kLayer | kSweep,
  kMaterials = kMix | kHalftone | kPrinted,
};

struct TraitText {
  unsigned trait;
  std::string_view name, asked_by;
};

constexpr std::array<TraitText, 11> kTraits = {{
    {kSpace, "the part in space", "without --plane, --layer, --sweep and --terminal"},
    {kPlane, "a cut", "--plane"},
    {kLayer, "a layer", "--layer"},
    {kSweep, "a sweep", "--sweep"},
    {kFile, "a file", "no --terminal"},
    {kTerminal, "the terminal", "--terminal"},
    {kAnimation, "an animation", "--animate"},
    {kChannel, "the values of a channel", "--show channel, or no more than --channel to colour by"},
    {kMix, "a mix of materials", "--show mix"},
    {kHalftone, "a halftone", "--show halftone"},
    {kPrinted, "printed materials in space", "no --channel and --cell-regions"},
}};

/// An option that fits pictures with one of the traits. Others fit all.
struct Fit {
  const char* option;
  unsigned traits;
};

/// Options that have to fit twice have two rows.
constexpr std::array<Fit, 40> kFits = {{
    {"MORE", kLayer},
    {"--at", kLayer},
    {"--job", kLayer},
    {"--plane", kPlane | kSweep},
    {"--sweep", kSweep},
    {"--terminal", kPlane | kLayer},
    {"-o", kFile},
    {"--force", kFile},
    {"--show", kCut},
    {"--channel", kChannel},
    {"--colours", kCut},
    {"--colours", kChannel},
    {"--colours", kFile},
    {"--range", kCut},
    {"--range", kChannel},
    {"--lines", kCut},
    {"--animate", kSweep},
    {"--frame-ms", kAnimation},
    {"--cut", kSpace},
    {"--view", kSpace},
    {"--voxels", kSpace},
    {"--cell-regions", kSpace},
    {"--no-legend", kSpace},
    {"--pixels", kSpace | kPlane | kSweep | kTerminal},
    {"--material", kMaterials},
    {"--map", kMaterials},
    {"--where", kMaterials},
    {"--shell", kMaterials},
    {"--keep-out", kMaterials},
    {"--strict", kMaterials},
    {"--halftone", kHalftone | kPrinted},
    {"--seed", kHalftone | kPrinted},
    {"--printer", kLayer | kHalftone},
    {"--pitch", kLayer | kHalftone},
    {"--dpi", kLayer | kHalftone},
    {"--layer-height", kLayer | kHalftone},
    {"--origin", kLayer | kHalftone},
    {"--extent", kLayer},
    {"--box", kLayer},
    {"--box-voxels", kLayer},
}};

unsigned kind_of(const PictureOptions& options) {
  if (options.layer) return kLayer;
  if (options.sweep > 0) return kSweep;
  return options.in_space() ? kSpace : kPlane;
}

unsigned content_of(const PictureOptions& options, bool has_materials) {
  const std::string shown = what_to_show(options, has_materials);
  if (shown == "channel") return kChannel;
  if (shown == "mix") return kMix;
  if (shown == "halftone") return options.in_space() ? kPrinted : kHalftone;
  return 0;
}

std::string text_of(unsigned traits, bool with_options) {
  struct Choice {
    std::string name;
  };
  std::vector<Choice> choices;
  for (const TraitText& row : kTraits) {
    if ((row.trait & traits) == 0) continue;
    choices.push_back({std::string(row.name) + (with_options ? " (" + std::string(row.asked_by) + ")" : "")});
  }
  return choice_text(choices);
}

}  // namespace

void describe_fits(CLI::App& command) {
  const char* before = "";
  for (const Fit& fit : kFits) {
    CLI::Option& option = *command.get_option(fit.option);
    const bool again = std::string_view(before) == fit.option;
    option.description(option.get_description() + (again ? "; " : ". For ") + text_of(fit.traits, false));
    before = fit.option;
  }
}

void check_fits(const CLI::App& command, const PictureOptions& options, bool has_materials) {
  const unsigned traits = kind_of(options) | (options.terminal ? kTerminal : kFile) |
                          (options.animate ? kAnimation : 0u) | content_of(options, has_materials);
  for (const Fit& fit : kFits) {
    if (command.count(fit.option) == 0 || (fit.traits & traits) != 0) continue;
    const std::string option = fit.option;
    throw UsageError(option + " is for " + text_of(fit.traits, true) + ": ask for that, or leave " + option + " out");
  }
}

}  // namespace ccslice::cli
