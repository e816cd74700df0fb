// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The samples of a part's channels while a layer is worked on: those that pictures show, and those that halftoning and
// sources read, as floats, which no picture shows.

#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/channel/channel_source.h"
#include "core/field/contone.h"
#include "core/field/source_pass.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/raster/layer_window.h"

namespace ccslice {

/// Some plane shows printable materials, or depends on which of them leave voxels empty.
bool chooses_materials(const SliceJob& job);

/// The planes of one channel each that a plane is made of; none unless it shows channels.
std::vector<PlaneSpec> channels_of_plane(const PlaneSpec& plane);

/// The same of all of the job's planes, in their order.
std::vector<PlaneSpec> shown_channels(const SliceJob& job);

/// The planes that halftoning reads: the channels of the material map, in its order, as floats.
std::vector<PlaneSpec> mixed_channels(const SliceJob& job);

/// The planes of mixed_channels() that overrides of maps read.
std::vector<PlaneSpec> override_channels(const SliceJob& job);
/// The plane that tells what is cut, as floats, if something is.
std::vector<PlaneSpec> cut_channels(const SliceJob& job);

/// The job's sources whose channels are shown, mixed, cut by, or read by others of these: each after those that it
/// reads. Those that overrides alone read have their bounds.
std::vector<UsedSource> used_sources(const SliceJob& job);

/// The planes that used_sources() read: each of their inputs once, as floats.
std::vector<PlaneSpec> read_channels(const SliceJob& job);

/// shown_channels(), mixed_channels(), cut_channels() and read_channels().
std::vector<PlaneSpec> all_channels(const SliceJob& job);

/// One thread. Memory is kept from layer to layer.
class PartPlanes {
 public:
  PartPlanes(const SliceJob& job, const SolidSummary& solid);

  /// Of all_channels().
  std::span<const PlaneSpec> specs() const { return specs_; }
  std::span<ContonePlane> channels() { return contone_; }
  std::span<const ContonePlane> shown() const { return std::span(contone_).first(shown_); }
  std::span<const ContonePlane> mixed() const { return std::span(contone_).subspan(shown_, mixed_); }
  /// That of cut_channels(). REQUIRES: there is one.
  const ContonePlane& cut() const { return contone_[shown_ + mixed_]; }
  /// Sets samples that are shown to what they are outside, `count` from `index` on.
  void clear_run(std::size_t index, std::uint32_t count) {
    for (std::size_t p = 0; p < shown_; ++p) contone_[p].clear_run(index, count);
  }
  /// Some are of the solid's own channels.
  bool need_solid() const {
    return std::ranges::any_of(contone_, [](const ContonePlane& plane) { return plane.channel().has_value(); });
  }

  /// Room for windows of this size.
  void reserve(const LayerWindow& window);
  /// All samples as outside. Throws Error{kCancelled}.
  void clear(const LayerWindow& window, const CancellationToken& cancel);
  /// The same of samples that are shown. Others may be anything: of them only those inside are read.
  void start(const LayerWindow& window, const CancellationToken& cancel);

 private:
  std::vector<PlaneSpec> specs_;
  std::vector<ContonePlane> contone_;
  std::size_t shown_, mixed_;  // Of them.
};

}  // namespace ccslice
