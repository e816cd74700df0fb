// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/part_planes.h"

#include <algorithm>

namespace ccslice {

bool shows_materials(const SliceJob& job) {
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
  if (!shows_materials(job)) return planes;
  for (const std::uint32_t channel : channels_of(*job.printing)) {
    PlaneSpec& plane = planes.emplace_back();
    plane.content = PlaneContent::kChannel;
    plane.channel = channel;
    plane.sample_type = SampleType::kFloat32;
  }
  return planes;
}

PartPlanes::PartPlanes(const SliceJob& job, const SolidSummary& solid) {
  for (const PlaneSpec& plane : shown_channels(job)) contone_.emplace_back(plane, solid.channels[plane.channel]);
  shown_ = contone_.size();
  for (const PlaneSpec& plane : mixed_channels(job)) contone_.emplace_back(plane, solid.channels[plane.channel]);
}

void PartPlanes::clear(const LayerWindow& window, const CancellationToken& cancel) {
  for (ContonePlane& plane : contone_) plane.clear(window.columns, window.rows, cancel);
}

}  // namespace ccslice
