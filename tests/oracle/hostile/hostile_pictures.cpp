// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_pictures.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/output/encode.h"
#include "core/output/encodings.h"
#include "tests/core/output/tiny_png.h"
#include "tests/core/output/tiny_runs.h"
#include "tests/oracle/hostile/hostile_image_file.h"
#include "tests/oracle/hostile/hostile_numbers.h"
#include "tests/oracle/hostile/hostile_strict.h"

namespace ccslice::oracle {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// As kRaw has the samples. `alpha`: a byte a voxel, of encodings with alpha.
struct Picture {
  Bytes samples, alpha;
};

/// What planes of this kind may be asked for in, raw as often as all others.
std::vector<Encoding> encodings_for(const PlaneSpec& plane) {
  std::vector<Encoding> known;
  for (const EncodingTraits& traits : encodings()) {
    const bool of_channels = !shows_numbers(plane);
    if (!traits.is_built() || traits.encoding == Encoding::kRaw || (traits.has_alpha && !of_channels)) continue;
    if (encoding_obstacle(plane.sample_type, traits.encoding, channel_count(plane))) continue;
    known.push_back(traits.encoding);
  }
  return known;
}

/// Planes of materials and of cell regions that others drew an encoding for keep it.
void draw_encodings(HostileRandom& random, SliceJob& job, std::string& text) {
  for (PlaneSpec& plane : job.planes) {
    if (random.chance(0.5) || plane.encoding != Encoding::kRaw) continue;
    const bool has_palette = plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kCellRegions;
    const std::vector<Encoding> known =
        has_palette ? std::vector{Encoding::kRawZstd, Encoding::kRunsZstd} : encodings_for(plane);
    plane.encoding = known[random.bits() % known.size()];
    text += " " + std::string(find_encoding(plane.encoding)->name);
  }
}

/// The CRC-32 of IEEE 802.3, bit by bit.
std::uint32_t checksum_of(std::span<const std::uint8_t> bytes) {
  std::uint32_t sum = 0xffffffff;
  for (const std::uint8_t byte : bytes) {
    sum ^= byte;
    for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ (sum & 1 ? 0xedb88320u : 0u);
  }
  return ~sum;
}

Bytes expanded(const EncodedPlane& plane) {
  Bytes samples(plane.raw_bytes);
  const std::size_t size = ZSTD_decompress(samples.data(), samples.size(), plane.bytes.data(), plane.bytes.size());
  if (size != samples.size()) throw std::runtime_error("a frame that doesn't expand to what it should");
  return samples;
}

/// Grey, or grey and alpha, 16 bits big-endian in the file.
Picture grey_of(const TinyPng& png, const GridExtent& extent) {
  if (png.width != extent.columns || png.height != extent.rows || (png.color_type != 0 && png.color_type != 4)) {
    throw std::runtime_error("a picture of another size or kind");
  }
  Picture picture;
  const std::size_t size = png.bit_depth == 16 ? 2 : 1, step = png.color_type == 4 ? 2 * size : size;
  for (std::size_t i = 0; i < png.samples.size(); i += step) {
    for (std::size_t byte = size; byte-- > 0;) picture.samples.push_back(png.samples[i + byte]);
    if (step == size) continue;
    const bool inside = png.samples[i + size] == 255;
    if (png.samples[i + size] != (inside ? 255 : 0) || png.samples[i + step - 1] != png.samples[i + size]) {
      throw std::runtime_error("alpha that is neither all nor nothing");
    }
    picture.alpha.push_back(inside ? 1 : 0);
  }
  return picture;
}

/// `solid` and `job`: for the colours of numbers.
Picture read(const SolidSummary& solid, const SliceJob& job, const PlaneSpec& plane, const EncodedPlane& encoded,
             const GridExtent& extent) {
  switch (plane.encoding) {
    case Encoding::kRaw: return {encoded.bytes, {}};
    case Encoding::kRawZstd: return {expanded(encoded), {}};
    case Encoding::kRunsZstd: {
      const std::uint32_t channels = channel_count(plane);
      return {read_tiny_runs(encoded.bytes, plane.sample_type, extent.columns, extent.rows, channels).samples, {}};
    }
    case Encoding::kTiff:
    case Encoding::kExr:
    case Encoding::kTiffAlpha: {
      ImageFile file = read_image_file(encoded.bytes, plane, plane.channels, extent);
      return {std::move(file.samples), std::move(file.alpha)};
    }
    default: break;
  }
  if (!shows_numbers(plane)) return grey_of(read_tiny_png(encoded.bytes), extent);
  const std::vector<std::uint32_t> palette = palette_of_plane(job, plane, solid.cell_regions.size());
  return {packed_numbers(numbers_of(plane, encoded, extent, palette), plane.sample_type, extent), {}};
}

/// `size` bytes a voxel, from one order into the other: both ways are the same.
Bytes flipped(const Bytes& samples, std::size_t size, const GridExtent& extent, const PictureOrder& order) {
  Bytes out(samples.size());
  for (std::size_t row = 0; row < extent.rows; ++row) {
    for (std::size_t column = 0; column < extent.columns; ++column) {
      const std::size_t y = order.rows_descending ? extent.rows - 1 - row : row;
      const std::size_t x = order.columns_descending ? extent.columns - 1 - column : column;
      std::copy_n(&samples[(y * extent.columns + x) * size], size, &out[(row * extent.columns + column) * size]);
    }
  }
  return out;
}

Bytes ascending(const PlaneSpec& plane, const Bytes& samples, const GridExtent& extent, const PictureOrder& order) {
  if (order == PictureOrder{}) return samples;
  if (!shows_numbers(plane)) {
    return flipped(samples, sample_bytes(plane.sample_type, 1, 1, channel_count(plane)), extent, order);
  }
  PlaneSpec raw = plane;
  raw.encoding = Encoding::kRaw;
  const Bytes numbers = numbers_of(raw, {samples, samples.size(), 0}, extent, {});
  return packed_numbers(flipped(numbers, 1, extent, order), plane.sample_type, extent);
}

}  // namespace

