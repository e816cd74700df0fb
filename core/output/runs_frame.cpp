// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/runs_frame.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <functional>
#include <type_traits>

#include "core/output/pack_indices.h"
#include "core/output/plane.h"
#include "core/output/polling.h"

namespace ccslice {
namespace {

constexpr std::size_t kBlock = 1024;

using Spans = std::span<const VoxelRun>;

std::size_t bits_of(SampleType type) { return sample_bytes(type, 8, 1); }

void put_varint(std::uint32_t value, std::vector<std::uint8_t>& out) {
  constexpr std::uint32_t kMore = 0x80;
  for (; value >= kMore; value >>= 7) out.push_back(static_cast<std::uint8_t>(value | kMore));
  out.push_back(static_cast<std::uint8_t>(value));
}

/// Takes the spans of `row` from the front of `rest`.
Spans take_row(Spans& rest, std::uint32_t row) {
  const auto count = static_cast<std::size_t>(
      std::ranges::find_if(rest, [&](const VoxelRun& span) { return span.row != row; }) - rest.begin());
  const Spans taken = rest.first(count);
  rest = rest.subspan(count);
  return taken;
}

/// Calls on_row(row, spans, spans of the row above) for each row that has spans.
template <typename OnRow>
void each_row(const SampleImage& image, const CancellationToken& cancel, const OnRow& on_row) {
  Spans rest = image.spans, above;
  for (std::uint32_t row = 0; row < image.height; ++row) {
    if (row % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    const Spans spans = take_row(rest, row);
    if (!spans.empty()) on_row(row, spans, above);
    above = spans;
  }
}

/// A row of samples of one channel, and the row above.
template <typename Sample>
struct RowPair {
  const Sample* row;
  const Sample* above;
  std::size_t step;     // Samples of a voxel.
  std::uint32_t first;  // Column.

  Sample at(std::uint32_t x) const { return row[step * (x - first)]; }
  Sample above_at(std::uint32_t x) const { return above[step * (x - first)]; }
};

/// Calls residual(sample, prediction) for each voxel inside, in order. The prediction is the sample above where that is
/// inside, else the left one where that is. A span's first voxel takes the nearest of the row above: the next to the
/// right, else the last one, else 0.
template <typename Sample, typename Residual>
Sample* put_row(const RowPair<Sample>& rows, Spans spans, Spans above, Sample* out, const Residual& residual) {
  auto met = above.begin();
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end;) {
      while (met != above.end() && met->end <= x) ++met;
      const bool is_next = met != above.end();
      if (is_next && met->begin <= x) {
        const std::uint32_t end = std::min(met->end, span.end);
        if (rows.step == 1) {
          const Sample *here = rows.row + (x - rows.first), *over = rows.above + (x - rows.first);
          for (std::uint32_t i = 0; i < end - x; ++i) out[i] = residual(here[i], over[i]);
          out += end - x;
          x = end;
        }
        for (; x < end; ++x) *out++ = residual(rows.at(x), rows.above_at(x));
        continue;
      }
      Sample before = 0;
      if (x > span.begin) {
        before = rows.at(x - 1);
      } else if (!above.empty()) {
        before = rows.above_at(is_next ? met->begin : above.back().end - 1);
      }
      const std::uint32_t end = is_next ? std::min(met->begin, span.end) : span.end;
      for (; x < end; ++x) {
        *out++ = residual(rows.at(x), before);
        before = rows.at(x);
      }
    }
  }
  return out;
}

template <typename Sample>
Sample zigzag(Sample sample, Sample prediction) {
  using Signed = std::make_signed_t<Sample>;
  const auto difference = static_cast<Sample>(sample - prediction);
  const auto sign = static_cast<Sample>(static_cast<Signed>(difference) < 0 ? -1 : 0);
  return static_cast<Sample>(static_cast<Sample>(difference + difference) ^ sign);
}

std::size_t width_of(std::uint32_t largest) {
  const std::uint32_t bits = static_cast<std::uint32_t>(std::bit_width(largest));
  return bits == 0 ? 0 : std::bit_ceil(bits);
}

/// REQUIRES: `above`, the spans of the row above, if there are any, are in the window.
template <typename Sample>
RowPair<Sample> row_pair(const SampleImage& image, std::size_t channel, std::uint32_t row, Spans above) {
  const LayerWindow window = image_window(image);
  const std::size_t step = channel_count(image), stride = step * window.columns;
  const Sample* samples =
      reinterpret_cast<const Sample*>(image.samples.data()) + stride * (row - window.first_row) + channel;
  return {samples, above.empty() ? samples : samples - stride, step, window.first_column};
}

std::uint64_t voxels_of(Spans spans) {
  std::uint64_t voxels = 0;
  for (const VoxelRun& span : spans) voxels += span.end - span.begin;
  return voxels;
}

/// Whether neighbours repeat so often that a search for matches pays.
bool repeats(std::span<const std::uint8_t> bytes) {
  std::size_t equal = 0;
  for (std::size_t i = 1; i < bytes.size(); ++i) equal += bytes[i] == bytes[i - 1];
  return 3 * equal >= bytes.size();
}

}  // namespace

RunsCoding coding_of(SampleType type) {
  switch (type) {
    case SampleType::kUint8:
    case SampleType::kUint16: return RunsCoding::kDifferences;
    case SampleType::kFloat32: return RunsCoding::kBytePlanes;
    default: return RunsCoding::kPacked;
  }
}

