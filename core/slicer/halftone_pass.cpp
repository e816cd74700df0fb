// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/halftone_pass.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/place_text.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kBlock = kMixBlock;
constexpr int kPlaceDigits = 6;

}  // namespace

HalftonePass::HalftonePass(const HalftonePlan& plan, std::size_t voxels)
    : plan_(plan),
      halftoner_(plan),
      palette_(palette_of(plan.printing())),
      histogram_(plan.printing().materials.size()) {
  indices_.reserve(voxels);
  const std::vector<const MaterialMap*> maps = maps_of(plan.printing());
  const std::vector<std::string> channels = channels_of(plan.printing());
  values_.resize(channels.size());
  for (std::size_t i = 0; i < plan.mixtures().size(); ++i) {
    const Mixture& mixture = plan.mixtures()[i];
    const std::string field = i == 0 ? "map" : "cell_region_maps[" + std::to_string(i - 1) + "].map";
    sources_.push_back({mixture, maps[i]->strict, "printing." + field + ".strict", places_among(channels, mixture)});
  }
}

void HalftonePass::run(const Place& place, std::span<const VoxelRun> spans, std::span<const ContonePlane> channels,
                       const CancellationToken& cancel) {
  run_all(place, spans, channels, cancel, [](const VoxelRun&) { return std::size_t{0}; });
}

void HalftonePass::run(const Place& place, std::span<const RegionRun> runs, std::span<const ContonePlane> channels,
                       const CancellationToken& cancel) {
  run_all(place, runs, channels, cancel, [&](const RegionRun& run) { return plan_.mixture_of(run.region); });
}

template <typename Run, typename MixtureOf>
void HalftonePass::run_all(const Place& place, std::span<const Run> runs, std::span<const ContonePlane> channels,
                           const CancellationToken& cancel, const MixtureOf& mixture_of) {
  cancel.throw_if_cancelled();
  window_ = place.window;
  indices_.assign(std::size_t{window_.columns} * window_.rows, 0);
  std::fill(histogram_.begin(), histogram_.end(), 0);
  misfits_ = {};
  halftoner_.start_layer(place.lattice.width, place.layer);
  while (!runs.empty()) {
    cancel.throw_if_cancelled();
    const auto end = std::find_if(runs.begin(), runs.end(), [&](const Run& run) { return run.row != runs[0].row; });
    row_.clear();
    for (const Run& run : runs.first(static_cast<std::size_t>(end - runs.begin()))) {
      const VoxelRun part = window_.clipped(run);
      if (part.begin < part.end) row_.push_back({part, mixture_of(run)});
    }
    if (!row_.empty()) run_row(place, row_, channels);
    count(place, row_);
    runs = {end, runs.end()};
  }
}

void HalftonePass::run_row(const Place& place, std::span<const MixedRun> row, std::span<const ContonePlane> channels) {
  halftoner_.start_row(row.front().row);
  const bool reverse = halftoner_.reverse();
  for (std::size_t i = 0; i < row.size(); ++i) {
    const MixedRun& run = reverse ? row[row.size() - 1 - i] : row[i];
    const std::uint32_t first = run.begin / kBlock, last = (run.end - 1) / kBlock;
    for (std::uint32_t step = 0; step <= last - first; ++step) {
      run_block(place, run, reverse ? last - step : first + step, channels);
    }
  }
}

void HalftonePass::run_block(const Place& place, const MixedRun& run, std::uint32_t block,
                             std::span<const ContonePlane> channels) {
  const std::uint32_t left = block * kBlock;
  const std::uint32_t begin = std::max(run.begin, left) - left, end = std::min(run.end, left + kBlock) - left;
  const std::size_t index = window_.index(left + begin, run.row);
  const Source& source = sources_[run.mixture];
  for (std::size_t row = 0; row < source.planes.size(); ++row) {
    const std::uint8_t* samples = channels[source.planes[row]].image().samples.data();
    std::memcpy(&values_[row][begin], samples + sizeof(float) * index, sizeof(float) * (end - begin));
  }
  if (source.strict) {
    const auto misfit = source.mixture.first_misfit(values_, begin, end);
    if (misfit) refuse(place, source, left + static_cast<std::uint32_t>(*misfit), run.row, *misfit);
  }
  count_misfits(place, source, {run.row, left + begin, left + end});
  source.mixture.evaluate(values_, fractions_);
  std::array<std::uint8_t, kBlock> chosen;
  halftoner_.choose(block, begin, end, fractions_, chosen.data());
  std::copy(chosen.begin() + begin, chosen.begin() + end, indices_.begin() + static_cast<std::ptrdiff_t>(index));
}

void HalftonePass::count(const Place& place, std::span<const MixedRun> row) {
  for (const MixedRun& run : row) {
    const VoxelRun part = place.counted.clipped(run);
    if (part.begin == part.end) continue;
    const auto begin = indices_.begin() + static_cast<std::ptrdiff_t>(window_.index(part.begin, part.row));
    for (std::size_t m = 0; m < histogram_.size(); ++m) {
      histogram_[m] += static_cast<std::uint64_t>(std::count(begin, begin + (part.end - part.begin), m + 1));
    }
  }
}

/// `voxels`: of one block, whose values are at hand.
void HalftonePass::count_misfits(const Place& place, const Source& source, const VoxelRun& voxels) {
  const VoxelRun part = place.counted.clipped(voxels);
  if (part.begin >= part.end) return;
  const std::uint32_t left = voxels.begin / kBlock * kBlock;
  source.mixture.count_misfits(values_, part.begin - left, part.end - left, misfits_);
}

void HalftonePass::refuse(const Place& place, const Source& source, std::uint32_t x, std::uint32_t y,
                          std::size_t voxel) const {
  const Vec3 centre = place.lattice.centre(x, y, place.z_mm);
  std::string values;
  for (std::size_t row = 0; row < source.planes.size(); ++row) {
    values += (values.empty() ? "" : ", ") + number_text(values_[row][voxel], kPlaceDigits);
  }
  throw Error(ErrorCode::kFractionsOutOfRange,
              source.field + ": in layer " + std::to_string(place.layer) + " at " + place_text(centre, kPlaceDigits) +
                  " the channels' values give no fractions: " + values +
                  "; correct them or the map, or leave strict out",
              source.field);
}

}  // namespace ccslice
