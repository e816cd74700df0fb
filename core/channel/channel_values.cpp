// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/channel/channel_values.h"

#include <algorithm>
#include <string>

namespace ccslice {

ChannelValues::ChannelValues(const std::vector<ChannelRange>& of_solid, const ChannelSources& sources)
    : sources_(sources), channels_(of_solid) {
  for (const auto& source : sources_) {
    std::vector<std::size_t>& read = inputs_.emplace_back();
    for (const std::string& name : source->inputs()) read.push_back(number_of(name));
    channels_.push_back(source->range());
  }
}

std::size_t ChannelValues::number_of(std::string_view name) const {
  return static_cast<std::size_t>(std::ranges::find(channels_, name, &ChannelRange::name) - channels_.begin());
}

void ChannelValues::complete(const Vec3& world, const Vec3& mesh, std::span<double> values) const {
  const SourceRow point{world, Vec3::Zero(), mesh, Vec3::Zero(), 0, 1};
  std::vector<float> inputs;
  std::vector<std::span<const float>> rows;
  auto value = values.end() - static_cast<std::ptrdiff_t>(sources_.size());
  for (std::size_t i = 0; i < sources_.size(); ++i, ++value) {
    inputs.clear();
    for (const std::size_t channel : inputs_[i]) inputs.push_back(static_cast<float>(values[channel]));
    rows.clear();
    for (const float& input : inputs) rows.emplace_back(&input, 1);
    float result = 0;
    sources_[i]->sample_row(point, rows, {&result, 1});
    *value = result;
  }
}

}  // namespace ccslice
