// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_source.h"

#include <algorithm>
#include <utility>

namespace ccslice {

FormulaSource::FormulaSource(ChannelRange range, Formula formula, FormulaFrame frame)
    : range_(std::move(range)), formula_(std::move(formula)), frame_(frame) {}

void FormulaSource::sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                               std::span<float> values) const noexcept {
  const bool world = frame_ == FormulaFrame::kWorld;
  formula_.evaluate(world ? row.world_first : row.mesh_first, world ? row.world_step : row.mesh_step, row.begin, inputs,
                    values);
  const auto least = static_cast<float>(range_.min), most = static_cast<float>(range_.max);
  for (float& value : values) value = std::min(std::max(value, least), most);
}

}  // namespace ccslice
