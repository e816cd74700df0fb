// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/pixel_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/printing/colour_gamut.h"
#include "core/printing/halftone.h"
#include "core/printing/mixture.h"

namespace ccslice {
namespace {

using Rgba = std::array<std::uint8_t, 4>;
constexpr std::uint8_t kOpaque = 255;
constexpr std::size_t kShades = 255;  // Colours of a map: with that of outside a palette holds them.

Rgba opaque(const Srgb& colour) { return {colour[0], colour[1], colour[2], kOpaque}; }

Rgba opaque(std::uint32_t rgba) {
  return {static_cast<std::uint8_t>(rgba >> 24), static_cast<std::uint8_t>(rgba >> 16),
          static_cast<std::uint8_t>(rgba >> 8), kOpaque};
}

/// An sRGB component of linear intensity (IEC 61966-2-1), the inverse of linear_intensity().
std::uint8_t srgb_byte(double linear) {
  constexpr double kLinearPart = 0.0031308, kSlope = 12.92, kOffset = 0.055, kPower = 2.4;
  const double at = std::clamp(linear, 0.0, 1.0);
  const double srgb = at <= kLinearPart ? kSlope * at : (1 + kOffset) * std::pow(at, 1 / kPower) - kOffset;
  return static_cast<std::uint8_t>(std::lround(255 * srgb));
}

/// Where the pixel of a voxel is in the picture, whose rows come from the top.
class Canvas {
 public:
  explicit Canvas(PreviewPicture& picture) : picture_(picture) {
    picture_.rgba.assign(std::size_t{4} * picture.columns * picture.rows, 0);
  }
  std::uint8_t* at(std::uint32_t column, std::uint32_t row) {
    const std::uint32_t from_top = picture_.rows - 1 - row;
    return &picture_.rgba[std::size_t{4} * (std::size_t{picture_.columns} * from_top + column)];
  }
  void set(std::uint32_t column, std::uint32_t row, const Rgba& colour) {
    std::memcpy(at(column, row), colour.data(), colour.size());
  }

 private:
  PreviewPicture& picture_;
};

/// The values of a plane of kFloat32.
class Values {
 public:
  explicit Values(const SampleImage& image) : image_(image) {}
  float at(std::uint32_t column, std::uint32_t row) const {
    float value = 0;
    std::memcpy(&value, image_.samples.data() + sizeof(float) * (std::size_t{image_.width} * row + column),
                sizeof(float));
    return value;
  }

 private:
  SampleImage image_;
};

ValueRange range_of(const Values& values, std::span<const VoxelRun> spans) {
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end; ++x) {
      const float value = values.at(x, span.row);
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  return {low, high};
}

void colour_channel(const PreviewColours& show, const Values& values, std::span<const VoxelRun> spans,
                    PreviewPicture& picture, Canvas& canvas) {
  if (spans.empty()) {
    picture.range = show.range;
    return;
  }
  picture.range = show.range ? *show.range : range_of(values, spans);
  picture.value_pixels.assign(kValueBins, 0);
  std::array<Rgba, kShades> shades;
  for (std::size_t i = 0; i < kShades; ++i) {
    shades[i] = opaque(map_colour(show.colours, static_cast<double>(i) / (kShades - 1)));
  }
  const double length = picture.range->max - picture.range->min;
  const double scale = length > 0 ? 1 / length : 0;
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end; ++x) {
      const double at = (values.at(x, span.row) - picture.range->min) * scale;
      const auto shade = static_cast<std::size_t>(std::clamp(at * (kShades - 1) + 0.5, 0.0, kShades - 0.5));
      canvas.set(x, span.row, shades[shade]);
      ++picture.value_pixels[static_cast<std::size_t>(std::clamp(at * kValueBins, 0.0, kValueBins - 0.5))];
    }
  }
}

