// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/printing.h"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "client/cli/options/map_text.h"
#include "client/cli/options/resins.h"

namespace ccslice::cli {
namespace {

std::uint32_t parse_colour(const std::string& option, const std::string& text) {
  std::uint32_t colour = 0;
  const std::string_view digits = std::string_view(text).substr(text.empty() ? 0 : 1);
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), colour, 16);
  const bool whole = status == std::errc() && end == digits.data() + digits.size();
  if (!text.starts_with('#') || !whole || (digits.size() != 6 && digits.size() != 8)) {
    throw UsageError(option + " takes a colour as #RRGGBB or #RRGGBBAA, not '" + text + "'");
  }
  return digits.size() == 8 ? colour : colour << 8 | 0xff;
}

/// Reads --material. A void without a colour gets the background's.
v1::PrintMaterial parse_material(const std::string& text, const v1::Printing& printing) {
  constexpr std::string_view kVoid = "void";
  constexpr std::uint32_t kBlack = 0xff;
  v1::PrintMaterial material;
  if (text == kVoid) {
    material.set_name(text);
    material.set_rgba(printing.has_background_rgba() ? printing.background_rgba() : kBlack);
  } else if (const std::optional<std::uint32_t> colour = resin_colour(text)) {
    material.set_name(text);
    material.set_rgba(*colour);
  } else {
    const auto [name, rgba] = parse_pair(
        "--material takes NAME=#RRGGBB, the name of a resin that `ccslice printers` lists, or void for nothing", text);
    material.set_name(name);
    material.set_rgba(parse_colour("--material", rgba));
  }
  material.set_leaves_empty(material.name() == kVoid);
  const bool is_alike = std::ranges::equal(
      material.name(), kVoid, [](char a, char b) { return a == b || (a >= 'A' && a <= 'Z' && a - 'A' + 'a' == b); });
  if (is_alike && !material.leaves_empty()) {
    throw UsageError("--material " + material.name() + ": write void, in small letters, for nothing, or another name");
  }
  return material;
}

/// Splits at commas, but for those in a name in quotation marks that a piece begins with.
std::vector<std::string> split_behind_quotes(std::string_view text) {
  std::vector<std::string> pieces;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t closing = text.substr(begin, 1) == "\"" ? text.find("\"=", begin + 1) : std::string_view::npos;
    const std::size_t end = std::min(text.find(',', closing == std::string_view::npos ? begin : closing), text.size());
    pieces.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return pieces;
}

/// A channel's name, between quotation marks or not, and what follows behind the colon. Names may hold colons
/// themselves, so without quotation marks the last `parts` parts between colons follow.
std::pair<std::string, std::string> split_off_channel(const std::string& text, int parts) {
  if (text.starts_with('"')) {
    const std::size_t closing = text.find("\":", 1);
    if (closing == std::string::npos) return {};
    return {text.substr(1, closing - 1), text.substr(closing + 2)};
  }
  std::size_t colon = text.size();
  for (int part = 0; part < parts; ++part) {
    colon = colon == 0 ? std::string::npos : text.rfind(':', colon - 1);
    if (colon == std::string::npos) return {};
  }
  return {text.substr(0, colon), text.substr(colon + 1)};
}

void parse_direct(const std::string& pairs, v1::DirectMap& map) {
  for (const std::string& text : split_behind_quotes(pairs)) {
    const auto [channel, material] = parse_pair("--map direct takes CHANNEL=MATERIAL", text);
    if (channel == "rest") {
      map.set_rest_material(material);
      continue;
    }
    v1::DirectShare& share = *map.add_shares();
    share.set_channel(unquoted(channel));
    share.set_material(material);
  }
}

void parse_blend(const std::string& text, v1::BlendMap& map) {
  const auto [channel, stops] = split_off_channel(text, 1);
  if (channel.empty()) throw UsageError("--map blend takes CHANNEL:VALUE=MATERIAL,..., not '" + text + "'");
  map.set_channel(channel);
  for (const std::string& pair : split(stops, ',')) {
    const auto [value, material] = parse_pair("--map blend takes VALUE=MATERIAL", pair);
    v1::BlendStop& stop = *map.add_stops();
    stop.set_value(parse_number("--map", value));
    stop.set_material(material);
  }
}

