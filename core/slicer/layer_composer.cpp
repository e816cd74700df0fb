// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_composer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/place_text.h"
#include "core/channel/channel_table.h"
#include "core/output/encodings.h"
#include "core/output/region_colours.h"
#include "core/slicer/part_planes.h"

namespace ccslice {
namespace {

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

std::uint64_t size_of(const VoxelRun& run) { return run.end - run.begin; }

}  // namespace

LayerComposer::LayerComposer(const PlacedParts& parts)
    : parts_(parts), job_(parts.front().job), region_(region_of(job_).window()), order_(parts.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (const PlacedPart& part : parts) {
    numbers_.push_back(numbers_.empty() ? 0 : numbers_.back() + (part.is_copy ? 0 : 1));
  }
  std::ranges::stable_sort(order_, std::greater<>(), [&](std::uint32_t part) { return parts[part].priority; });
  const std::vector<std::string> names = cell_region_names(parts);
  for (const PlacedPart& part : parts) {
    std::vector<std::uint8_t>& numbers = regions_of_.emplace_back();
    for (const CellRegionSummary& region : part.solid->summary().cell_regions) {
      numbers.push_back(static_cast<std::uint8_t>(std::ranges::find(names, region.name) - names.begin()));
    }
  }
  region_palette_ = region_palette(names.size());
  if (chooses_materials(job_)) material_palette_ = palette_of(*job_.printing);
  if (parts.size() == 1) return;
  const ChannelTable table(parts.front().solid->summary().channels, job_.sources);
  for (const PlaneSpec& plane : shown_channels(job_)) {
    channels_.emplace_back(plane, table.at(plane.channel).range, std::nullopt);
  }
  const LayerWindow most = common_window(whole_bytes(window_of_parts(parts)), region_);
  const std::size_t voxels = std::size_t{most.columns} * most.rows;
  for (ContonePlane& plane : channels_) plane.reserve(voxels);
  if (chooses_materials(job_)) materials_.reserve(voxels);
}

void LayerComposer::start(std::uint32_t layer, const LayerWindow& window) {
  window_ = common_window(window, region_);
  layer_ = {};
  layer_.index = layer;
  layer_.z_mm = job_.grid.layer_z_mm(layer);
  if (parts_.size() > 1) {
    const std::size_t materials = chooses_materials(job_) ? job_.printing->materials.size() : 0;
    layer_.stats.material_voxels.assign(materials, 0);
    layer_.stats.parts.assign(numbers_.back() + 1, {0, layer_.stats.material_voxels});
  }
  only_.reset();
  is_cleared_ = false;
  owners_.clear();
  regions_.clear();
}

void LayerComposer::add(std::uint32_t part, const PaintedPart& painted, const CancellationToken& cancel) {
  add_contours(part, painted);
  if (parts_.size() == 1) {
    layer_.stats = painted.stats;
    only_ = painted;
    return;
  }
  add_stats(painted);
  add_samples(part, painted, cancel);
}

void LayerComposer::add_contours(std::uint32_t part, const PaintedPart& painted) {
  Contours& all = layer_.contours;
  for (const ContourLoop& loop : painted.shape->contours.loops) all.loops.emplace_back(loop).part = part;
  all.leaves += painted.shape->contours.leaves;
  all.unresolved_leaves += painted.shape->contours.unresolved_leaves;
  for (const RegionLoop& loop : painted.shape->region_loops) {
    RegionLoop& added = layer_.region_loops.emplace_back(loop);
    added.region = regions_of_[part][loop.region];
    added.part = part;
  }
}

void LayerComposer::add_stats(const PaintedPart& painted) {
  LayerStats& all = layer_.stats;
  const LayerStats& of = painted.stats;
  all.voxels_cut += of.voxels_cut;
  all.voxels_coherent += of.voxels_coherent;
  all.voxels_full += of.voxels_full;
  all.voxels_interpolated += of.voxels_interpolated;
  all.voxels_repainted += of.voxels_repainted;
  all.voxels_unresolved += of.voxels_unresolved;
  all.max_residual_mm = std::max(all.max_residual_mm, of.max_residual_mm);
  all.contour_loops += of.contour_loops;
  all.contour_points += of.contour_points;
  all.contour_leaves_unresolved += of.contour_leaves_unresolved;
  all.voxels_off_map += of.voxels_off_map;
  if (of.voxels_scaled_up > 0) {
    const bool is_first = all.voxels_scaled_up == 0;
    all.least_fraction_sum = is_first ? of.least_fraction_sum : std::min(all.least_fraction_sum, of.least_fraction_sum);
    all.voxels_scaled_up += of.voxels_scaled_up;
  }
}

/// Sets all samples to those outside, once a layer.
void LayerComposer::clear_samples(const CancellationToken& cancel) {
  if (std::exchange(is_cleared_, true)) return;
  for (ContonePlane& plane : channels_) plane.clear(window_.columns, window_.rows, cancel);
  if (chooses_materials(job_)) materials_.assign(std::size_t{window_.columns} * window_.rows, 0);
}

void LayerComposer::add_samples(std::uint32_t part, const PaintedPart& painted, const CancellationToken& cancel) {
  clear_samples(cancel);
  cancel.throw_if_cancelled();
  const auto owned = owners_.add(part, painted.shape->spans, [&](const OwnedRun& run) { note_covered(part, run); });
  count_owned(part, painted, owned);
  for (const VoxelRun& run : owned) {
    const VoxelRun kept = window_.clipped(run);
    if (kept.begin == kept.end) continue;
    const std::size_t from = painted.window.index(kept.begin, kept.row), to = window_.index(kept.begin, kept.row);
    const auto count = static_cast<std::uint32_t>(size_of(kept));
    for (std::size_t c = 0; c < channels_.size(); ++c) channels_[c].copy_run(painted.planes[c], from, to, count);
    if (chooses_materials(job_)) std::memcpy(&materials_[to], &painted.materials.indices[from], count);
  }
  if (shows_cell_regions(job_)) add_regions(part, painted.shape->regions, owned);
}

/// `owned`: what the part has of its voxels.
void LayerComposer::count_owned(std::uint32_t part, const PaintedPart& painted, std::span<const VoxelRun> owned) {
  std::uint64_t voxels = 0;
  for (const VoxelRun& run : owned) voxels += size_of(region_.clipped(run));
  LayerStats& all = layer_.stats;
  PartVoxels& own = all.parts[numbers_[part]];
  all.voxels_inside += voxels;
  own.voxels += voxels;
  if (!chooses_materials(job_)) return;
  std::vector<std::uint64_t> materials = painted.stats.material_voxels;
  if (voxels != painted.stats.voxels_inside) {
    std::array<std::uint64_t, 256> histogram{};
    for (const VoxelRun& run : owned) {
      const VoxelRun kept = region_.clipped(run);
      if (kept.begin == kept.end) continue;
      const auto row = painted.materials.indices.subspan(painted.window.index(kept.begin, kept.row), size_of(kept));
      for (const std::uint8_t material : row) ++histogram[material];
    }
    materials.assign(histogram.begin() + 1,
                     histogram.begin() + 1 + static_cast<std::ptrdiff_t>(own.material_voxels.size()));
  }
  for (std::size_t m = 0; m < materials.size(); ++m) {
    all.material_voxels[m] += materials[m];
    own.material_voxels[m] += materials[m];
  }
}

/// `run`: voxels of the part that belong to another one.
void LayerComposer::note_covered(std::uint32_t part, const OwnedRun& run) {
  constexpr int kDigits = 6;
  const VoxelRun covered = region_.clipped(run);
  if (covered.begin == covered.end) return;
  layer_.stats.voxels_covered += size_of(covered);
  std::vector<PartOverlap>& known = layer_.stats.overlaps;
  const auto pair = std::ranges::find_if(
      known, [&](const PartOverlap& overlap) { return overlap.owner == run.part && overlap.covered == part; });
  if (pair != known.end()) {
    pair->voxels += size_of(covered);
    return;
  }
  const Vec3 place = job_.grid.lattice().centre(covered.begin, covered.row, layer_.z_mm);
  if (known.size() < kMostOverlaps) known.push_back({run.part, part, size_of(covered), place});
  if (!job_.refuses_overlaps) return;
  throw Error(ErrorCode::kPartsOverlap,
              "overlaps: parts '" + echoed(parts_[run.part].name) + "' and '" + echoed(parts_[part].name) +
                  "' share voxels, in layer " + std::to_string(layer_.index) + " at " + place_text(place, kDigits) +
                  "; move them apart, or leave overlaps out, and the one with the higher priority takes them",
              "overlaps");
}

/// Adds the regions' runs, as far as they lie in the part's own voxels.
void LayerComposer::add_regions(std::uint32_t part, std::span<const RegionRun> regions,
                                std::span<const VoxelRun> owned) {
  auto run = owned.begin();
  for (const RegionRun& region : regions) {
    const auto is_before = [&] {
      return run->row < region.row || (run->row == region.row && run->end <= region.begin);
    };
    while (run != owned.end() && is_before()) ++run;
    for (auto met = run; met != owned.end() && met->row == region.row && met->begin < region.end; ++met) {
      regions_.push_back({{region.row, std::max(region.begin, met->begin), std::min(region.end, met->end)},
                          regions_of_[part][region.region]});
    }
  }
}

/// Leaves out of the counts of voxels those that nothing is printed in.
void LayerComposer::discount_empty_voxels() {
  if (!leaves_voxels_empty(job_)) return;
  const MaterialSet printed = printed_materials(*job_.printing);
  const auto discount = [&](std::uint64_t& voxels, std::span<const std::uint64_t> of_materials) {
    for (std::size_t m = 0; m < of_materials.size(); ++m) voxels -= (printed >> (m + 1) & 1) == 0 ? of_materials[m] : 0;
  };
  discount(layer_.stats.voxels_inside, layer_.stats.material_voxels);
  for (PartVoxels& part : layer_.stats.parts) discount(part.voxels, part.material_voxels);
}

Layer LayerComposer::finish(const CancellationToken& cancel) {
  discount_empty_voxels();
  if (only_) {
    layer_.planes = encode(
        {only_->window, only_->shape->spans, only_->shape->regions, only_->planes, only_->materials.indices}, cancel);
    return std::move(layer_);
  }
  clear_samples(cancel);
  inside_.clear();
  for (const OwnedRun& run : owners_.runs()) {
    const bool goes_on = !inside_.empty() && inside_.back().row == run.row && inside_.back().end == run.begin;
    if (goes_on) {
      inside_.back().end = run.end;
    } else {
      inside_.push_back(run);
    }
  }
  layer_.planes = encode({window_, inside_, regions_, channels_, materials_}, cancel);
  return std::move(layer_);
}

/// As an encoding takes it: all of the picture, or what there is of it.
IndexImage LayerComposer::numbers_for(const PlaneSpec& plane, Numbers& numbers, const CancellationToken& cancel) const {
  const bool windowed = find_encoding(plane.encoding)->takes_window;
  const Arrangement& all = numbers.arrangement;
  auto& made = numbers.made[windowed ? 1 : 0];
  if (!made) {
    constexpr std::array<std::uint8_t, 1> kBackground{};
    made = arrange(numbers.indices, kBackground, windowed ? held_arrangement(all) : all,
                   numbers.memory[windowed ? 1 : 0], cancel);
  }
  return {.width = region_.columns,
          .height = region_.rows,
          .indices = *made,
          .palette = numbers.palette,
          .pitch = {job_.grid.pitch.x_mm, job_.grid.pitch.y_mm},
          .spans = arranged_spans_,
          .window = windowed ? std::optional(held_window(all)) : std::nullopt};
}

std::vector<EncodedPlane> LayerComposer::encode(const Samples& samples, const CancellationToken& cancel) {
  std::vector<EncodedPlane> planes;
  const Arrangement arrangement{samples.window, region_, job_.order};
  arrange_spans(samples.inside, arrangement, arranged_spans_);
  bool has_bits = false;
  const auto inside = [&]() -> const BitImage& {
    if (!std::exchange(has_bits, true)) draw_bits(arranged_spans_, region_.columns, region_.rows, bits_);
    return bits_;
  };
  material_numbers_.start(samples.materials, material_palette_, arrangement);
  if (shows_cell_regions(job_)) {
    const LayerWindow drawn = common_window(window_of(samples.inside), region_);
    draw_regions(samples.regions, drawn, region_numbers_);
    cell_region_numbers_.start(region_numbers_, region_palette_, {drawn, region_, job_.order});
  }
  std::span<const ContonePlane> left = samples.channels;
  for (const PlaneSpec& plane : job_.planes) {
    if (plane.content == PlaneContent::kCellRegions) {
      const IndexImage numbers = numbers_for(plane, cell_region_numbers_, cancel);
      planes.push_back(encoder_.encode(numbers, plane.sample_type, plane.encoding, cancel));
      continue;
    }
    if (plane.content == PlaneContent::kMaterials) {
      const IndexImage materials = numbers_for(plane, material_numbers_, cancel);
      planes.push_back(encoder_.encode(materials, plane.sample_type, plane.encoding, cancel));
      continue;
    }
    const bool is_mask = plane.content == PlaneContent::kMaterialMask;
    if (is_mask || (plane.content == PlaneContent::kOccupancy && leaves_voxels_empty(job_))) {
      const IndexImage materials = numbers_for(plane, material_numbers_, cancel);
      const MaterialSet shown = is_mask ? MaterialSet{1} << plane.material : printed_materials(*job_.printing);
      planes.push_back(encoder_.encode_mask(materials, shown, plane.encoding, cancel));
      continue;
    }
    SampleImage image;
    std::vector<std::string> names;
    if (plane.content == PlaneContent::kOccupancy) {
      image = {SampleType::kBit, inside().width, inside().height, inside().bits};
    } else {
      names = plane.content == PlaneContent::kChannel ? std::vector{plane.channel} : plane.channels;
      image = arranged_samples(left.first(names.size()), plane, arrangement, cancel);
      image.channel_names = names;
      left = left.subspan(names.size());
      if (find_encoding(plane.encoding)->has_alpha) image.inside = inside().bits;
    }
    image.pitch = {job_.grid.pitch.x_mm, job_.grid.pitch.y_mm};
    image.spans = arranged_spans_;
    planes.push_back(encoder_.encode(image, plane.encoding, cancel));
  }
  return planes;
}

SampleImage LayerComposer::arranged_samples(std::span<const ContonePlane> planes, const PlaneSpec& spec,
                                            const Arrangement& arrangement, const CancellationToken& cancel) {
  const bool windowed = find_encoding(spec.encoding)->takes_window;
  SampleImage image = planes.front().image();
  if (planes.size() > 1) {
    interleave(planes, interleaved_, cancel);
    image.samples = interleaved_;
  }
  const std::size_t bytes = sample_bytes(image.type, 1, 1);
  std::vector<std::uint8_t> outside;
  for (std::size_t i = 0; i < bytes * planes.size(); ++i) outside.push_back(image.outside[i % bytes]);
  image.samples =
      arrange(image.samples, outside, windowed ? held_arrangement(arrangement) : arrangement, arranged_, cancel);
  image.width = arrangement.to.columns;
  image.height = arrangement.to.rows;
  if (windowed) image.window = held_window(arrangement);
  return image;
}

}  // namespace ccslice
