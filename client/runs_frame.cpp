// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/runs_frame.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

using Byte = unsigned char;

constexpr unsigned kConstant = 0, kPacked = 1, kDifferences = 2, kBytePlanes = 3;
constexpr std::size_t kBlock = 1024;
constexpr std::size_t kByteBits = 8;

[[noreturn]] void wrong(const std::string& what) { answer_corrupt("a plane of runs can't be decoded: " + what); }

/// Inside voxels [begin, end) of a row.
struct Span {
  std::uint32_t begin, end;
};

/// Reads a frame's content from front to back.
class Cursor {
 public:
  explicit Cursor(std::string_view content) : rest_(content) {}

  std::string_view take(std::uint64_t bytes) {
    if (bytes > rest_.size()) wrong("it ends early");
    const std::string_view taken = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return taken;
  }
  unsigned byte() { return static_cast<Byte>(take(1).front()); }
  /// Seven bits a byte, the lowest first; all bytes but the last have bit 7.
  std::uint32_t number() {
    constexpr unsigned kBits = 7, kMost = 32;
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < kMost; shift += kBits) {
      const unsigned next = byte();
      value |= std::uint64_t{next & 0x7fu} << shift;
      if (next < 0x80) {
        if (value > std::numeric_limits<std::uint32_t>::max()) break;
        return static_cast<std::uint32_t>(value);
      }
    }
    wrong("a number of more than 32 bits");
  }
  bool at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

/// The number that differs so from `before`.
std::uint32_t moved(std::uint32_t before, std::uint32_t zigzag) {
  return before + ((zigzag >> 1) ^ (0u - (zigzag & 1)));
}

/// `above`: the spans of the row above.
void read_spans(Cursor& cursor, std::uint32_t columns, const std::vector<Span>& above, std::vector<Span>& spans) {
  spans.clear();
  for (std::uint32_t left = cursor.number(); left > 0; --left) {
    const bool is_above = spans.size() < above.size();
    const std::uint32_t end_before = spans.empty() ? 0 : spans.back().end;
    Span span{};
    span.begin = moved(is_above ? above[spans.size()].begin : end_before, cursor.number());
    span.end = moved(is_above ? above[spans.size()].end : span.begin, cursor.number());
    if (span.end <= span.begin || (!spans.empty() && span.begin <= spans.back().end)) {
      wrong("a span that is empty or not to the right of the one before");
    }
    if (span.end > columns) wrong("a span beyond its row");
    spans.push_back(span);
  }
}

/// Goes through the spans and counts the voxels in them.
std::uint64_t skip_spans(Cursor& cursor, const v1::GridExtent& extent) {
  std::vector<Span> spans, above;
  std::uint64_t voxels = 0;
  for (std::uint32_t row = 0; row < extent.rows(); ++row) {
    read_spans(cursor, extent.columns(), above, spans);
    for (const Span& span : spans) voxels += span.end - span.begin;
    spans.swap(above);
  }
  return voxels;
}

/// Copies bits [from, from + count) of `in` to bits from `to` on of `out`, which are 0. The first bit of a byte is its
/// most significant one.
void copy_bits(const Byte* in, std::uint64_t from, std::uint64_t count, Byte* out, std::uint64_t to) {
  while (count > 0) {
    const unsigned offset = to % kByteBits, bits = static_cast<unsigned>(std::min<std::uint64_t>(8 - offset, count));
    const Byte* at = in + from / kByteBits;
    const unsigned skipped = from % kByteBits, low = skipped + bits > kByteBits ? at[1] : 0u;
    const unsigned window = ((unsigned{at[0]} << kByteBits | low) << skipped & 0xffff) >> kByteBits;  // From `from` on.
    const unsigned taken = window & (0xff00u >> bits) & 0xff;
    out[to / kByteBits] = static_cast<Byte>(out[to / kByteBits] | taken >> offset);
    from += bits;
    to += bits;
    count -= bits;
  }
}

/// By width and byte: the numbers that are packed in it.
template <unsigned kBits>
constexpr auto unpacked_table() {
  constexpr unsigned kNumbers = 8 / kBits;
  std::array<std::array<Byte, kNumbers>, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    for (unsigned i = 0; i < kNumbers; ++i)
      table[byte][i] = static_cast<Byte>(byte >> (8 - kBits * (i + 1)) & ((1 << kBits) - 1));
  }
  return table;
}