void parse_calibration(const std::string& text, v1::CalibrationMap& map) {
  const auto [channel, rest] = split_off_channel(text, 2);
  const std::vector<std::string> parts = split(rest, ':');
  if (channel.empty() || parts.size() != 2) {
    throw UsageError("--map calibration takes CHANNEL:MATERIAL/BASE:PROPERTY=FRACTION,..., not '" + text + "'");
  }
  map.set_channel(channel);
  const std::vector<std::string> names = split(parts[0], '/');
  if (names.size() != 2) throw UsageError("--map calibration takes MATERIAL/BASE, not '" + parts[0] + "'");
  map.set_material(names[0]);
  map.set_base(names[1]);
  for (const std::string& pair : split(parts[1], ',')) {
    const auto [property, fraction] = parse_pair("--map calibration takes PROPERTY=FRACTION", pair);
    v1::CalibrationPoint& point = *map.add_points();
    point.set_property(parse_number("--map", property));
    point.set_fraction(parse_number("--map", fraction));
  }
}

/// R,G,B with or without a full value behind the last colon. A number there may belong to a name with colons; such
/// names need quotation marks.
void parse_colour_map(const std::string& text, v1::ColourMap& map) {
  std::vector<std::string> names;
  bool has_bare_colon = false;
  std::string_view rest = text;
  while (names.size() < 3) {
    const bool quoted = rest.starts_with('"');
    const std::size_t closing = quoted ? rest.find('"', 1) : std::string_view::npos;
    std::size_t end = std::min(rest.find(',', closing == std::string_view::npos ? 0 : closing), rest.size());
    if (names.size() == 2 && end == rest.size()) {
      const std::size_t colon = rest.rfind(':');
      const bool ends = colon != std::string_view::npos && (closing == std::string_view::npos || colon > closing);
      if (ends && is_number(rest.substr(colon + 1))) end = colon;
    }
    const std::string_view name = rest.substr(0, end);
    has_bare_colon |= !quoted && name.find(':') != std::string_view::npos;
    names.push_back(unquoted(name));
    rest = rest.substr(end);
    if (names.size() < 3 && !rest.starts_with(',')) break;
    if (names.size() < 3) rest.remove_prefix(1);
  }
  if (names.size() != 3 || rest.starts_with(',')) {
    throw UsageError("--map colour takes three channels, not '" + text + "'");
  }
  if (has_bare_colon && !rest.empty()) {
    throw UsageError("--map colour:" + text +
                     " can be read in two ways: put channels' names with colons between quotation marks, as in "
                     "'colour:\"S:1\",\"S:2\",\"S:3\"'");
  }
  map.set_red_channel(names[0]);
  map.set_green_channel(names[1]);
  map.set_blue_channel(names[2]);
  if (!rest.empty()) map.set_full_value(parse_number("--map", rest.substr(1)));
}

v1::MaterialMap parse_map(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string kind = text.substr(0, colon), rest = text.substr(std::min(colon + 1, text.size()));
  v1::MaterialMap map;
  if (kind == "direct" && !rest.empty()) {
    parse_direct(rest, *map.mutable_direct());
  } else if (kind == "blend" && !rest.empty()) {
    parse_blend(rest, *map.mutable_blend());
  } else if (kind == "calibration" && !rest.empty()) {
    parse_calibration(rest, *map.mutable_calibration());
  } else if (kind == "colour" && !rest.empty()) {
    parse_colour_map(rest, *map.mutable_colour());
  } else if (kind == "material" && !rest.empty()) {
    map.set_material(rest);
  } else {
    throw UsageError(
        "--map takes direct:..., blend:..., calibration:..., colour:..., material:... or region:..., as in its help, "
        "not '" +
        text + "'");
  }
  return map;
}

