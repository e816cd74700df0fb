// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/arrange.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/output/polling.h"

namespace ccslice {
namespace {

void copy_reversed(const std::uint8_t* in, std::size_t count, std::size_t bytes, std::uint8_t* out) {
  if (bytes == 1) {
    std::reverse_copy(in, in + count, out);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) std::memcpy(out + bytes * i, in + bytes * (count - 1 - i), bytes);
}

}  // namespace

std::span<const std::uint8_t> arrange(std::span<const std::uint8_t> samples, std::size_t bytes,
                                      const Arrangement& arrangement, std::vector<std::uint8_t>& out,
                                      const CancellationToken& cancel) {
  if (arrangement.is_identity()) return samples;
  const LayerWindow& to = arrangement.to;
  out.resize(std::size_t{to.columns} * to.rows * bytes);
  for (std::uint32_t row = 0; row < to.rows; ++row) {
    if (row % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    const std::uint32_t source = arrangement.order.rows_descending ? to.end_row() - 1 - row : to.first_row + row;
    const std::uint8_t* in = samples.data() + bytes * arrangement.from.index(to.first_column, source);
    std::uint8_t* row_out = out.data() + bytes * to.columns * row;
    if (arrangement.order.columns_descending) {
      copy_reversed(in, to.columns, bytes, row_out);
    } else {
      std::memcpy(row_out, in, bytes * to.columns);
    }
  }
  return out;
}

void arrange_spans(std::span<const VoxelRun> spans, const Arrangement& arrangement, std::vector<VoxelRun>& out) {
  const LayerWindow& to = arrangement.to;
  out.clear();
  for (const VoxelRun& span : spans) {
    const VoxelRun part = to.clipped(span);
    if (part.begin == part.end) continue;
    VoxelRun& there =
        out.emplace_back(VoxelRun{part.row - to.first_row, part.begin - to.first_column, part.end - to.first_column});
    if (arrangement.order.rows_descending) there.row = to.rows - 1 - there.row;
    if (arrangement.order.columns_descending) there = {there.row, to.columns - there.end, to.columns - there.begin};
  }
  if (arrangement.order == PictureOrder{}) return;
  std::ranges::sort(out, {}, [](const VoxelRun& span) { return std::pair(span.row, span.begin); });
}

}  // namespace ccslice
