// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/map_overrides.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "client/cli/options/map_text.h"
#include "core/base/number_text.h"

namespace ccslice::cli {
namespace {

constexpr const char* kDepthField = "--shell";

/// Takes "region:NAME=" away, if the text begins with it.
std::optional<std::string> take_region(const std::string& option, std::string& text) {
  constexpr std::string_view kRegion = "region:";
  if (!text.starts_with(kRegion)) return std::nullopt;
  auto [region, rest] = parse_region(option + " region takes REGION=...", text.substr(kRegion.size()));
  text = std::move(rest);
  return std::move(region);
}

/// CHANNEL<VALUE=MATERIAL, with the channel's name between quotation marks or not.
v1::MapOverride parse_where(const std::string& text) {
  const std::string taken = "--where takes CHANNEL<VALUE=MATERIAL, as in 'depth<0.5=hard'";
  const bool is_above = text.find('<') == std::string::npos && text.find('>') != std::string::npos;
  if (is_above) {
    throw UsageError(taken + ", not '" + text +
                     "'; for what is above a value compare the negative: --field 'm=-depth'");
  }
  const auto [bound, material] = parse_pair(taken, text);
  const std::size_t less = bound.rfind('<');
  const bool has_bound = less != std::string::npos && less > 0 && is_number(std::string_view(bound).substr(less + 1));
  if (!has_bound) throw UsageError(taken + ", not '" + text + "'");
  v1::MapOverride result;
  result.set_channel(unquoted(std::string_view(bound).substr(0, less)));
  result.set_below(parse_number("--where", std::string_view(bound).substr(less + 1)));
  result.set_material(material);
  return result;
}

v1::MapOverride of_depth(double below_mm, const std::string& material) {
  v1::MapOverride result;
  result.set_channel(kDepthField);
  result.set_below(below_mm);
  result.set_material(material);
  return result;
}

/// The distances that the formula distance() takes.
double parse_depth(const std::string& option, std::string_view text) {
  constexpr double kLeastMm = 0.001, kMostMm = 1e6;
  const double mm = parse_number(option, text);
  if (mm >= kLeastMm && mm <= kMostMm) return mm;
  throw UsageError(option + " takes 0.001 to 1000000 mm, not '" + std::string(text) + "'");
}

/// A shell's own thickness stands for where it ends.
v1::MapOverride parse_shell(const std::string& text) {
  const auto [thickness, material] = parse_pair("--shell takes MM=MATERIAL, as in '0.5=VeroBlack'", text);
  return of_depth(parse_depth("--shell", thickness), material);
}

v1::MapOverride parse_keep_out(const std::string& text) {
  const std::string taken = "--keep-out takes MATERIAL=MM:INSTEAD, as in 'LIQUID=0.8:VeroClear'";
  const auto [kept_out, rest] = parse_pair(taken, text);
  const std::size_t colon = rest.find(':');
  if (colon == std::string::npos || colon + 1 == rest.size()) throw UsageError(taken + ", not '" + text + "'");
  const double mm = parse_depth("--keep-out", std::string_view(rest).substr(0, colon));
  v1::MapOverride result = of_depth(mm, rest.substr(colon + 1));
  result.set_instead_of(kept_out);
  return result;
}

template <typename Parse>
void add_parsed(const std::string& option, const std::vector<std::string>& texts, const Parse& parse,
                std::vector<RegionOverride>& all) {
  for (std::string text : texts) {
    std::optional<std::string> region = take_region(option, text);
    all.push_back({std::move(region), parse(text)});
  }
}

}  // namespace

void add_override_options(CLI::App& command, OverrideOptions& options, CLI::Option& material) {
  const OptionGroup group(command, "Materials");
  const auto add = [&](const std::string& name, std::vector<std::string>& texts, const std::string& help) {
    command.add_option(name, texts, help)->allow_extra_args(false)->needs(&material);
  };
  add("--where", options.where,
      "Make all of one material what has less than this of a channel or field, before any --map is asked: "
      "CHANNEL<VALUE=MATERIAL, as in 'depth<0.5=hard' for a shell. May be repeated, the first that holds "
      "counts; without a --map the first --material takes the rest. region:NAME=CHANNEL<VALUE=MATERIAL is for one "
      "cell region, and goes before those for all");
  add("--shell", options.shells,
      "Make all of one material what is less than so many mm below the surface: MM=MATERIAL, as in "
      "'0.5=VeroBlack'. A second one lies under the first. --where goes before them, and they before any --map. "
      "region:NAME=MM=MATERIAL is for one cell region. docs/fields.md says how exact they are");
  add("--keep-out", options.keep_outs,
      "Keep a material away from the surface: MATERIAL=MM:INSTEAD, as in 'LIQUID=0.8:VeroClear'. No voxel less than "
      "so many mm below the surface is of it, whatever --map, --where and --shell say: the other one takes its "
      "place. 'void=1:VeroClear' closes pores. May be repeated; region:NAME=MATERIAL=MM:INSTEAD is for one cell "
      "region");
}

std::vector<RegionOverride> parse_overrides(const OverrideOptions& options) {
  std::vector<RegionOverride> all;
  add_parsed("--where", options.where, parse_where, all);
  const std::size_t first_shell = all.size();
  add_parsed("--shell", options.shells, parse_shell, all);
  std::map<std::optional<std::string>, double> ends_mm;
  for (std::size_t i = first_shell; i < all.size(); ++i) {
    double& end_mm = ends_mm[all[i].region];
    end_mm += all[i].added.below();
    all[i].added.set_below(end_mm);
  }
  add_parsed("--keep-out", options.keep_outs, parse_keep_out, all);
  std::ranges::stable_partition(all, [](const RegionOverride& own) { return own.region.has_value(); });
  return all;
}

std::optional<v1::Field> parse_depth_field(const OverrideOptions& options) {
  double reach_mm = 0;
  for (const RegionOverride& own : parse_overrides(options)) {
    if (own.added.channel() == kDepthField) reach_mm = std::max(reach_mm, own.added.below());
  }
  if (reach_mm == 0) return std::nullopt;
  v1::Field field;
  field.set_name(kDepthField);
  field.set_formula("distance(" + number_text(reach_mm) + ")");
  return field;
}

}  // namespace ccslice::cli