void add_region_map(const std::string& region, v1::MaterialMap map, v1::Printing& printing) {
  v1::CellRegionMap& own = *printing.add_cell_region_maps();
  own.set_cell_region(region);
  *own.mutable_map() = std::move(map);
}

/// Whether what follows the next comma belongs to a region's map, and doesn't begin another region. Maps by names of
/// their own before '=' take all that follows.
bool goes_on(std::string_view map, std::string_view piece) {
  if (map.find(':') == std::string_view::npos) return false;  // A material.
  const std::size_t equals = piece.find('=');
  return equals == std::string_view::npos || map.starts_with("direct:") || map.starts_with("calibration:") ||
         (map.starts_with("blend:") && is_number(piece.substr(0, equals)));
}

/// Regions with a map or a material each: "core=blend:x:0=soft,1=hard,shell=hard".
void parse_region_maps(const std::string& text, v1::Printing& printing) {
  std::vector<std::pair<std::string, std::string>> regions;
  for (const std::string& piece : split_behind_quotes(text)) {
    if (!regions.empty() && goes_on(regions.back().second, piece)) {
      regions.back().second += "," + piece;
    } else {
      regions.push_back(parse_region("--map region takes REGION=MAP or REGION=MATERIAL", piece));
    }
  }
  for (const auto& [region, map] : regions) {
    v1::MaterialMap own;
    if (map.find(':') == std::string::npos) {
      own.set_material(map);
    } else {
      own = parse_map(map);
    }
    add_region_map(region, std::move(own), printing);
  }
}

/// The map of a region. A region without a map of its own gets a copy of the map for all.
v1::MaterialMap& map_of_region(const std::string& region, v1::Printing& printing) {
  auto& maps = *printing.mutable_cell_region_maps();
  const auto own = std::ranges::find(maps, region, &v1::CellRegionMap::cell_region);
  if (own != maps.end()) return *own->mutable_map();
  if (!printing.has_map()) {
    throw UsageError("--where, --shell or --keep-out: cell region '" + region +
                     "' has no map; give --map for all, or --map region:... for it");
  }
  add_region_map(region, printing.map(), printing);
  return *maps.rbegin()->mutable_map();
}

template <class Change>
void change_maps(v1::Printing& printing, const Change& change) {
  if (printing.has_map()) change(*printing.mutable_map());
  for (v1::CellRegionMap& own : *printing.mutable_cell_region_maps()) change(*own.mutable_map());
}

void parse_maps(const std::vector<std::string>& texts, v1::Printing& printing) {
  constexpr std::string_view kRegion = "region:";
  for (const std::string& text : texts) {
    if (text.starts_with(kRegion)) {
      parse_region_maps(text.substr(kRegion.size()), printing);
      continue;
    }
    if (printing.has_map()) {
      throw UsageError("--map '" + text +
                       "' is a second map for everything; write region:NAME=... for one cell region");
    }
    *printing.mutable_map() = parse_map(text);
  }
}

/// Adds --where, --shell and --keep-out to the maps of all regions, or to that of one. Without a map the first material
/// takes what is left.
void add_overrides(const PrintingOptions& options, v1::Printing& printing) {
  const std::vector<RegionOverride> overrides = parse_overrides(options.overrides);
  if (overrides.empty()) return;
  const bool has_map = printing.has_map() || !printing.cell_region_maps().empty();
  if (!has_map) printing.mutable_map()->set_material(printing.materials(0).name());
  for (const RegionOverride& own : overrides) {
    if (own.region) map_of_region(*own.region, printing);
  }
  for (const RegionOverride& own : overrides) {
    if (own.region) {
      *map_of_region(*own.region, printing).add_overrides() = own.added;
    } else {
      change_maps(printing, [&](v1::MaterialMap& map) { *map.add_overrides() = own.added; });
    }
  }
}

v1::HalftoneMethod method_of(const std::string& name) {
  if (name == "error-diffusion") return v1::HALFTONE_METHOD_ERROR_DIFFUSION;
  if (name == "largest-fraction") return v1::HALFTONE_METHOD_LARGEST_FRACTION;
  if (name == "white-noise") return v1::HALFTONE_METHOD_WHITE_NOISE;
  return v1::HALFTONE_METHOD_BLUE_NOISE;
}