/// Colours of mixed materials. A pixel is as transparent as its fraction of what is left empty.
class MixedColours {
 public:
  explicit MixedColours(const Printing& printing) : materials_(printing.materials) {
    for (const PrintMaterial& material : materials_) light_.push_back(linear_colour(material.rgba));
  }
  Rgba of(const Fractions& fractions, std::uint32_t k) const {
    Vec3 light = Vec3::Zero();
    double printed = 0, all = 0;
    for (std::size_t m = 0; m < materials_.size(); ++m) {
      const double fraction = fractions[m][k];
      all += fraction;
      if (materials_[m].leaves_empty) continue;
      light += fraction * light_[m];
      printed += fraction;
    }
    if (printed == all) return {srgb_byte(light[0]), srgb_byte(light[1]), srgb_byte(light[2]), kOpaque};
    const auto alpha = static_cast<std::uint8_t>(std::lround(kOpaque * printed / all));
    if (alpha == 0) return {};
    light /= printed;
    return {srgb_byte(light[0]), srgb_byte(light[1]), srgb_byte(light[2]), alpha};
  }

 private:
  const std::vector<PrintMaterial>& materials_;
  std::vector<Vec3> light_;
};

/// Calls take(row, first column, count, fractions) for the pixels of each block.
template <typename Take>
void mix_blocks(const HalftonePlan& plan, std::span<const SampleImage> channels, std::span<const MixedRun> runs,
                const CancellationToken& cancel, const Take& take) {
  constexpr std::size_t kRunsPerPoll = 256;
  std::vector<Values> values(channels.begin(), channels.end());
  std::vector<std::vector<std::size_t>> places;
  const std::vector<std::string> known = channels_of(plan.printing());
  for (const Mixture& mixture : plan.mixtures()) places.push_back(places_among(known, mixture));
  std::vector<MixRow> rows(channels.size());
  Fractions fractions{};
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r % kRunsPerPoll == 0) cancel.throw_if_cancelled();
    const MixedRun& run = runs[r];
    for (std::uint32_t x = run.begin; x < run.end;) {
      const std::uint32_t count = std::min<std::uint32_t>(kMixBlock, run.end - x);
      std::size_t next = 0;
      for (const std::size_t place : places[run.mixture]) {
        MixRow& row = rows[next++];
        for (std::uint32_t k = 0; k < count; ++k) row[k] = values[place].at(x + k, run.row);
      }
      plan.mixtures()[run.mixture].evaluate(rows, fractions);
      take(run.row, x, count, fractions);
      x += count;
    }
  }
}

/// The voxel of a grid, endless on all sides, that a point lies in.
class VoxelFinder {
 public:
  VoxelFinder(const PreviewPlane& plane, const Grid& grid)
      : frame_(frame_of(plane)), first_(grid_of(plane).lattice().centre(0, 0, 0)), plane_(plane), grid_(grid) {
    first_.z() = grid_of(plane).layer_z_mm(0);
  }
  Eigen::Vector3i at(std::uint32_t column, std::uint32_t row) const {
    const Vec3 in_plane = first_ + Vec3(column * plane_.across_mm, row * plane_.up_mm, 0);
    const Vec3 pitch(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
    const Vec3 voxel = (frame_ * in_plane - grid_.origin_mm).cwiseQuotient(pitch);
    return voxel.array().floor().cast<int>().cwiseMax(0);
  }

 private:
  Mat3 frame_;
  Vec3 first_;  // The lowest left pixel, in the plane's coordinates.
  const PreviewPlane& plane_;
  const Grid& grid_;
};

}  // namespace

std::vector<MixedRun> mixed_runs(const HalftonePlan& plan, std::span<const RegionRun> runs) {
  std::vector<MixedRun> mixed;
  mixed.reserve(runs.size());
  for (const RegionRun& run : runs) mixed.push_back({run, plan.mixture_of(run.region)});
  return mixed;
}

Printing mixed_only(Printing printing) {
  printing.halftone.method = HalftoneMethod::kLargestFraction;
  printing.map.strict = false;
  for (CellRegionMap& own : printing.cell_region_maps) own.map.strict = false;
  return printing;
}