/// `out` has room for whole bytes of them.
template <unsigned kBits, typename Sample>
void unpack(std::string_view packed, Sample* out) {
  static constexpr auto kTable = unpacked_table<kBits>();
  for (const char byte : packed) {
    for (const Byte number : kTable[static_cast<Byte>(byte)]) *out++ = number;
  }
}

/// The residuals of a plane of `Sample`, block by block.
template <typename Sample>
class ResidualReader {
 public:
  ResidualReader(Cursor& cursor, std::uint64_t count) : cursor_(cursor), left_(count) {}

  /// The next `count` residuals. Valid until the next call. REQUIRES: there are so many.
  const Sample* take(std::size_t count) {
    if (end_ - begin_ < count) fill(count);
    const Sample* taken = ready_.data() + begin_;
    begin_ += count;
    return taken;
  }

 private:
  void fill(std::size_t count) {
    std::copy(ready_.begin() + static_cast<std::ptrdiff_t>(begin_), ready_.begin() + static_cast<std::ptrdiff_t>(end_),
              ready_.begin());
    end_ -= begin_;
    begin_ = 0;
    ready_.resize(std::max(ready_.size(), count + 2 * kBlock));
    while (end_ < count) {
      const auto length = static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, left_));
      read_block(length, ready_.data() + end_);
      end_ += length;
      left_ -= length;
    }
  }
  void read_block(std::size_t length, Sample* out) {
    const unsigned width = cursor_.byte();
    const std::string_view packed = cursor_.take((width * length + kByteBits - 1) / kByteBits);
    switch (width) {
      case 0: std::fill_n(out, length, Sample{0}); return;
      case 1: unpack<1>(packed, out); return;
      case 2: unpack<2>(packed, out); return;
      case 4: unpack<4>(packed, out); return;
      case 8: unpack<8>(packed, out); return;
      default: break;
    }
    if (width != kByteBits * sizeof(Sample)) wrong("a block of " + std::to_string(width) + " bits a sample");
    std::memcpy(out, packed.data(), packed.size());
  }

  Cursor& cursor_;
  std::uint64_t left_;
  std::vector<Sample> ready_;
  std::size_t begin_ = 0, end_ = 0;
};

/// Makes a row's samples of their predictions and residuals. `above`: the row above, whose spans are `spans_above`.
template <typename Sample, typename Restore>
void restore_row(Sample* row, const Sample* above, std::size_t step, const std::vector<Span>& spans,
                 const std::vector<Span>& spans_above, const Sample* residuals, const Restore& restore) {
  std::size_t next = 0;  // The first span above that ends to the right of the voxel.
  for (const Span& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end;) {
      while (next < spans_above.size() && spans_above[next].end <= x) ++next;
      const bool is_right = next < spans_above.size();
      std::uint32_t end = span.end;
      if (is_right && spans_above[next].begin <= x) {
        end = std::min(end, spans_above[next].end);
        if (step == 1) {
          for (; x < end; ++x) row[x] = restore(*residuals++, above[x]);
        }
        for (; x < end; ++x) row[step * x] = restore(*residuals++, above[step * x]);
        continue;
      }
      Sample prediction = 0;
      if (x > span.begin) {
        prediction = row[step * (x - 1)];
      } else if (is_right) {
        prediction = above[step * spans_above[next].begin];
      } else if (!spans_above.empty()) {
        prediction = above[step * (spans_above.back().end - 1)];
      }
      if (is_right) end = std::min(end, spans_above[next].begin);
      for (; x < end; ++x) row[step * x] = prediction = restore(*residuals++, prediction);
    }
  }
}

template <typename Sample>
Sample restore_difference(Sample zigzag, Sample prediction) {
  const auto difference = static_cast<Sample>(static_cast<Sample>(zigzag >> 1) ^ static_cast<Sample>(-(zigzag & 1)));
  return static_cast<Sample>(prediction + difference);
}

