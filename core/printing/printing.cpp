// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/printing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/choice_text.h"
#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/channel/channel_table.h"

namespace ccslice {
namespace {

[[noreturn]] void refuse(ErrorCode code, const std::string& field, const std::string& what) {
  throw Error(code, field + ": " + what, field);
}

std::string item(const std::string& list, std::size_t index) { return list + "[" + std::to_string(index) + "]"; }

void check_name(const PrintMaterial& material, const std::string& path) {
  if (material.name.empty()) refuse(ErrorCode::kMaterialNameInvalid, path + ".name", "empty; give it a name");
  if (material.name.size() <= kMaxMaterialNameBytes) return;
  refuse(ErrorCode::kMaterialNameInvalid, path + ".name",
         "longer than " + std::to_string(kMaxMaterialNameBytes) + " bytes; shorten it");
}

// The parts of one map. Fields are those of the message.
class MapCheck {
 public:
  MapCheck(const Printing& printing, const ChannelTable& channels, std::string path)
      : printing_(printing), channels_(channels), path_(std::move(path)) {}

  void operator()(std::monostate) const {
    if (printing_.materials.size() == 1) return;
    refuse(ErrorCode::kMaterialMapMissing, path_,
           "missing; say how the channels mix " + std::to_string(printing_.materials.size()) + " materials");
  }

  void operator()(const PureMap& map) const { check_material(map.material, path_ + ".material"); }

  void operator()(const DirectMap& map) const {
    const std::string path = path_ + ".direct";
    check_count(map.shares.size(), 1, kMaxPrintMaterials, path + ".shares");
    std::vector<std::uint32_t> used;
    for (std::size_t i = 0; i < map.shares.size(); ++i) {
      const std::string share = item(path + ".shares", i);
      channels_.require(map.shares[i].channel, share + ".channel");
      check_material(map.shares[i].material, share + ".material");
      check_unused(used, map.shares[i].material, share + ".material");
      used.push_back(map.shares[i].material);
    }
    if (map.rest_material == 0) return;
    check_material(map.rest_material, path + ".rest_material");
    check_unused(used, map.rest_material, path + ".rest_material");
  }

  void operator()(const BlendMap& map) const {
    const std::string path = path_ + ".blend";
    channels_.require(map.channel, path + ".channel");
    check_count(map.stops.size(), 2, kMaxBlendStops, path + ".stops");
    for (std::size_t i = 0; i < map.stops.size(); ++i) {
      const std::string stop = item(path + ".stops", i);
      check_material(map.stops[i].material, stop + ".material");
      check_step(i == 0 ? nullptr : &map.stops[i - 1].value, map.stops[i].value, stop + ".value");
    }
  }

  void operator()(const CalibrationMap& map) const {
    const std::string path = path_ + ".calibration";
    channels_.require(map.channel, path + ".channel");
    check_material(map.material, path + ".material");
    check_material(map.base, path + ".base");
    check_unused({map.material}, map.base, path + ".base");
    check_count(map.points.size(), 2, kMaxCurvePoints, path + ".points");
    for (std::size_t i = 0; i < map.points.size(); ++i) {
      const std::string point = item(path + ".points", i);
      check_step(i == 0 ? nullptr : &map.points[i - 1].property, map.points[i].property, point + ".property");
      check_fraction(map.points[i].fraction, point + ".fraction");
    }
  }

  void operator()(const ColourMap& map) const {
    const std::string path = path_ + ".colour";
    channels_.require(map.red, path + ".red_channel");
    channels_.require(map.green, path + ".green_channel");
    channels_.require(map.blue, path + ".blue_channel");
    check_finite(map.full_value, path + ".full_value");
    if (map.full_value > 0) return;
    refuse(ErrorCode::kMaterialMapInvalid, path + ".full_value",
           number_text(map.full_value) + " isn't a brightness; give a positive one, such as 1 or 255");
  }

  void check_overrides(const std::vector<MapOverride>& overrides) const {
    if (overrides.size() > kMaxMapOverrides) {
      refuse(ErrorCode::kMaterialMapInvalid, path_ + ".overrides",
             std::to_string(overrides.size()) + " of them; give at most " + std::to_string(kMaxMapOverrides));
    }
    for (std::size_t i = 0; i < overrides.size(); ++i) {
      const std::string path = item(path_ + ".overrides", i);
      channels_.require(overrides[i].channel, path + ".channel");
      check_finite(overrides[i].below, path + ".below");
      check_material(overrides[i].material, path + ".material");
      if (overrides[i].instead_of != 0) check_kept_out(overrides, i, path);
    }
  }

 private:
  void check_material(std::uint32_t material, const std::string& field) const {
    if (material >= 1 && material <= printing_.materials.size()) return;
    refuse(ErrorCode::kMaterialUnknown, field, "there is no material " + std::to_string(material));
  }

