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

void fill(std::uint8_t* out, std::size_t count, std::span<const std::uint8_t> sample) {
  if (std::ranges::all_of(sample, [&](std::uint8_t byte) { return byte == sample[0]; })) {
    std::fill_n(out, count * sample.size(), sample[0]);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) std::ranges::copy(sample, out + sample.size() * i);
}

}  // namespace

LayerWindow held_window(const Arrangement& arrangement) {
  const LayerWindow held = common_window(arrangement.from, arrangement.to), &to = arrangement.to;
  LayerWindow there{held.first_column - to.first_column, held.first_row - to.first_row, held.columns, held.rows};
  if (arrangement.order.columns_descending) there.first_column = to.end_column() - held.end_column();
  if (arrangement.order.rows_descending) there.first_row = to.end_row() - held.end_row();
  return there;
}

std::span<const std::uint8_t> arrange(std::span<const std::uint8_t> samples, std::span<const std::uint8_t> outside,
                                      const Arrangement& arrangement, std::vector<std::uint8_t>& out,
                                      const CancellationToken& cancel) {
  if (arrangement.is_identity()) return samples;
  const std::size_t bytes = outside.size();
  const LayerWindow &to = arrangement.to, held = common_window(arrangement.from, to), there = held_window(arrangement);
  out.resize(std::size_t{to.columns} * to.rows * bytes);
  for (std::uint32_t row = 0; row < to.rows; ++row) {
    if (row % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    std::uint8_t* row_out = out.data() + bytes * to.columns * row;
    if (held.columns == 0 || row < there.first_row || row >= there.end_row()) {
      fill(row_out, to.columns, outside);
      continue;
    }
    const std::uint32_t source = arrangement.order.rows_descending ? to.end_row() - 1 - row : to.first_row + row;
    const std::uint8_t* in = samples.data() + bytes * arrangement.from.index(held.first_column, source);
    fill(row_out, there.first_column, outside);
    if (arrangement.order.columns_descending) {
      copy_reversed(in, held.columns, bytes, row_out + bytes * there.first_column);
    } else {
      std::memcpy(row_out + bytes * there.first_column, in, bytes * held.columns);
    }
    fill(row_out + bytes * there.end_column(), to.columns - there.end_column(), outside);
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