double parse_density(std::string_view text) {
  const double density = parse_number("--density", text);
  if (density > 0) return density;
  throw UsageError("--density: a material of " + std::string(text) +
                   " g/cm3 weighs nothing; leave it out if it isn't known");
}

void set_density(std::string_view text, v1::Printing& printing) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string_view::npos) {
    const double density = parse_density(text);
    for (v1::PrintMaterial& material : *printing.mutable_materials()) {
      if (!material.leaves_empty()) material.set_density_g_per_cm3(density);
    }
    return;
  }
  const std::string name(text.substr(0, equals));
  const auto named = std::ranges::find(*printing.mutable_materials(), name, &v1::PrintMaterial::name);
  if (named == printing.mutable_materials()->end()) {
    throw UsageError("--density: there is no --material '" + name + "'");
  }
  if (named->leaves_empty()) throw UsageError("--density: void weighs nothing; leave it out");
  named->set_density_g_per_cm3(parse_density(text.substr(equals + 1)));
}

}  // namespace

void add_printing_options(CLI::App& command, PrintingOptions& options) {
  const OptionGroup group(command, "Materials");
  CLI::Option* material =
      command
          .add_option("--material", options.materials,
                      "A material that the printer holds: NAME=#RRGGBB or #RRGGBBAA, or just the name of "
                      "a PolyJet resin as GrabCAD has it (" +
                          resin_names() +
                          "). void is nothing: voxels of it are left empty. May be "
                          "repeated, up to 8 times. Writes a picture with one material for each voxel")
          ->allow_extra_args(false);
  command
      .add_option("--density", options.densities,
                  "Grams of a cubic centimetre, to weigh what is printed: NAME=1.18, or 1.18 for all materials. May be "
                  "repeated")
      ->allow_extra_args(false)
      ->needs(material);
  command
      .add_option(
          "--map", options.maps,
          "How channels mix them: blend:CHANNEL:0=soft,0.5=mid,1=hard; direct:CH1=soft,CH2=hard,rest=clear; "
          "calibration:CHANNEL:hard/soft:PROPERTY=FRACTION,...; colour:R,G,B[:255]; or none: material:hard. Names of "
          "channels may hold colons; between quotation marks, as in blend:\"S:1\":..., anything. May be "
          "repeated for cell regions: region:core=blend:...,shell=soft; a map after direct or calibration needs a "
          "--map of its own")
      ->allow_extra_args(false)
      ->needs(material);
  add_override_options(command, options.overrides, *material);
  command.add_option("--halftone", options.halftone, "How one material is chosen for each voxel")
      ->check(CLI::IsMember({"blue-noise", "error-diffusion", "largest-fraction", "white-noise"}))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Choose another pattern of the same fractions")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--strict", options.strict, "Refuse values that give no fractions instead of clamping them");
}

void add_background_option(CLI::App& command, PrintingOptions& options) {
  command
      .add_option("--background", options.background, "Colour outside, #RRGGBB or #RRGGBBAA (default: opaque black)")
      ->group("Materials");
}

std::optional<v1::Printing> parse_printing(const PrintingOptions& options) {
  if (options.materials.empty()) return std::nullopt;
  v1::Printing printing;
  if (!options.background.empty()) printing.set_background_rgba(parse_colour("--background", options.background));
  for (const std::string& text : options.materials) {
    *printing.add_materials() = parse_material(text, printing);
  }
  for (const std::string& text : options.densities) set_density(text, printing);
  parse_maps(options.maps, printing);
  add_overrides(options, printing);
  if (options.strict) change_maps(printing, [](v1::MaterialMap& map) { map.set_strict(true); });
  printing.mutable_halftone()->set_method(method_of(options.halftone));
  printing.mutable_halftone()->set_seed(options.seed);
  return printing;
}

}  // namespace ccslice::cli