void mix_pixels(std::span<const MixedPixels> parts, PreviewPicture& picture, const CancellationToken& cancel) {
  Canvas canvas(picture);
  for (const MixedPixels& part : parts) {
    const MixedColours colours(part.plan->printing());
    mix_blocks(*part.plan, part.values, part.runs, cancel,
               [&](std::uint32_t row, std::uint32_t first, std::uint32_t count, const Fractions& fractions) {
                 for (std::uint32_t k = 0; k < count; ++k) canvas.set(first + k, row, colours.of(fractions, k));
               });
  }
  for (std::size_t at = 3; at < picture.rgba.size(); at += 4) picture.pixels_inside += picture.rgba[at] > 0;
}

void halftone_pixels(const PreviewPlane& plane, const Grid& grid, const HalftonePlan& plan,
                     std::span<const SampleImage> values, std::span<const MixedRun> runs, PreviewPicture& picture,
                     const CancellationToken& cancel) {
  Canvas canvas(picture);
  const VoxelFinder voxels(plane, grid);
  const std::vector<PrintMaterial>& materials = plan.printing().materials;
  picture.material_pixels.assign(materials.size(), 0);
  Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);
  Halftoner halftoner(plan);
  std::array<std::uint8_t, kMixBlock> chosen{};
  Fractions one{};
  const auto choose = [&](const Eigen::Vector3i& voxel, const Fractions& fractions, std::uint32_t k) {
    // Thresholds are found by row, and neighbours mostly lie in voxels of one.
    if (voxel.z() != last.z() || voxel.y() != last.y()) {
      halftoner.start_layer(grid.extent.columns, static_cast<std::uint32_t>(voxel.z()));
      halftoner.start_row(static_cast<std::uint32_t>(voxel.y()));
      last = voxel;
    }
    const auto column = static_cast<std::uint32_t>(voxel.x());
    const std::uint32_t place = column % kMixBlock;
    for (std::size_t m = 0; m < plan.material_count(); ++m) one[m][place] = fractions[m][k];
    halftoner.choose(column / kMixBlock, place, place + 1, one, chosen.data());
    return chosen[place];
  };
  mix_blocks(plan, values, runs, cancel,
             [&](std::uint32_t row, std::uint32_t first, std::uint32_t count, const Fractions& fractions) {
               for (std::uint32_t k = 0; k < count; ++k) {
                 const std::uint8_t material = choose(voxels.at(first + k, row), fractions, k);
                 ++picture.material_pixels[material - 1u];
                 if (materials[material - 1u].leaves_empty) continue;
                 ++picture.pixels_inside;
                 canvas.set(first + k, row, opaque(materials[material - 1u].rgba));
               }
             });
}

void material_pixels(std::span<const std::uint8_t> numbers, const Printing& printing, PreviewPicture& picture) {
  Canvas canvas(picture);
  picture.material_pixels.assign(printing.materials.size(), 0);
  std::size_t voxel = 0;
  for (std::uint32_t row = 0; row < picture.rows; ++row) {
    for (std::uint32_t column = 0; column < picture.columns; ++column) {
      const std::uint8_t material = numbers[voxel++];
      if (material == 0) continue;
      ++picture.material_pixels[material - 1u];
      if (printing.materials[material - 1u].leaves_empty) continue;
      ++picture.pixels_inside;
      canvas.set(column, row, opaque(printing.materials[material - 1u].rgba));
    }
  }
}

void colour_pixels(const PreviewColours& show, std::span<const SampleImage> values, std::span<const VoxelRun> spans,
                   PreviewPicture& picture) {
  Canvas canvas(picture);
  for (const VoxelRun& span : spans) picture.pixels_inside += span.end - span.begin;
  if (show.content == PreviewContent::kChannel) {
    return colour_channel(show, Values(values.front()), spans, picture, canvas);
  }
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end; ++x) canvas.set(x, span.row, opaque(kPlainMaterialColour));
  }
}

}  // namespace ccslice
