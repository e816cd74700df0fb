// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_source.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace ccslice {

FormulaSource::FormulaSource(ChannelRange range, Formula formula, FormulaFrame frame, ChannelSources distances)
    : range_(std::move(range)), formula_(std::move(formula)), frame_(frame), distances_(std::move(distances)) {}

void FormulaSource::sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                               std::span<float> values) const {
  std::vector<float> distances(distances_.size() * row.count);
  std::vector<std::span<const float>> all;
  if (!distances_.empty()) {
    all.assign(inputs.begin(), inputs.end());
    SourceRow exactly = row;
    exactly.bounds = {};
    for (std::size_t i = 0; i < distances_.size(); ++i) {
      const std::span<float> sampled = std::span(distances).subspan(i * row.count, row.count);
      distances_[i]->sample_row(exactly, {}, sampled);
      all.emplace_back(sampled);
    }
    inputs = all;
  }
  const bool world = frame_ == FormulaFrame::kWorld;
  formula_.evaluate(world ? row.world_first : row.mesh_first, world ? row.world_step : row.mesh_step, row.begin, inputs,
                    values);
  const auto least = static_cast<float>(range_.min), most = static_cast<float>(range_.max);
  for (float& value : values) value = std::min(std::max(value, least), most);
}

double FormulaSource::memory_bytes(const CancellationToken& cancel) const {
  double bytes = 0;
  for (const auto& distance : distances_) bytes += distance->memory_bytes(cancel);
  return bytes;
}

}  // namespace ccslice