std::vector<std::uint8_t> RunsEncoder::frame(const SampleImage& image, RunsCoding coding, ZstdEncoder& zstd,
                                             const CancellationToken& cancel) {
  content_.clear();
  const std::size_t bytes = std::max<std::size_t>(1, bits_of(image.type) / 8);
  content_.push_back(static_cast<std::uint8_t>(coding));
  content_.insert(content_.end(), image.outside.begin(), image.outside.begin() + static_cast<std::ptrdiff_t>(bytes));
  put_spans(image);
  const std::size_t head = content_.size();
  switch (coding) {
    case RunsCoding::kConstant: content_.push_back(1); break;
    case RunsCoding::kPacked: put_packed(image, cancel); break;
    case RunsCoding::kDifferences:
      image.type == SampleType::kUint8 ? put_differences<std::uint8_t>(image, cancel)
                                       : put_differences<std::uint16_t>(image, cancel);
      break;
    case RunsCoding::kBytePlanes: put_byte_planes(image, cancel); break;
  }
  const bool searches = coding != RunsCoding::kPacked || repeats(std::span(content_).subspan(head));
  return zstd.frame(content_, cancel, searches ? MatchSearch::kFull : MatchSearch::kNone);
}

void RunsEncoder::put_spans(const SampleImage& image) {
  Spans rest = image.spans, above;
  for (std::uint32_t row = 0; row < image.height; ++row) {
    const Spans spans = take_row(rest, row);
    put_varint(static_cast<std::uint32_t>(spans.size()), content_);
    std::uint32_t left = 0;
    for (std::size_t i = 0; i < spans.size(); ++i) {
      const bool is_above = i < above.size();
      put_varint(zigzag(spans[i].begin, is_above ? above[i].begin : left), content_);
      put_varint(zigzag(spans[i].end, is_above ? above[i].end : spans[i].begin), content_);
      left = spans[i].end;
    }
    above = spans;
  }
}

void RunsEncoder::put_packed(const SampleImage& image, const CancellationToken& cancel) {
  const LayerWindow window = image_window(image);
  const std::size_t bits = bits_of(image.type), row_bytes = sample_bytes(image.type, window.columns, 1);
  const std::size_t begin = content_.size();
  content_.resize(begin + (voxels_of(image.spans) * bits + 7) / 8);
  std::uint8_t* const out = content_.data() + begin;
  std::size_t at = 0;
  each_row(image, cancel, [&](std::uint32_t row, Spans spans, Spans) {
    const std::uint8_t* samples = &image.samples[row_bytes * (row - window.first_row)];
    for (const VoxelRun& span : spans) {
      const std::size_t count = bits * (span.end - span.begin);
      copy_bits(samples, bits * (span.begin - window.first_column), count, out, at);
      at += count;
    }
  });
}

template <typename Sample>
void RunsEncoder::put_differences(const SampleImage& image, const CancellationToken& cancel) {
  std::vector<Sample> residuals(image.width + kBlock);
  std::size_t count = 0;
  each_row(image, cancel, [&](std::uint32_t row, Spans spans, Spans above) {
    const RowPair<Sample> rows = row_pair<Sample>(image, 0, row, above);
    const Sample* end = put_row(rows, spans, above, residuals.data() + count, zigzag<Sample>);
    count = static_cast<std::size_t>(end - residuals.data());
    put_blocks(residuals, count, false);
  });
  put_blocks(residuals, count, true);
}

/// Writes the whole blocks, and the rest too if it is the `last`; moves what is left to the front.
template <typename Sample>
void RunsEncoder::put_blocks(std::vector<Sample>& residuals, std::size_t& count, bool last) {
  constexpr std::size_t kByte = 8;
  std::size_t done = 0;
  while (count - done >= kBlock || (last && done < count)) {
    const std::size_t length = std::min(kBlock, count - done);
    const Sample* block = residuals.data() + done;
    Sample all = 0;
    for (std::size_t i = 0; i < length; ++i) all = static_cast<Sample>(all | block[i]);
    const std::size_t width = width_of(all), begin = content_.size() + 1;
    content_.push_back(static_cast<std::uint8_t>(width));
    content_.resize(begin + (length * width + kByte - 1) / kByte);
    done += length;
    if (width == 0) continue;
    if (width > kByte) {
      std::memcpy(&content_[begin], block, sizeof(Sample) * length);
      continue;
    }
    std::array<std::uint8_t, kBlock> numbers;
    for (std::size_t i = 0; i < length; ++i) numbers[i] = static_cast<std::uint8_t>(block[i]);
    pack_numbers(numbers.data(), length, static_cast<std::uint32_t>(width), &content_[begin]);
  }
  std::copy(residuals.begin() + static_cast<std::ptrdiff_t>(done),
            residuals.begin() + static_cast<std::ptrdiff_t>(count), residuals.begin());
  count -= done;
}

void RunsEncoder::put_byte_planes(const SampleImage& image, const CancellationToken& cancel) {
  constexpr std::size_t kBytes = sizeof(std::uint32_t);
  const std::size_t channels = channel_count(image), voxels = voxels_of(image.spans);
  std::vector<std::uint32_t> residuals(image.width);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    std::size_t at = content_.size();
    content_.resize(at + kBytes * voxels);
    each_row(image, cancel, [&](std::uint32_t row, Spans spans, Spans above) {
      const RowPair<std::uint32_t> rows = row_pair<std::uint32_t>(image, channel, row, above);
      const std::uint32_t* end = put_row(rows, spans, above, residuals.data(), std::bit_xor<std::uint32_t>());
      const auto count = static_cast<std::size_t>(end - residuals.data());
      for (std::size_t byte = 0; byte < kBytes; ++byte) {
        std::uint8_t* plane = &content_[at + byte * voxels];
        for (std::size_t i = 0; i < count; ++i) plane[i] = static_cast<std::uint8_t>(residuals[i] >> 8 * byte);
      }
      at += count;
    });
  }
}

}  // namespace ccslice
