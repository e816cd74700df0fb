// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels in closed form.

#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/channel/channel_source.h"

namespace ccslice {

class ChannelFunction : public ChannelSource {
 public:
  /// From a point in the world's and in the mesh's frame, and the values of the inputs there.
  using Function = std::function<float(const Vec3& world, const Vec3& mesh, std::span<const float> inputs)>;

  ChannelFunction(ChannelRange range, std::vector<std::string> inputs, Function function)
      : range_(std::move(range)), inputs_(std::move(inputs)), function_(std::move(function)) {}

  const ChannelRange& range() const noexcept override { return range_; }
  std::span<const std::string> inputs() const noexcept override { return inputs_; }
  void sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                  std::span<float> values) const noexcept override {
    std::vector<float> here(inputs.size());
    for (std::uint32_t k = 0; k < row.count; ++k) {
      for (std::size_t i = 0; i < inputs.size(); ++i) here[i] = inputs[i][k];
      values[k] = function_(row.world(k), row.mesh(k), here);
    }
  }

 private:
  ChannelRange range_;
  std::vector<std::string> inputs_;
  Function function_;
};

}  // namespace ccslice
