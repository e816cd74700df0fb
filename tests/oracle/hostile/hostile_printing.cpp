// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_printing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/base/contains.h"
#include "core/output/encode.h"
#include "core/output/pack_indices.h"
#include "tests/oracle/hostile/hostile_numbers.h"

namespace ccslice::oracle {
namespace {

constexpr double kShareOfPrints = 0.4, kShareOfRegionPlanes = 0.7;  // Of the jobs; of those with cell regions.
constexpr double kShareOfPrintsAlone = 0.35;                        // Of the prints: no channel is shown.
constexpr double kShareOfOverrides = 0.4;                           // Of the maps.
constexpr std::array kMapNames = {"pure", "direct", "blend", "curve", "colour"};

class PrintingDraw {
 public:
  PrintingDraw(HostileRandom& random, const SolidSummary& solid) : random_(random), solid_(solid) {}

  Printing make() {
    constexpr std::array counts = {0.1, 0.35, 0.2, 0.15, 0.05, 0.05, 0.05, 0.05};
    count_ = static_cast<std::uint32_t>(random_.weighted(counts)) + 1;
    text_ = std::to_string(count_) + " materials";
    for (std::uint32_t m = 0; m < count_; ++m) add_material();
    printing_.map = draw_map();
    for (std::size_t region = 0; region < solid_.cell_regions.size(); ++region) {
      if (random_.chance(0.5)) continue;
      text_ += " region " + std::to_string(region);
      printing_.cell_region_maps.push_back({static_cast<std::uint8_t>(region), draw_map()});
    }
    draw_halftone();
    return std::move(printing_);
  }
  const std::string& text() const { return text_; }

 private:
  void add_material() {
    std::uint32_t rgba = 0;
    const auto is_taken = [&](const PrintMaterial& other) { return other.rgba == rgba; };
    do {
      rgba = static_cast<std::uint32_t>(random_.bits()) | 0xff;
    } while (rgba == printing_.background_rgba || std::ranges::any_of(printing_.materials, is_taken));
    printing_.materials.push_back({"m" + std::to_string(printing_.materials.size()), rgba});
  }

  std::uint32_t material() { return 1 + static_cast<std::uint32_t>(random_.bits() % count_); }
  const std::string& channel() { return solid_.channels[random_.bits() % solid_.channels.size()].name; }
  const ChannelRange& range_of(const std::string& channel) const {
    return *std::ranges::find(solid_.channels, channel, &ChannelRange::name);
  }

  /// All materials in any order.
  std::vector<std::uint32_t> shuffled(std::uint32_t count, std::uint32_t first) {
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t i = 0; i < count; ++i) numbers.push_back(first + i);
    for (std::size_t i = numbers.size(); i > 1; --i) std::swap(numbers[i - 1], numbers[random_.bits() % i]);
    return numbers;
  }

  MaterialMap draw_map() {
    constexpr std::array weights = {0.1, 0.25, 0.3, 0.2, 0.15};
    std::size_t kind = random_.weighted(weights);
    if (count_ == 1 && kind == 3) kind = 2;  // A curve is one of two materials.
    text_ += std::string(" ") + kMapNames[kind];
    MaterialMap map;
    switch (kind) {
      case 0: map.kind = PureMap{material()}; break;
      case 1: map.kind = draw_direct(); break;
      case 2: map.kind = draw_blend(); break;
      case 3: map.kind = draw_curve(); break;
      default: map.kind = draw_colours();
    }
    if (random_.chance(kShareOfOverrides)) draw_overrides(map);
    return map;
  }

  void draw_overrides(MaterialMap& map) {
    const int count = random_.pick(1, 3);
    // What keeps materials out gives back none of them: the last material stays.
    for (int i = 0; i < count; ++i) {
      MapOverride& own = map.overrides.emplace_back();
      own.channel = channel();
      own.below = draw_stops(own.channel, 1).front();
      const bool keeps_out = count_ > 1 && random_.chance(0.5);
      own.material = keeps_out ? count_ : material();
      if (keeps_out) own.instead_of = 1 + static_cast<std::uint32_t>(random_.bits() % (count_ - 1));
    }
    text_ += " with " + std::to_string(count) + " overrides";
  }

  DirectMap draw_direct() {
    const auto channels = static_cast<std::uint32_t>(solid_.channels.size());
    const std::vector<std::uint32_t> of = shuffled(channels, 0), to = shuffled(count_, 1);
    const int shares = random_.pick(1, static_cast<int>(std::min(channels, count_)));
    DirectMap map;
    for (std::size_t i = 0; i < static_cast<std::size_t>(shares); ++i)
      map.shares.push_back({solid_.channels[of[i]].name, to[i]});
    if (map.shares.size() < to.size() && random_.chance(0.6)) map.rest_material = to.back();
    return map;
  }

  /// Ascending, about the range of a channel: apart by a billionth of it at least, and not by less than floats tell.
  std::vector<double> draw_stops(const std::string& channel, int count) {
    const ChannelRange& range = range_of(channel);
    const double size = std::max({std::abs(range.min), std::abs(range.max), 1e-3});
    const double span = std::max(range.max - range.min, 1e-4 * size);
    const double width = span * (random_.chance(0.7) ? random_.between(0.5, 1.5) : random_.log_between(1e-3, 1));
    const double low = range.min + random_.between(-0.3, 0.8) * span;
    std::vector<double> stops;
    for (int i = 0; i < count; ++i) stops.push_back(low + width * random_.unit());
    std::ranges::sort(stops);
    for (std::size_t i = 1; i < stops.size(); ++i) stops[i] = std::max(stops[i], stops[i - 1] + 1e-6 * size);
    return stops;
  }

