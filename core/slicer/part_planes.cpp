// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/part_planes.h"

#include <string>
#include <utility>

#include "core/base/contains.h"
#include "core/channel/channel_table.h"

namespace ccslice {
namespace {

PlaneSpec float_plane(const std::string& channel) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.channel = channel;
  plane.sample_type = SampleType::kFloat32;
  return plane;
}

/// The values that overrides compare the channel with.
std::vector<float> override_bounds(const SliceJob& job, const std::string& channel) {
  std::vector<float> bounds;
  if (!chooses_materials(job)) return bounds;
  for (const MaterialMap* map : maps_of(*job.printing)) {
    for (const MapOverride& first : map->overrides) {
      if (first.channel == channel) bounds.push_back(static_cast<float>(first.below));
    }
  }
  return bounds;
}

}  // namespace

bool chooses_materials(const SliceJob& job) {
  if (leaves_voxels_empty(job)) return true;
  return std::any_of(job.planes.begin(), job.planes.end(), [](const PlaneSpec& plane) {
    return plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask;
  });
}

std::vector<PlaneSpec> channels_of_plane(const PlaneSpec& plane) {
  if (plane.content == PlaneContent::kChannel) return {plane};
  if (plane.content != PlaneContent::kChannels) return {};
  std::vector<PlaneSpec> singles(plane.channels.size(), plane);
  for (std::size_t i = 0; i < singles.size(); ++i) {
    singles[i].content = PlaneContent::kChannel;
    singles[i].channel = plane.channels[i];
  }
  return singles;
}

std::vector<PlaneSpec> shown_channels(const SliceJob& job) {
  std::vector<PlaneSpec> all;
  for (const PlaneSpec& plane : job.planes) {
    const std::vector<PlaneSpec> singles = channels_of_plane(plane);
    all.insert(all.end(), singles.begin(), singles.end());
  }
  return all;
}

std::vector<PlaneSpec> mixed_channels(const SliceJob& job) {
  std::vector<PlaneSpec> planes;
  if (!chooses_materials(job)) return planes;
  for (const std::string& channel : channels_of(*job.printing)) planes.push_back(float_plane(channel));
  return planes;
}

std::vector<PlaneSpec> override_channels(const SliceJob& job) {
  std::vector<PlaneSpec> planes;
  if (!chooses_materials(job)) return planes;
  for (const std::string& channel : override_channels_of(*job.printing)) planes.push_back(float_plane(channel));
  return planes;
}

std::vector<PlaneSpec> cut_channels(const SliceJob& job) {
  return job.cut ? std::vector{float_plane(*job.cut)} : std::vector<PlaneSpec>();
}

std::vector<UsedSource> used_sources(const SliceJob& job) {
  std::vector<UsedSource> used;
  if (job.sources.empty()) return used;
  std::vector<std::string> wanted;  // For their values.
  for (const PlaneSpec& plane : shown_channels(job)) wanted.push_back(plane.channel);
  if (chooses_materials(job)) {
    for (const MaterialMap* map : maps_of(*job.printing)) {
      const std::vector<std::string> channels = kind_channels_of(*map);
      wanted.insert(wanted.end(), channels.begin(), channels.end());
    }
  }
  if (job.cut) wanted.push_back(*job.cut);
  for (std::size_t left = job.sources.size(); left > 0; --left) {
    const ChannelSource& source = *job.sources[left - 1];
    UsedSource use{&source, {}};
    if (!contains(wanted, source.range().name)) {
      use.bounds = override_bounds(job, source.range().name);
      if (use.bounds.empty()) continue;
    }
    used.insert(used.begin(), std::move(use));
    wanted.insert(wanted.end(), source.inputs().begin(), source.inputs().end());
  }
  return used;
}

std::vector<PlaneSpec> read_channels(const SliceJob& job) {
  std::vector<std::string> read;
  for (const UsedSource& use : used_sources(job)) {
    for (const std::string& input : use.source->inputs()) {
      if (!contains(read, input)) read.push_back(input);
    }
  }
  std::vector<PlaneSpec> planes;
  for (const std::string& channel : read) planes.push_back(float_plane(channel));
  return planes;
}

std::vector<PlaneSpec> all_channels(const SliceJob& job) {
  std::vector<PlaneSpec> all = shown_channels(job);
  for (const std::vector<PlaneSpec>& more : {mixed_channels(job), cut_channels(job), read_channels(job)}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

PartPlanes::PartPlanes(const SliceJob& job, const SolidSummary& solid)
    : specs_(all_channels(job)), shown_(shown_channels(job).size()), mixed_(mixed_channels(job).size()) {
  const ChannelTable table(solid.channels, job.sources);
  for (const PlaneSpec& spec : specs_) {
    const Channel channel = table.at(spec.channel);
    contone_.emplace_back(spec, channel.range, channel.of_solid);
  }
}

void PartPlanes::reserve(const LayerWindow& window) {
  for (ContonePlane& plane : contone_) plane.reserve(std::size_t{window.columns} * window.rows);
}

void PartPlanes::clear(const LayerWindow& window, const CancellationToken& cancel) {
  for (ContonePlane& plane : contone_) plane.clear(window.columns, window.rows, cancel);
}

void PartPlanes::start(const LayerWindow& window, const CancellationToken& cancel) {
  for (std::size_t p = 0; p < contone_.size(); ++p) {
    p < shown_ ? contone_[p].clear(window.columns, window.rows, cancel)
               : contone_[p].resize(window.columns, window.rows, cancel);
  }
}

}  // namespace ccslice
