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

void fill_samples(std::span<std::uint8_t> out, std::span<const std::uint8_t> sample) {
  if (std::ranges::all_of(sample, [&](std::uint8_t byte) { return byte == sample[0]; })) {
    std::ranges::fill(out, sample[0]);
    return;
  }
  for (std::size_t i = 0; i < out.size(); i += sample.size()) std::memcpy(&out[i], sample.data(), sample.size());
}

LayerWindow held_window(const Arrangement& arrangement) {
  const LayerWindow held = common_window(arrangement.from, arrangement.to), &to = arrangement.to;
  if (held.columns == 0 || held.rows == 0) return {};  // It may be beyond the picture.
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
  const std::size_t row_bytes = bytes * to.columns, begin = bytes * there.first_column, length = bytes * held.columns;
  out.resize(row_bytes * to.rows);
  for (std::uint32_t row = 0; row < to.rows; ++row) {
    if (row % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    const std::span<std::uint8_t> row_out = std::span(out).subspan(row_bytes * row, row_bytes);
    if (length == 0 || row < there.first_row || row >= there.end_row()) {
      fill_samples(row_out, outside);
      continue;
    }
    const std::uint32_t source = arrangement.order.rows_descending ? to.end_row() - 1 - row : to.first_row + row;
    const std::uint8_t* in = samples.data() + bytes * arrangement.from.index(held.first_column, source);
    fill_samples(row_out.first(begin), outside);
    if (arrangement.order.columns_descending) {
      copy_reversed(in, held.columns, bytes, row_out.data() + begin);
    } else {
      std::memcpy(row_out.data() + begin, in, length);
    }
    fill_samples(row_out.subspan(begin + length), outside);
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