  /// Refuses an override that gives a material which another one, or itself, keeps out.
  void check_kept_out(const std::vector<MapOverride>& overrides, std::size_t i, const std::string& path) const {
    check_material(overrides[i].instead_of, path + ".instead_of");
    for (std::size_t j = 0; j < overrides.size(); ++j) {
      if (overrides[j].instead_of != overrides[i].material) continue;
      const std::string name = '"' + echoed(printing_.materials[overrides[i].material - 1].name) + '"';
      refuse(ErrorCode::kMaterialMapInvalid, path + ".material",
             name + " takes the place of \"" + echoed(printing_.materials[overrides[i].instead_of - 1].name) +
                 "\", and " + (i == j ? "is the same one" : "is kept out itself") + "; name another material");
    }
  }

  void check_unused(const std::vector<std::uint32_t>& used, std::uint32_t material, const std::string& field) const {
    if (std::find(used.begin(), used.end(), material) == used.end()) return;
    refuse(
        ErrorCode::kMaterialMapInvalid, field,
        '"' + echoed(printing_.materials[material - 1].name) + "\" has another part in the map already; name it once");
  }

  static void check_count(std::size_t count, std::size_t least, std::size_t most, const std::string& field) {
    if (count >= least && count <= most) return;
    refuse(ErrorCode::kMaterialMapInvalid, field,
           std::to_string(count) + " of them; give " + std::to_string(least) + " to " + std::to_string(most));
  }

  static void check_finite(double number, const std::string& field) {
    if (!std::isfinite(number)) refuse(ErrorCode::kMaterialMapNonFinite, field, "NaN or infinite; give a number");
  }

  static void check_step(const double* before, double value, const std::string& field) {
    check_finite(value, field);
    if (before == nullptr || value > *before) return;
    refuse(ErrorCode::kMaterialMapInvalid, field,
           number_text(value) + " isn't above " + number_text(*before) + ", the one before; sort them");
  }

  static void check_fraction(double fraction, const std::string& field) {
    check_finite(fraction, field);
    if (fraction >= 0 && fraction <= 1) return;
    refuse(ErrorCode::kMaterialMapInvalid, field, number_text(fraction) + " is outside 0 to 1");
  }

  const Printing& printing_;
  const ChannelTable& channels_;
  const std::string path_;
};

void check_map(const Printing& printing, const ChannelTable& channels, const std::string& path,
               const MaterialMap& map) {
  const MapCheck check(printing, channels, path);
  std::visit(check, map.kind);
  check.check_overrides(map.overrides);
}

void check_cell_region_maps(const Printing& printing, const SolidSummary& summary, const ChannelTable& channels) {
  const std::string list = "printing.cell_region_maps";
  std::vector<bool> mapped(summary.cell_regions.size());
  for (std::size_t i = 0; i < printing.cell_region_maps.size(); ++i) {
    const auto& [region, map] = printing.cell_region_maps[i];
    const std::string field = item(list, i) + ".cell_region";
    if (region >= mapped.size()) {
      refuse(ErrorCode::kCellRegionUnknown, field, "the solid has no cell region " + std::to_string(region));
    }
    if (mapped[region]) {
      refuse(ErrorCode::kMaterialMapInvalid, field,
             '"' + echoed(summary.cell_regions[region].name) + "\" has a map already; give it one");
    }
    mapped[region] = true;
    check_map(printing, channels, item(list, i) + ".map", map);
  }
}

/// REQUIRES: the maps that are given passed check_cell_region_maps().
void check_that_all_regions_are_mapped(const Printing& printing, const SolidSummary& summary) {
  std::vector<bool> mapped(summary.cell_regions.size());
  for (const CellRegionMap& own : printing.cell_region_maps) mapped[own.cell_region] = true;
  const auto missing = std::find(mapped.begin(), mapped.end(), false);
  if (missing == mapped.end()) return;
  const auto region = static_cast<std::size_t>(missing - mapped.begin());
  refuse(ErrorCode::kMaterialMapMissing, "printing.map",
         "missing; cell region \"" + echoed(summary.cell_regions[region].name) +
             "\" has no map of its own: give it one, or one for all that have none");
}

struct ChannelList {
  std::vector<std::string> operator()(std::monostate) const { return {}; }
  std::vector<std::string> operator()(const PureMap&) const { return {}; }
  std::vector<std::string> operator()(const DirectMap& map) const {
    std::vector<std::string> channels;
    for (const DirectMap::Share& share : map.shares) channels.push_back(share.channel);
    return channels;
  }
  std::vector<std::string> operator()(const BlendMap& map) const { return {map.channel}; }
  std::vector<std::string> operator()(const CalibrationMap& map) const { return {map.channel}; }
  std::vector<std::string> operator()(const ColourMap& map) const { return {map.red, map.green, map.blue}; }
};

struct SteepestSpan {
  double operator()(std::monostate) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const PureMap&) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const DirectMap&) const { return 1; }
  double operator()(const BlendMap& map) const {
    double span = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < map.stops.size(); ++i) {
      span = std::min(span, map.stops[i].value - map.stops[i - 1].value);
    }
    return span;
  }
  double operator()(const CalibrationMap& map) const {
    double span = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < map.points.size(); ++i) {
      const CalibrationMap::Point &low = map.points[i - 1], &high = map.points[i];
      const double change = std::abs(high.fraction - low.fraction);
      if (change > 0) span = std::min(span, (high.property - low.property) / change);
    }
    return span;
  }
  double operator()(const ColourMap& map) const { return map.full_value; }
};

