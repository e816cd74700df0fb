// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From what was computed of a layer to the picture that is asked for: a part of it, in the order of columns and rows
// that a program or machine wants. The samples themselves stay as they are.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/raster/layer_window.h"

namespace ccslice {

/// DEFAULT: the lowest row (y) and the lowest column (x) first.
struct PictureOrder {
  bool columns_descending = false;
  bool rows_descending = false;

  bool operator==(const PictureOrder&) const = default;
};

struct Arrangement {
  LayerWindow from;  // What samples there are of: all others are as outside.
  LayerWindow to;    // What the picture shows.
  PictureOrder order;

  bool is_identity() const { return from == to && order == PictureOrder{}; }
};

/// Repeats a sample. REQUIRES: `out` has room for whole ones.
void fill_samples(std::span<std::uint8_t> out, std::span<const std::uint8_t> sample);

/// The same of no more than there are samples of.
inline Arrangement held_arrangement(const Arrangement& arrangement) {
  return {arrangement.from, common_window(arrangement.from, arrangement.to), arrangement.order};
}

/// Where the picture of arrangement.to shows samples of arrangement.from, in its own columns and rows.
LayerWindow held_window(const Arrangement& arrangement);

/// `samples`: of outside.size() bytes each, of arrangement.from. Returns those of arrangement.to in its order:
/// `samples` themselves or `out`. REQUIRES: out isn't where the samples are. Throws Error{kCancelled}.
std::span<const std::uint8_t> arrange(std::span<const std::uint8_t> samples, std::span<const std::uint8_t> outside,
                                      const Arrangement& arrangement, std::vector<std::uint8_t>& out,
                                      const CancellationToken& cancel);

/// The voxels of spans in the picture of arrangement.to, by row, then by column; arrangement.from doesn't matter.
/// `spans`: by row, then by column.
void arrange_spans(std::span<const VoxelRun> spans, const Arrangement& arrangement, std::vector<VoxelRun>& out);

}  // namespace ccslice
