// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A formula as the values of a channel.

#pragma once

#include <span>
#include <string>

#include "core/channel/channel_source.h"
#include "core/formula/formula.h"

namespace ccslice {

/// What the formula's coordinates are: of the part's mesh, so that the channel moves along with the part, or of the
/// world.
enum class FormulaFrame { kMesh, kWorld };

class FormulaSource final : public ChannelSource {
 public:
  /// Values are clamped to the range. `distances`: of formula.distances(), in their order. REQUIRES: range.min <=
  /// range.max, both of which floats can hold.
  FormulaSource(ChannelRange range, Formula formula, FormulaFrame frame, ChannelSources distances = {});

  const Formula& formula() const noexcept { return formula_; }

  const ChannelRange& range() const noexcept override { return range_; }
  std::span<const std::string> inputs() const noexcept override { return formula_.inputs(); }
  void sample_row(const SourceRow& row, std::span<const std::span<const float>> inputs,
                  std::span<float> values) const override;
  bool follows_part() const noexcept override { return frame_ == FormulaFrame::kMesh || !formula_.uses_place(); }
  double memory_bytes(const CancellationToken& cancel = {}) const override;

 private:
  ChannelRange range_;
  Formula formula_;
  FormulaFrame frame_;
  ChannelSources distances_;
};

}  // namespace ccslice
