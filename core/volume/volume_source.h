// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A volume in space as the values of a channel.
//
// A point p of the frame has the index x = A p + t, counted from 0 at the centre of sample 0 along each axis. The cells
// of the samples fill -1/2 <= x <= n - 1/2, and a millionth of a step more, for rounding. There, with x clamped to [0,
// n - 1], i = min(floor(x), n - 2) and w = x - i, a linear value is that of the eight samples around, one axis after
// the other:
//
//     lerp(a, b, w) = a + w (b - a):  first along k, then j, then i.
//
// A nearest value is that of sample floor(x + 1/2). Elsewhere, and where a sample that counts (w != 0) is NaN, the
// value is the one outside. All of it is computed in double precision and rounded to float at the end.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/volume/volume.h"

namespace ccslice {

/// The place of the samples, and how they are read.
struct VolumeReading {
  std::uint32_t channel = 0;
  Mat3 index_of_mm = Mat3::Identity();  // A; per mm.
  Vec3 first_index = Vec3::Zero();      // t
  bool in_world = false;                // p is of the world's frame, or else of the mesh's.
  bool nearest = false;
  double slope = 1, intercept = 0;  // A value is slope * sample + intercept.
  double outside_value = 0;
};

/// Bounds of the values in the box: those of the channel's samples, and the value outside unless the box is within the
/// samples' cells and none of them is NaN. REQUIRES: the channel is one of the volume's.
std::array<double, 2> value_bounds(const Volume& volume, const VolumeReading& reading, const Box3& box);

class VolumeSource final : public ChannelSource {
 public:
  /// Values are clamped to the range. REQUIRES: the channel is one of the volume's; range.min <= range.max, both of
  /// which floats can hold.
  VolumeSource(ChannelRange range, std::shared_ptr<const Volume> volume, const VolumeReading& reading);

  const ChannelRange& range() const noexcept override { return range_; }
  void sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                  std::span<float> values) const override;
  bool follows_part() const noexcept override { return !reading_.in_world; }

  /// Whether the point has the value outside.
  bool is_outside(const Vec3& world, const Vec3& mesh) const;
  /// Corners of the samples' cells, in the frame of the field, mm.
  Box3 box() const;

 private:
  ChannelRange range_;
  std::shared_ptr<const Volume> volume_;
  VolumeReading reading_;
  bool has_nan_;
};

}  // namespace ccslice
