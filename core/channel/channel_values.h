// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// All channels at single points: the solid's, and those of sources.

#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

class ChannelValues {
 public:
  /// `sources`: each after those that it reads; they outlive this.
  ChannelValues(const std::vector<ChannelRange>& of_solid, const ChannelSources& sources);

  /// The solid's, then the sources'.
  const std::vector<ChannelRange>& channels() const { return channels_; }

  /// Sets values of sources at a point, in both frames. `values`: of channels(); the solid's are there.
  void complete(const Vec3& world, const Vec3& mesh, std::span<double> values) const;

 private:
  std::size_t number_of(std::string_view name) const;

  const ChannelSources& sources_;
  std::vector<ChannelRange> channels_;
  std::vector<std::vector<std::size_t>> inputs_;  // By source: numbers of the channels that it reads.
};

}  // namespace ccslice