void add_channel(const std::string& channel, std::vector<std::string>& channels) {
  if (!contains(channels, channel)) channels.push_back(channel);
}

void add_channels(const MaterialMap& map, std::vector<std::string>& channels) {
  for (const std::string& channel : std::visit(ChannelList(), map.kind)) add_channel(channel, channels);
  for (const MapOverride& first : map.overrides) add_channel(first.channel, channels);
}

}  // namespace

std::vector<const MaterialMap*> maps_of(const Printing& printing) {
  std::vector<const MaterialMap*> maps = {&printing.map};
  for (const CellRegionMap& own : printing.cell_region_maps) maps.push_back(&own.map);
  return maps;
}

double steepest_span(const MaterialMap& map) { return std::visit(SteepestSpan(), map.kind); }

double steepest_span(const Printing& printing, const std::string& channel) {
  double span = std::numeric_limits<double>::infinity();
  for (const MaterialMap* map : maps_of(printing)) {
    if (contains(kind_channels_of(*map), channel)) span = std::min(span, steepest_span(*map));
  }
  return span;
}

std::vector<std::uint32_t> palette_of(const Printing& printing) {
  std::vector<std::uint32_t> palette = {printing.background_rgba};
  for (const PrintMaterial& material : printing.materials) palette.push_back(material.rgba);
  return palette;
}

std::vector<std::string> kind_channels_of(const MaterialMap& map) { return channels_of(MaterialMap{map.kind}); }

std::vector<std::string> channels_of(const MaterialMap& map) {
  std::vector<std::string> channels;
  add_channels(map, channels);
  return channels;
}

std::vector<std::string> channels_of(const Printing& printing) {
  std::vector<std::string> channels;
  for (const MaterialMap* map : maps_of(printing)) add_channels(*map, channels);
  return channels;
}

std::vector<std::string> override_channels_of(const Printing& printing) {
  std::vector<std::string> channels;
  for (const MaterialMap* map : maps_of(printing)) {
    for (const MapOverride& first : map->overrides) add_channel(first.channel, channels);
  }
  return channels;
}

MaterialSet printed_materials(const Printing& printing) {
  MaterialSet printed = 0;
  for (std::size_t m = 0; m < printing.materials.size(); ++m) {
    if (!printing.materials[m].leaves_empty) printed |= MaterialSet{1} << (m + 1);
  }
  return printed;
}

bool leaves_voxels_empty(const Printing& printing) {
  return std::ranges::any_of(printing.materials, &PrintMaterial::leaves_empty);
}

void validate_materials(const Printing& printing) {
  const std::vector<PrintMaterial>& materials = printing.materials;
  const std::string list = "printing.materials";
  if (materials.empty()) refuse(ErrorCode::kMaterialsMissing, list, "none; say what the printer holds");
  if (materials.size() > kMaxPrintMaterials) {
    refuse(
        ErrorCode::kTooManyMaterials, list,
        std::to_string(materials.size()) + " are more than " + std::to_string(kMaxPrintMaterials) + "; leave some out");
  }
  if (printed_materials(printing) == 0) {
    refuse(ErrorCode::kMaterialsMissing, list, "all of them leave voxels empty; name one that is printed");
  }
  for (std::size_t i = 0; i < materials.size(); ++i) {
    check_name(materials[i], item(list, i));
    if (materials[i].rgba == printing.background_rgba && !materials[i].leaves_empty) {
      refuse(ErrorCode::kMaterialColourRepeated, item(list, i) + ".rgba",
             "the background's colour; change one of them, pictures couldn't tell them apart");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (materials[i].name == materials[j].name) {
        refuse(ErrorCode::kMaterialNameRepeated, item(list, i) + ".name",
               '"' + echoed(materials[i].name) + "\" comes twice; rename one");
      }
      if (materials[i].rgba == materials[j].rgba) {
        refuse(ErrorCode::kMaterialColourRepeated, item(list, i) + ".rgba",
               "the colour of \"" + echoed(materials[j].name) +
                   "\"; change one of them, pictures couldn't tell them apart");
      }
    }
  }
}

void validate_printing(const Printing& printing, const SolidSummary& summary, const ChannelSources& sources) {
  const ChannelTable channels(summary.channels, sources);
  validate_materials(printing);
  check_cell_region_maps(printing, summary, channels);
  const bool given = !std::holds_alternative<std::monostate>(printing.map.kind);
  if (given || printing.cell_region_maps.empty() || printing.materials.size() == 1) {
    check_map(printing, channels, "printing.map", printing.map);
  } else {
    check_that_all_regions_are_mapped(printing, summary);
  }
  if (find_halftone(printing.halftone.method) != nullptr) return;
  refuse(ErrorCode::kEnumValueUnknown, "printing.halftone.method", "unknown; ask for " + choice_text(kHalftoneMethods));
}

}  // namespace ccslice
