// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the values of a channel come from that isn't the solid's own: a function of the point, and of other channels
// there. Each kind (a volume, a formula, a distance) is a class of its own. Planes, maps, halftones and pictures know a
// channel by its name and never ask for its kind.
//
// The solid's own channels are not sampled row by row: polynomials paint a slab of them at once (interpolation/), or
// voxels are inverted from one another (field/material_pass.h). Sources read what came of that.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// Points side by side, mm: centres of voxels in a row of a layer, or of pixels. They follow from the row alone, not
/// from where the work on it begins, so that any window gives the same values to the bit.
struct SourceRow {
  Vec3 world_first, world_step;               // Point 0 of the row, and from one to the next: world frame.
  Vec3 mesh_first, mesh_step;                 // The same ones in the frame of the part's mesh.
  std::uint32_t begin = 0;                    // The first that is asked for,
  std::uint32_t count = 0;                    // and how many.
  const CancellationToken* cancel = nullptr;  // Null: nothing cancels the work on it.
  std::span<const float> bounds = {};  // If there are any, a value need only be on its side of each: below it, or not.

  /// REQUIRES: k < count.
  Vec3 world(std::uint32_t k) const { return world_first + static_cast<double>(begin + k) * world_step; }
  Vec3 mesh(std::uint32_t k) const { return mesh_first + static_cast<double>(begin + k) * mesh_step; }
};

/// Immutable; safe to use from any thread.
class ChannelSource {
 public:
  virtual ~ChannelSource() = default;

  /// The channel's name, and bounds of its values, which are finite.
  virtual const ChannelRange& range() const noexcept = 0;
  /// The channels that its values are made of: the solid's own, or those of sources that come before it in the job.
  /// They are as near to the exact ones as if they were shown as floats (SliceJob::channel_tolerance).
  virtual std::span<const std::string> inputs() const noexcept { return {}; }
  /// values[k]: at point k of the row. `inputs`: values of inputs() at the same points, in that order. REQUIRES:
  /// row.count of each.
  virtual void sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                          std::span<float> values) const = 0;
  /// Values of a point of the mesh are the same wherever the part is moved, those of its inputs being so.
  virtual bool follows_part() const noexcept { return false; }
  /// About what it makes for itself, however many rows are sampled. Throws Error{kCancelled}.
  virtual double memory_bytes(const CancellationToken& /*cancel*/ = {}) const { return 0; }
};

using ChannelSources = std::vector<std::shared_ptr<const ChannelSource>>;

}  // namespace ccslice