/// A plane that is being expanded.
class Expansion {
 public:
  Expansion(const v1::PlaneSpec& spec, const v1::GridExtent& extent, std::string& samples)
      : type_(spec.sample_type()),
        columns_(extent.columns()),
        rows_(extent.rows()),
        channels_(spec.has_channels() ? static_cast<std::size_t>(spec.channels().names_size()) : 1),
        samples_(samples) {}

  void run(const std::string& content, const v1::GridExtent& extent) {
    Cursor cursor(content);
    const unsigned coding = cursor.byte();
    const std::string_view outside = cursor.take(bytes_of_sample());
    spans_ = cursor;
    const std::uint64_t voxels = skip_spans(cursor, extent);
    fill(outside);
    switch (coding) {
      case kConstant: set_constant(cursor.take(bytes_of_sample())); break;
      case kPacked: set_packed(cursor.take((voxels * bits() + kByteBits - 1) / kByteBits)); break;
      case kDifferences: set_differences(cursor, voxels); break;
      case kBytePlanes: set_byte_planes(cursor, voxels); break;
      default: wrong("a coding of number " + std::to_string(coding));
    }
    if (!cursor.at_end()) wrong("it goes on after its samples");
  }

 private:
  unsigned bits() const {
    switch (type_) {
      case v1::SAMPLE_TYPE_BIT: return 1;
      case v1::SAMPLE_TYPE_UINT2: return 2;
      case v1::SAMPLE_TYPE_UINT4: return 4;
      case v1::SAMPLE_TYPE_UINT16: return 16;
      case v1::SAMPLE_TYPE_FLOAT32: return 32;
      default: return 8;
    }
  }
  std::size_t bytes_of_sample() const { return std::max<std::size_t>(1, bits() / kByteBits); }
  /// A row takes so many, with all channels.
  std::uint64_t row_bytes() const { return (columns_ * channels_ * bits() + kByteBits - 1) / kByteBits; }
  Byte* row_at(std::uint32_t row) { return reinterpret_cast<Byte*>(samples_.data()) + row_bytes() * row; }

  void fill(std::string_view outside) {
    const bool same = std::ranges::all_of(outside, [&](char byte) { return byte == outside.front(); });
    if (bits() < kByteBits && outside.front() != 0) wrong("samples of less than a byte that aren't 0 outside");
    if (same) {
      std::memset(samples_.data(), outside.front(), samples_.size());
      return;
    }
    for (std::size_t at = 0; at < samples_.size(); at += outside.size()) {
      std::memcpy(samples_.data() + at, outside.data(), outside.size());
    }
  }

  /// Calls on_row(row, spans, spans of the row above) for each row that has spans.
  template <typename OnRow>
  void each_row(const OnRow& on_row) {
    Cursor cursor = spans_;
    std::vector<Span> spans, above;
    for (std::uint32_t row = 0; row < rows_; ++row) {
      read_spans(cursor, static_cast<std::uint32_t>(columns_), above, spans);
      if (!spans.empty()) on_row(row, spans, above);
      spans.swap(above);
    }
  }

  void set_constant(std::string_view sample) {
    std::string full(row_bytes(), '\0');  // A row that is inside from end to end.
    if (bits() < kByteBits) {
      const unsigned number = static_cast<Byte>(sample.front());
      if (number >> bits() != 0) wrong("a number of more bits than its type");
      unsigned byte = 0;
      for (unsigned shift = 0; shift < kByteBits; shift += bits()) byte |= number << shift;
      full.assign(full.size(), static_cast<char>(byte));
    } else {
      for (std::size_t i = 0; i < full.size(); i += sample.size()) sample.copy(full.data() + i, sample.size());
    }
    const std::uint64_t step = std::uint64_t{bits()} * channels_;
    each_row([&](std::uint32_t row, const std::vector<Span>& spans, const auto&) {
      for (const Span& span : spans) {
        copy_inside(reinterpret_cast<const Byte*>(full.data()), step * span.begin, step * (span.end - span.begin), row,
                    step * span.begin);
      }
    });
  }

  /// Bits of `in` to bits of a row.
  void copy_inside(const Byte* in, std::uint64_t from, std::uint64_t count, std::uint32_t row, std::uint64_t to) {
    Byte* out = row_at(row);
    if ((from | count | to) % kByteBits == 0) {
      std::memcpy(out + to / kByteBits, in + from / kByteBits, count / kByteBits);
    } else {
      copy_bits(in, from, count, out, to);
    }
  }

