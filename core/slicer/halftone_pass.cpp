// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/halftone_pass.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kBlock = kMixBlock;
constexpr int kPlaceDigits = 6;

}  // namespace

HalftonePass::HalftonePass(const HalftonePlan& plan)
    : plan_(plan),
      halftoner_(plan),
      palette_(palette_of(plan.printing())),
      histogram_(plan.printing().materials.size()),
      values_(plan.mixture().channels().size()) {}

void HalftonePass::run(const Place& place, std::span<const VoxelRun> spans, std::span<const ContonePlane> channels,
                       const CancellationToken& cancel) {
  cancel.throw_if_cancelled();
  window_ = place.window;
  indices_.assign(std::size_t{window_.columns} * window_.rows, 0);
  std::fill(histogram_.begin(), histogram_.end(), 0);
  halftoner_.start_layer(place.lattice.width, place.layer);
  while (!spans.empty()) {
    cancel.throw_if_cancelled();
    const auto end =
        std::find_if(spans.begin(), spans.end(), [&](const VoxelRun& span) { return span.row != spans[0].row; });
    row_.clear();
    for (const VoxelRun& span : spans.first(static_cast<std::size_t>(end - spans.begin()))) {
      const VoxelRun part = window_.clipped(span);
      if (part.begin < part.end) row_.push_back(part);
    }
    if (!row_.empty()) run_row(place, row_, channels);
    count(place, row_);
    spans = {end, spans.end()};
  }
}

void HalftonePass::run_row(const Place& place, std::span<const VoxelRun> row, std::span<const ContonePlane> channels) {
  halftoner_.start_row(row.front().row);
  const bool reverse = halftoner_.reverse();
  for (std::size_t i = 0; i < row.size(); ++i) {
    const VoxelRun& run = reverse ? row[row.size() - 1 - i] : row[i];
    const std::uint32_t first = run.begin / kBlock, last = (run.end - 1) / kBlock;
    for (std::uint32_t step = 0; step <= last - first; ++step) {
      run_block(place, run, reverse ? last - step : first + step, channels);
    }
  }
}

void HalftonePass::run_block(const Place& place, const VoxelRun& run, std::uint32_t block,
                             std::span<const ContonePlane> channels) {
  const std::uint32_t left = block * kBlock;
  const std::uint32_t begin = std::max(run.begin, left) - left, end = std::min(run.end, left + kBlock) - left;
  const std::size_t index = window_.index(left + begin, run.row);
  for (std::size_t channel = 0; channel < channels.size(); ++channel) {
    const std::uint8_t* samples = channels[channel].image().samples.data();
    std::memcpy(&values_[channel][begin], samples + sizeof(float) * index, sizeof(float) * (end - begin));
  }
  if (plan_.printing().map.strict) {
    const auto misfit = plan_.mixture().first_misfit(values_, begin, end);
    if (misfit) refuse(place, left + static_cast<std::uint32_t>(*misfit), run.row, *misfit);
  }
  plan_.mixture().evaluate(values_, fractions_);
  std::array<std::uint8_t, kBlock> chosen;
  halftoner_.choose(block, begin, end, fractions_, chosen.data());
  std::copy(chosen.begin() + begin, chosen.begin() + end, indices_.begin() + static_cast<std::ptrdiff_t>(index));
}

void HalftonePass::count(const Place& place, std::span<const VoxelRun> row) {
  for (const VoxelRun& run : row) {
    const VoxelRun part = place.counted.clipped(run);
    if (part.begin == part.end) continue;
    const auto begin = indices_.begin() + static_cast<std::ptrdiff_t>(window_.index(part.begin, part.row));
    for (std::size_t m = 0; m < histogram_.size(); ++m) {
      histogram_[m] += static_cast<std::uint64_t>(std::count(begin, begin + (part.end - part.begin), m + 1));
    }
  }
}

void HalftonePass::refuse(const Place& place, std::uint32_t x, std::uint32_t y, std::size_t voxel) const {
  const Vec3 centre = place.lattice.centre(x, y, place.z_mm);
  std::string values;
  for (const MixRow& row : values_) values += (values.empty() ? "" : ", ") + number_text(row[voxel], kPlaceDigits);
  throw Error(ErrorCode::kFractionsOutOfRange,
              "printing.map.strict: in layer " + std::to_string(place.layer) + " at (" +
                  number_text(centre.x(), kPlaceDigits) + ", " + number_text(centre.y(), kPlaceDigits) + ", " +
                  number_text(centre.z(), kPlaceDigits) + ") mm the channels' values give no fractions: " + values +
                  "; correct them or the map, or leave strict out",
              "printing.map.strict");
}

}  // namespace ccslice