  BlendMap draw_blend() {
    BlendMap map;
    map.channel = channel();
    for (const double value : draw_stops(map.channel, random_.chance(0.8) ? random_.pick(2, 5) : random_.pick(6, 20))) {
      map.stops.push_back({value, material()});
    }
    return map;
  }

  CalibrationMap draw_curve() {
    CalibrationMap map;
    map.channel = channel();
    const std::vector<std::uint32_t> order = shuffled(count_, 1);
    map.material = order[0];
    map.base = order[1];
    for (const double value : draw_stops(map.channel, random_.chance(0.8) ? random_.pick(2, 5) : random_.pick(6, 20))) {
      constexpr std::array ends = {0.0, 1.0};
      map.points.push_back({value, random_.chance(0.3) ? ends[random_.bits() % 2] : random_.unit()});
    }
    return map;
  }

  ColourMap draw_colours() {
    ColourMap map;
    map.red = channel();
    map.green = channel();
    map.blue = channel();
    const double most = range_of(map.red).max;
    map.full_value = most > 0 && random_.chance(0.8) ? most : random_.log_between(1e-2, 1e2);
    // A part of the channel's range alone says how far it may be off.
    if (random_.chance(0.5)) map.full_value *= random_.log_between(0.02, 0.5);
    return map;
  }

  /// Blue noise rarely: its mask takes a second for every shape of voxels.
  void draw_halftone() {
    constexpr std::array weights = {0.1, 0.3, 0.3, 0.3};
    const std::size_t method = random_.weighted(weights);
    printing_.halftone.method = static_cast<HalftoneMethod>(method);
    if (random_.chance(0.5)) printing_.halftone.seed = random_.bits();
    text_ += " " + std::string(printing_.halftone.traits().name);
  }

  HostileRandom& random_;
  const SolidSummary& solid_;
  Printing printing_;
  std::uint32_t count_ = 1;
  std::string text_;
};

class PlaneDraw {
 public:
  PlaneDraw(HostileRandom& random, SliceJob& job) : random_(random), job_(job) {}

  /// Of a number for each voxel, up to `most`. Any type that holds them, in any encoding that can be read.
  void add_numbers(PlaneContent content, std::size_t most) {
    constexpr std::array types = {SampleType::kBit, SampleType::kUint2, SampleType::kUint4, SampleType::kUint8};
    constexpr std::array weights = {0.5, 0.25, 0.25};
    constexpr std::array encodings = {Encoding::kRaw, Encoding::kPng, Encoding::kPngRgba};
    const auto smallest = std::ranges::find(types, smallest_index_type(most)) - types.begin();
    PlaneSpec plane;
    plane.content = content;
    plane.sample_type = types[static_cast<std::size_t>(random_.pick(static_cast<int>(smallest), 3))];
    plane.encoding = encodings[random_.weighted(weights)];
    add(plane);
  }

  void add_mask(std::uint32_t material) {
    PlaneSpec plane;
    plane.content = PlaneContent::kMaterialMask;
    plane.material = material;
    plane.encoding = random_.chance(0.7) ? Encoding::kRaw : Encoding::kPng;
    add(plane);
  }

  void draw_outside_samples() {
    if (!random_.chance(0.3)) return;
    for (PlaneSpec& plane : job_.planes) {
      if (shows_numbers(plane)) continue;
      const std::uint64_t sample = random_.bits();
      switch (plane.sample_type) {
        case SampleType::kUint8: plane.outside_sample = static_cast<double>(sample % 256); break;
        case SampleType::kUint16: plane.outside_sample = static_cast<double>(sample % 65536); break;
        default: plane.outside_sample = sample % 2 ? std::numeric_limits<double>::quiet_NaN() : -1e30;
      }
    }
  }

 private:
  void add(const PlaneSpec& plane) { job_.planes.insert(job_.planes.end() - 1, plane); }

  HostileRandom& random_;
  SliceJob& job_;
};

/// The materials' numbers, or the masks of all; and maybe the mask of one.
void add_material_planes(HostileRandom& random, const Printing& printing, PlaneDraw& planes) {
  const auto count = static_cast<std::uint32_t>(printing.materials.size());
  const bool numbers = random.chance(0.7), all_masks = !numbers || random.chance(0.3);
  if (numbers) planes.add_numbers(PlaneContent::kMaterials, count);
  for (std::uint32_t m = 1; all_masks && m <= count; ++m) planes.add_mask(m);
  if (!all_masks && random.chance(0.4)) planes.add_mask(1 + static_cast<std::uint32_t>(random.bits() % count));
}

}  // namespace

std::string add_hostile_planes(HostileRandom& random, const SolidSummary& solid, SliceJob& job) {
  std::string text;
  PlaneDraw planes(random, job);
  if (!solid.cell_regions.empty() && random.chance(kShareOfRegionPlanes)) {
    planes.add_numbers(PlaneContent::kCellRegions, solid.cell_regions.size());
    text += ", cell regions shown";
  }
  if (random.chance(kShareOfPrints)) {
    PrintingDraw draw(random, solid);
    job.printing = draw.make();
    text += ", " + draw.text();
    if (random.chance(kShareOfPrintsAlone)) {
      std::erase_if(job.planes, [](const PlaneSpec& plane) { return !shows_numbers(plane); });
      text += " alone";
    }
    add_material_planes(random, *job.printing, planes);
  }
  planes.draw_outside_samples();
  return text;
}

}  // namespace ccslice::oracle
