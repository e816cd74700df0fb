// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_planes.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/output/encodings.h"
#include "core/output/region_colours.h"

namespace ccslice {
namespace {

// The planes of one channel each that a plane is made of; none for the occupancy.
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

// Planes of floats side by side, voxel by voxel. REQUIRES: planes of the same size, kFloat32.
void interleave(std::span<const ContonePlane> planes, std::vector<std::uint8_t>& samples,
                const CancellationToken& cancel) {
  constexpr std::size_t kSample = sizeof(float), kRun = 1 << 16;
  const std::size_t voxels = planes.front().image().samples.size() / kSample, step = kSample * planes.size();
  samples.resize(step * voxels);
  for (std::size_t begin = 0; begin < voxels; begin += kRun) {
    cancel.throw_if_cancelled();
    const std::size_t end = std::min(voxels, begin + kRun);
    for (std::size_t plane = 0; plane < planes.size(); ++plane) {
      const std::uint8_t* in = planes[plane].image().samples.data();
      std::uint8_t* out = samples.data() + kSample * plane;
      for (std::size_t voxel = begin; voxel < end; ++voxel)
        std::memcpy(out + step * voxel, in + kSample * voxel, kSample);
    }
  }
}

}  // namespace

bool shows_materials(const SliceJob& job) {
  return std::any_of(job.planes.begin(), job.planes.end(), [](const PlaneSpec& plane) {
    return plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask;
  });
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

LayerPlanes::LayerPlanes(const SliceJob& job, const SolidSummary& solid)
    : job_(job), channels_(solid.channels), region_palette_(region_palette(solid.cell_regions.size())) {
  for (const PlaneSpec& plane : shown_channels(job)) contone_.emplace_back(plane, channels_[plane.channel]);
  shown_ = contone_.size();
  for (const PlaneSpec& plane : mixed_channels(job)) contone_.emplace_back(plane, channels_[plane.channel]);
}

void LayerPlanes::clear(const LayerWindow& window, const CancellationToken& cancel) {
  for (ContonePlane& plane : contone_) plane.clear(window.columns, window.rows, cancel);
}

std::vector<EncodedPlane> LayerPlanes::encode(std::span<const VoxelRun> spans, IndexImage materials,
                                              std::span<const RegionRun> regions, const Arrangement& arrangement,
                                              const CancellationToken& cancel) {
  std::vector<EncodedPlane> planes;
  const PixelPitch pitch{job_.grid.pitch.x_mm, job_.grid.pitch.y_mm};
  std::span<const ContonePlane> left = std::span(contone_).first(shown_);
  if (shows_materials(job_)) {
    materials.indices = arrange(materials.indices, 1, arrangement, indices_, cancel);
    materials.width = arrangement.to.columns;
    materials.height = arrangement.to.rows;
    materials.pitch = pitch;
  }
  bool has_bits = false;
  const auto inside = [&]() -> const BitImage& {
    if (!std::exchange(has_bits, true)) arrange_bits(spans, arrangement, bits_);
    return bits_;
  };
  std::span<const std::uint8_t> region_numbers;
  if (shows_cell_regions(job_)) {
    draw_regions(regions, arrangement.to, region_numbers_);
    region_numbers =
        arrange(region_numbers_, 1, {arrangement.to, arrangement.to, arrangement.order}, ordered_regions_, cancel);
  }
  for (const PlaneSpec& plane : job_.planes) {
    if (plane.content == PlaneContent::kCellRegions) {
      const IndexImage numbers{arrangement.to.columns, arrangement.to.rows, region_numbers, region_palette_, pitch};
      planes.push_back(encoder_.encode(numbers, plane.sample_type, plane.encoding, cancel));
      continue;
    }
    if (plane.content == PlaneContent::kMaterials) {
      planes.push_back(encoder_.encode(materials, plane.sample_type, plane.encoding, cancel));
      continue;
    }
    if (plane.content == PlaneContent::kMaterialMask) {
      planes.push_back(encoder_.encode_mask(materials, plane.material, plane.encoding, cancel));
      continue;
    }
    SampleImage image;
    std::vector<std::string> names;
    if (plane.content == PlaneContent::kOccupancy) {
      image = {SampleType::kBit, inside().width, inside().height, inside().bits};
    } else {
      names = channel_names(plane);
      image = arranged_samples(left.first(names.size()), arrangement, cancel);
      image.channel_names = names;
      left = left.subspan(names.size());
      if (find_encoding(plane.encoding)->has_alpha) image.inside = inside().bits;
    }
    image.pitch = pitch;
    planes.push_back(encoder_.encode(image, plane.encoding, cancel));
  }
  return planes;
}

std::vector<std::string> LayerPlanes::channel_names(const PlaneSpec& plane) const {
  std::vector<std::string> names;
  for (const PlaneSpec& single : channels_of_plane(plane)) names.push_back(channels_[single.channel].name);
  return names;
}

SampleImage LayerPlanes::arranged_samples(std::span<const ContonePlane> planes, const Arrangement& arrangement,
                                          const CancellationToken& cancel) {
  SampleImage image = planes.front().image();
  if (planes.size() > 1) {
    interleave(planes, interleaved_, cancel);
    image.samples = interleaved_;
  }
  const std::size_t bytes = sample_bytes(image.type, 1, 1, static_cast<std::uint32_t>(planes.size()));
  image.samples = arrange(image.samples, bytes, arrangement, arranged_, cancel);
  image.width = arrangement.to.columns;
  image.height = arrangement.to.rows;
  return image;
}

}  // namespace ccslice
