// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile_layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/field/contone.h"
#include "core/slicer/slice_range.h"

namespace ccslice::oracle {
namespace {

template <typename Sample>
double read(const EncodedPlane& plane, std::size_t index) {
  Sample sample;
  std::memcpy(&sample, plane.bytes.data() + index * sizeof sample, sizeof sample);
  return static_cast<double>(sample);
}

double tolerance_of(const SliceJob& job, const PlaneSpec& plane, const ChannelRange& channel) {
  const double default_share = plane.sample_type == SampleType::kUint8 ? 1.0 / 1024 : 1.0 / 65536;
  const double span = plane.range ? plane.range->max - plane.range->min : std::numeric_limits<double>::infinity();
  const double rounding = 1e-9 * std::max({std::abs(channel.min), std::abs(channel.max), 1e-30});
  return std::max(job.material_tolerance.value_or(default_share) * std::min(span, channel.max - channel.min), rounding);
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
  result.material_tolerance = 0;
  result.contours = true;
  result.planes.clear();
  PlaneSpec plane;
  plane.encoding = Encoding::kRaw;
  result.planes.push_back(plane);
  plane.content = PlaneContent::kChannel;
  plane.sample_type = SampleType::kFloat32;
  for (plane.channel = 0; plane.channel < solid.channel_count(); ++plane.channel) result.planes.push_back(plane);
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

std::vector<ChannelSamples> samples_of(const LimitSolid& solid, const SliceJob& job, const PlaneSpec& plane) {
  std::vector<std::uint32_t> channels = plane.channels;
  if (plane.content == PlaneContent::kOccupancy) channels.clear();
  if (plane.content == PlaneContent::kChannel) channels = {plane.channel};
  std::vector<ChannelSamples> samples;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const ChannelRange& channel = solid.summary().channels[channels[i]];
    samples.push_back({channels[i], plane.sample_type, i, channels.size(), value_range(plane, channel),
                       tolerance_of(job, plane, channel)});
  }
  return samples;
}

}  // namespace ccslice::oracle
