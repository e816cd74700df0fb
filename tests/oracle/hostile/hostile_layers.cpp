// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/contains.h"
#include "core/channel/channel_table.h"
#include "core/field/contone.h"
#include "tests/oracle/hostile/hostile_maps.h"
#include "tests/support/slice_range.h"

namespace ccslice::oracle {
namespace {

template <typename Sample>
double read(const EncodedPlane& plane, std::size_t index) {
  Sample sample;
  std::memcpy(&sample, plane.bytes.data() + index * sizeof sample, sizeof sample);
  return static_cast<double>(sample);
}

constexpr double kDefaultOfBytes = 1.0 / 1024, kDefault = 1.0 / 65536;  // Shares. The former of materials, too.

std::vector<std::string> channels_of_plane(const PlaneSpec& plane) {
  if (plane.content == PlaneContent::kChannel) return {plane.channel};
  return plane.content == PlaneContent::kChannels ? plane.channels : std::vector<std::string>();
}

}  // namespace

std::vector<Layer> slice_layers(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                                std::uint32_t first, std::uint32_t count, int threads) {
  std::vector<Layer> layers;
  SliceRangeOptions options;
  options.threads = threads;
  slice_range(
      solid, job, first, count, [&](Layer&& layer) { layers.push_back(std::move(layer)); }, options);
  return layers;
}

SliceJob inverting_job(const LimitSolid& solid, const SliceJob& job) {
  SliceJob result = job;
  result.channel_tolerance = 0;
  result.contours = true;
  result.planes.clear();
  PlaneSpec plane;
  plane.encoding = Encoding::kRaw;
  result.planes.push_back(plane);
  plane.content = PlaneContent::kChannel;
  plane.sample_type = SampleType::kFloat32;
  for (const ChannelRange& channel : solid.summary().channels) {
    plane.channel = channel.name;
    result.planes.push_back(plane);
  }
  plane.sample_type = SampleType::kUint8;
  plane.content = PlaneContent::kCellRegions;
  if (!solid.summary().cell_regions.empty()) result.planes.push_back(plane);
  plane.content = PlaneContent::kMaterials;
  if (job.printing) result.planes.push_back(plane);
  return result;
}

bool bit_at(const EncodedPlane& plane, std::uint32_t columns, std::uint32_t column, std::uint32_t row) {
  const std::size_t row_bytes = (columns + 7) / 8;
  return plane.bytes[row * row_bytes + column / 8] >> (7 - column % 8) & 1;
}

double ChannelSamples::quantum() const {
  if (type == SampleType::kFloat32) return 0;
  return std::max(0.0, range.max - range.min) / (type == SampleType::kUint8 ? 255 : 65535);
}

double ChannelSamples::value(const EncodedPlane& plane, std::size_t voxel) const {
  const std::size_t at = voxel * stride + index;
  if (type == SampleType::kFloat32) return read<float>(plane, at);
  return range.min +
         quantum() * (type == SampleType::kUint8 ? read<std::uint8_t>(plane, at) : read<std::uint16_t>(plane, at));
}

double tolerance_of(const SolidSummary& solid, const SliceJob& job, std::uint32_t channel) {
  const ChannelRange& range = solid.channels[channel];
  double tolerance = std::numeric_limits<double>::infinity();
  const auto allow = [&](double span, double default_share) {
    const double share = job.channel_tolerance.value_or(default_share);
    tolerance = std::min(tolerance, share * std::min(span, range.max - range.min));
  };
  for (const PlaneSpec& plane : job.planes) {
    if (!contains(channels_of_plane(plane), range.name)) continue;
    const double span = plane.range ? plane.range->max - plane.range->min : std::numeric_limits<double>::infinity();
    allow(span, plane.sample_type == SampleType::kUint8 ? kDefaultOfBytes : kDefault);
  }
  if (job.printing) {
    for (const MaterialMap* map : maps_of(*job.printing)) {
      if (contains(kind_channels_of(*map), range.name)) allow(steepest_span_of(*map), kDefaultOfBytes);
      const bool is_compared =
          std::ranges::find(map->overrides, range.name, &MapOverride::channel) != map->overrides.end();
      if (is_compared) allow(std::numeric_limits<double>::infinity(), kDefault);
    }
  }
  return std::max(tolerance, 1e-9 * std::max({std::abs(range.min), std::abs(range.max), 1e-30}));
}

std::vector<ChannelSamples> samples_of(const LimitSolid& solid, const SliceJob& job, const PlaneSpec& plane) {
  const std::vector<std::string> channels = channels_of_plane(plane);
  const std::vector<ChannelRange>& ranges = solid.summary().channels;
  std::vector<ChannelSamples> samples;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::uint32_t channel = *ChannelTable(ranges).at(channels[i]).of_solid;
    samples.push_back({channel, plane.sample_type, i, channels.size(), value_range(plane, ranges[channel]),
                       tolerance_of(solid.summary(), job, channel)});
  }
  return samples;
}

}  // namespace ccslice::oracle