  void set_packed(std::string_view packed) {
    if (channels_ != 1) wrong("packed samples of several channels");
    std::uint64_t from = 0;
    each_row([&](std::uint32_t row, const std::vector<Span>& spans, const auto&) {
      for (const Span& span : spans) {
        const std::uint64_t count = std::uint64_t{bits()} * (span.end - span.begin);
        copy_inside(reinterpret_cast<const Byte*>(packed.data()), from, count, row, std::uint64_t{bits()} * span.begin);
        from += count;
      }
    });
  }

  void set_differences(Cursor& cursor, std::uint64_t voxels) {
    if (type_ == v1::SAMPLE_TYPE_UINT8) return set_differences_of<std::uint8_t>(cursor, voxels);
    if (type_ == v1::SAMPLE_TYPE_UINT16) return set_differences_of<std::uint16_t>(cursor, voxels);
    wrong("differences of samples that have none");
  }

  template <typename Sample>
  void set_differences_of(Cursor& cursor, std::uint64_t voxels) {
    ResidualReader<Sample> residuals(cursor, voxels);
    each_row([&](std::uint32_t row, const std::vector<Span>& spans, const std::vector<Span>& above) {
      std::size_t count = 0;
      for (const Span& span : spans) count += span.end - span.begin;
      restore_row(samples_at<Sample>(row, 0), samples_at<Sample>(row == 0 ? 0 : row - 1, 0), 1, spans, above,
                  residuals.take(count), restore_difference<Sample>);
    });
  }

  void set_byte_planes(Cursor& cursor, std::uint64_t voxels) {
    if (type_ != v1::SAMPLE_TYPE_FLOAT32) wrong("byte planes of samples that aren't floats");
    std::vector<std::uint32_t> residuals(columns_);
    for (std::size_t channel = 0; channel < channels_; ++channel) {
      std::array<const char*, sizeof(float)> planes{};
      for (const char*& plane : planes) plane = cursor.take(voxels).data();
      each_row([&](std::uint32_t row, const std::vector<Span>& spans, const std::vector<Span>& above) {
        std::size_t count = 0;
        for (const Span& span : spans) count += span.end - span.begin;
        for (std::size_t i = 0; i < count; ++i) {
          std::uint32_t bits = 0;
          for (std::size_t byte = 0; byte < planes.size(); ++byte) {
            bits |= std::uint32_t{static_cast<Byte>(planes[byte][i])} << kByteBits * byte;
          }
          residuals[i] = bits;
        }
        for (const char*& plane : planes) plane += count;
        restore_row(samples_at<std::uint32_t>(row, channel), samples_at<std::uint32_t>(row == 0 ? 0 : row - 1, channel),
                    channels_, spans, above, residuals.data(),
                    [](std::uint32_t bits, std::uint32_t prediction) { return bits ^ prediction; });
      });
    }
  }

  template <typename Sample>
  Sample* samples_at(std::uint32_t row, std::size_t channel) {
    return reinterpret_cast<Sample*>(row_at(row)) + channel;
  }

  const v1::SampleType type_;
  const std::uint64_t columns_;
  const std::uint32_t rows_;
  const std::size_t channels_;
  std::string& samples_;
  Cursor spans_{{}};
};

}  // namespace

std::string expand_runs(const v1::PlaneSpec& spec, const v1::GridExtent& extent, const std::string& content,
                        std::uint64_t bytes) {
  std::string samples(bytes, '\0');
  Expansion(spec, extent, samples).run(content, extent);
  return samples;
}

std::uint64_t most_runs_bytes(const v1::GridExtent& extent, std::uint64_t sample_bytes) {
  // Beside its samples, a block has a byte, a row a count, and a span two numbers, which take four bytes at most in
  // rows of up to 2^27 columns; it has a voxel, and one before it.
  constexpr std::uint64_t kHead = 64, kOfARow = 16, kOfAVoxel = 4;
  return kHead + kOfARow * extent.rows() + kOfAVoxel * extent.columns() * extent.rows() + sample_bytes +
         sample_bytes / kBlock;
}

}  // namespace ccslice::client
