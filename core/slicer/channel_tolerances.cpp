// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/channel_tolerances.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/channel/channel_table.h"
#include "core/slicer/part_planes.h"

namespace ccslice {
namespace {

constexpr double kRounding = 1e-13;    // Of values: some hundred units in the last place, below which nothing is known.
constexpr double kOfConstants = 1e-9;  // Painted values are clamped to the channel's range: constants are always right.

double default_channel_tolerance(SampleType type) { return type == SampleType::kUint8 ? 1.0 / 1024 : 1.0 / 65536; }

class ToleranceList {
 public:
  ToleranceList(const SliceJob& job, const std::vector<ChannelRange>& channels) : job_(job), table_(channels) {
    for (const PlaneSpec& plane : shown_channels(job)) {
      const double span = plane.range ? plane.range->max - plane.range->min : std::numeric_limits<double>::infinity();
      add(plane.channel, span, default_channel_tolerance(plane.sample_type));
    }
    for (const PlaneSpec& plane : mixed_channels(job)) {
      add(plane.channel, steepest_span(*job.printing, plane.channel), default_channel_tolerance(SampleType::kUint8));
    }
    for (const std::vector<PlaneSpec>& planes : {override_channels(job), cut_channels(job), read_channels(job)}) {
      for (const PlaneSpec& plane : planes) {
        add(plane.channel, std::numeric_limits<double>::infinity(), default_channel_tolerance(plane.sample_type));
      }
    }
  }
  std::vector<ChannelTolerance> take() { return std::move(list_); }

 private:
  void add(const std::string& name, double span, double default_share) {
    const std::optional<Channel> found = table_.find(name);
    if (!found) return;
    const std::uint32_t index = *found->of_solid;
    const ChannelRange& channel = found->range;
    const double share = job_.channel_tolerance.value_or(default_share);
    const double range = channel.max - channel.min;
    const double least =
        (range > 0 ? kRounding : kOfConstants) * std::max({std::abs(channel.min), std::abs(channel.max), 1e-30});
    const double tolerance = std::max(share * std::min(span, range), least);
    const auto known =
        std::find_if(list_.begin(), list_.end(), [&](const ChannelTolerance& c) { return c.channel == index; });
    if (known == list_.end()) {
      list_.push_back({index, tolerance});
    } else {
      known->tolerance = std::min(known->tolerance, tolerance);
    }
  }

  const SliceJob& job_;
  const ChannelTable table_;  // Without sources, which have no tolerances.
  std::vector<ChannelTolerance> list_;
};

}  // namespace

std::vector<ChannelTolerance> channel_tolerances(const SliceJob& job, const std::vector<ChannelRange>& channels) {
  return ToleranceList(job, channels).take();
}

double outside_mm_of(const SliceJob& job) {
  constexpr double kSlackMm = 1e-3;  // Beyond the contours' own tolerance.
  return job.contour_tolerance_mm + kSlackMm;
}

InterpolationSpec interpolation_spec_of(const SliceJob& job, const std::vector<ChannelRange>& channels) {
  return {job.placement, job.grid, channel_tolerances(job, channels), outside_mm_of(job), job.prove_channels};
}

}  // namespace ccslice