SliceJob draw_hostile_pictures(HostileRandom& random, const SolidSummary& solid, const SliceJob& job,
                               std::string& text) {
  SliceJob asked = job;
  std::string encodings;
  draw_encodings(random, asked, encodings);
  if (!encodings.empty()) text += ", as" + encodings;
  asked.order = {random.chance(0.25), random.chance(0.25)};
  if (asked.order.columns_descending) text += ", columns descending";
  if (asked.order.rows_descending) text += ", rows descending";
  asked.contours_by_cell_region = !solid.cell_regions.empty() && random.chance(0.7);
  asked.contours = asked.contours_by_cell_region || random.chance(0.3);
  if (asked.contours) text += asked.contours_by_cell_region ? ", contours by region" : ", contours";
  return asked;
}

SliceJob without_pictures(SliceJob asked) {
  SliceJob job = without_strict_maps(std::move(asked));
  for (PlaneSpec& plane : job.planes) plane.encoding = Encoding::kRaw;
  job.order = {};
  job.contours = job.contours_by_cell_region = false;
  return job;
}

Layer read_pictures(const SolidSummary& solid, const SliceJob& asked, const Layer& layer, const GridExtent& extent,
                    HostileFinding& finding) {
  Layer plain = layer;
  const auto fail = [&](std::size_t plane, const std::string& what) {
    if (finding.failed++ > 0) return;
    finding.where = "plane " + std::to_string(plane) + " in layer " + std::to_string(layer.index) + ": " + what;
  };
  for (std::size_t i = 0; i < asked.planes.size(); ++i) {
    const PlaneSpec& spec = asked.planes[i];
    const EncodedPlane& encoded = layer.planes[i];
    const Picture picture = read(solid, asked, spec, encoded, extent);
    ++finding.compared;
    if (encoded.raw_bytes != picture.samples.size()) fail(i, "another size");
    if (encoded.crc32 != checksum_of(picture.samples)) fail(i, "another checksum");
    plain.planes[i].bytes = ascending(spec, picture.samples, extent, asked.order);
    if (picture.alpha.empty()) continue;
    const Bytes inside = packed_numbers(picture.alpha, SampleType::kBit, extent);
    // The last plane is the occupancy, in the order that is asked for.
    const Picture last = read(solid, asked, asked.planes.back(), layer.planes.back(), extent);
    if (inside != last.samples) fail(i, "alpha that isn't the occupancy");
  }
  return plain;
}

}  // namespace ccslice::oracle
