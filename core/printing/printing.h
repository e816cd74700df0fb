// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a job prints with: materials, the map from channels to their mixing fractions, and how one material is chosen
// for every voxel. Materials go by number, 1 to n; 0 is the background. The rules are those of
// ccslice/v1/material.proto; core/printing/mixture.h carries them out.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/ids.h"
#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

inline constexpr std::size_t kMaxPrintMaterials = 8;
/// How far from fractions a strict map takes values.
inline constexpr double kStrictSlack = 1.0 / 128;
inline constexpr std::size_t kMaxMaterialNameBytes = 64;
inline constexpr std::size_t kMaxBlendStops = 64;
inline constexpr std::size_t kMaxCurvePoints = 256;
inline constexpr std::size_t kMaxMapOverrides = 16;

struct PrintMaterial {
  std::string name;
  std::uint32_t rgba = 0;     // 0xRRGGBBAA, sRGB.
  bool leaves_empty = false;  // Nothing is printed where it is chosen.
};

/// All of one material.
struct PureMap {
  std::uint32_t material = 0;
};

/// Channels that are fractions themselves.
struct DirectMap {
  struct Share {
    std::string channel;
    std::uint32_t material = 0;
  };
  std::vector<Share> shares;
  std::uint32_t rest_material = 0;  // Takes what they leave of 1. 0: none, they are scaled to make 1.
};

/// All of one material at each stop, linear in between.
struct BlendMap {
  struct Stop {
    double value = 0;
    std::uint32_t material = 0;
  };
  std::string channel;
  std::vector<Stop> stops;  // Ascending.
};

/// The fraction of `material` in `base` that gives a property.
struct CalibrationMap {
  struct Point {
    double property = 0, fraction = 0;
  };
  std::string channel;
  std::uint32_t material = 0, base = 0;
  std::vector<Point> points;  // Ascending.
};

/// Three channels are a colour, sRGB from 0 to full_value, mixed from the materials' colours.
struct ColourMap {
  std::string red, green, blue;  // Channels.
  double full_value = 1;
};

/// All of a material where a channel is below a bound.
struct MapOverride {
  std::string channel;
  double below = 0;
  std::uint32_t material = 0;
  std::uint32_t instead_of = 0;  // Takes only the fraction of this one, after all that take everything (0).
};

struct MaterialMap {
  std::variant<std::monostate, PureMap, DirectMap, BlendMap, CalibrationMap, ColourMap>
      kind;                              // Nothing: of material 1.
  bool strict = false;                   // Values that give no fractions are errors.
  std::vector<MapOverride> overrides{};  // The first that holds at a voxel goes before the kind.
};

/// A cell region's own.
struct CellRegionMap {
  std::uint8_t cell_region = 0;
  MaterialMap map;
};

enum class HalftoneMethod : std::uint8_t { kBlueNoise, kErrorDiffusion, kLargestFraction, kWhiteNoise };

struct HalftoneTraits {
  HalftoneMethod method;
  std::string_view name;        // Of the contract's value, without HALFTONE_METHOD_.
  bool has_mask = false;        // Thresholds come from a mask of ranks.
  bool carries_errors = false;  // From voxel to voxel, so that a voxel depends on all before it in its layer.
};

inline constexpr std::array kHalftoneMethods = {
    HalftoneTraits{.method = HalftoneMethod::kBlueNoise, .name = "BLUE_NOISE", .has_mask = true},
    HalftoneTraits{.method = HalftoneMethod::kErrorDiffusion, .name = "ERROR_DIFFUSION", .carries_errors = true},
    HalftoneTraits{.method = HalftoneMethod::kLargestFraction, .name = "LARGEST_FRACTION"},
    HalftoneTraits{.method = HalftoneMethod::kWhiteNoise, .name = "WHITE_NOISE"},
};

/// Null for a number that is no method.
constexpr const HalftoneTraits* find_halftone(HalftoneMethod method) {
  for (const HalftoneTraits& traits : kHalftoneMethods) {
    if (traits.method == method) return &traits;
  }
  return nullptr;
}

struct Halftone {
  HalftoneMethod method = HalftoneMethod::kBlueNoise;
  std::uint64_t seed = 0;

  /// REQUIRES: a method that there is.
  const HalftoneTraits& traits() const { return *find_halftone(method); }
};

struct Printing {
  std::vector<PrintMaterial> materials;           // At most kMaxPrintMaterials.
  MaterialMap map;                                // Of cell regions without their own, or of everything.
  std::vector<CellRegionMap> cell_region_maps{};  // One for a region at most.
  Halftone halftone;
  std::uint32_t background_rgba = 0x000000ff;
};

/// The numbers of the materials that are printed.
MaterialSet printed_materials(const Printing& printing);
/// Some material leaves voxels empty.
bool leaves_voxels_empty(const Printing& printing);

/// The colours by material number, the background's first.
std::vector<std::uint32_t> palette_of(const Printing& printing);

/// All maps of a printing: that of Printing::map first, then those of Printing::cell_region_maps.
std::vector<const MaterialMap*> maps_of(const Printing& printing);

/// The channels that a map's kind reads, each once.
std::vector<std::string> kind_channels_of(const MaterialMap& map);
/// The channels that a map reads, each once, in the order of the map, those of its overrides last.
std::vector<std::string> channels_of(const MaterialMap& map);
/// The channels that any map of the printing reads, each once, in the order of maps_of().
std::vector<std::string> channels_of(const Printing& printing);

/// The channels that overrides of any map read, each once.
std::vector<std::string> override_channels_of(const Printing& printing);

/// By how much a channel's value changes where the map's kind is steepest, for a fraction to go from 0 to 1. Infinite
/// if it reads no channel.
double steepest_span(const MaterialMap& map);
/// The least of the maps that read the channel.
double steepest_span(const Printing& printing, const std::string& channel);

/// The materials alone. Throws Error{kMaterialsMissing, kTooManyMaterials, kMaterialNameInvalid, kMaterialNameRepeated,
/// kMaterialColourRepeated}. Fields are named as in a SliceJob.
void validate_materials(const Printing& printing);

/// Throws as above, and Error{kMaterialUnknown, kMaterialMapMissing, kMaterialMapInvalid, kMaterialMapNonFinite,
/// kChannelUnknown, kCellRegionUnknown, kEnumValueUnknown}.
/// `sources`: of the job, whose channels maps may read besides the solid's.
void validate_printing(const Printing& printing, const SolidSummary& summary, const ChannelSources& sources = {});

}  // namespace ccslice
