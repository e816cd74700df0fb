// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/core/output/tiny_runs.h"

#include <zstd.h>

#include <cstddef>
#include <stdexcept>
#include <string>

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

void require_runs(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(std::string("a frame of runs: ") + what);
}

Bytes expanded(std::span<const std::uint8_t> frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  require_runs(size < 1ull << 32, "no size");
  Bytes content(size);
  require_runs(ZSTD_decompress(content.data(), size, frame.data(), frame.size()) == size, "no zstd frame");
  return content;
}

int bits_of_sample(SampleType type) {
  switch (type) {
    case SampleType::kBit: return 1;
    case SampleType::kUint2: return 2;
    case SampleType::kUint4: return 4;
    case SampleType::kUint8: return 8;
    case SampleType::kUint16: return 16;
    case SampleType::kFloat32: return 32;
  }
  return 0;
}

class Reader {
 public:
  Reader(std::span<const std::uint8_t> frame, SampleType type, std::uint32_t columns, std::uint32_t rows,
         std::uint32_t channels)
      : content_(expanded(frame)),
        bits_(bits_of_sample(type)),
        bytes_(bits_ < 8 ? 1 : bits_ / 8),
        columns_(columns),
        rows_(rows),
        channels_(channels),
        inside_(std::size_t{columns} * rows),
        values_(inside_.size() * channels) {}

  TinyRuns read() {
    const int coding = byte();
    const std::uint32_t outside = sample();
    read_spans();
    if (coding == 0) read_constant();
    if (coding == 1) read_packed();
    if (coding == 2) read_differences();
    if (coding == 3) read_byte_planes();
    require_runs(coding <= 3, "no such coding");
    require_runs(at_ == content_.size(), "more than it should have");
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (!inside_[i / channels_]) values_[i] = outside;
    }
    return {coding, inside_, packed()};
  }

 private:
  std::uint8_t byte() {
    require_runs(at_ < content_.size(), "less than it should have");
    return content_[at_++];
  }
  std::uint32_t sample() {
    std::uint32_t value = 0;
    for (int i = 0; i < bytes_; ++i) value |= std::uint32_t{byte()} << 8 * i;
    return value;
  }
  std::uint32_t number() {
    std::uint32_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint32_t next = byte();
      value |= (next % 128) << shift;
      if (next < 128) return value;
    }
  }
  /// Of `bits`, the `index`th after the byte at `begin`.
  std::uint32_t bits_at(std::size_t begin, std::size_t index, int bits) const {
    std::uint32_t value = 0;
    for (int i = 0; i < bits; ++i) {
      const std::size_t bit = index * static_cast<std::size_t>(bits) + static_cast<std::size_t>(i);
      value = value * 2 + (content_.at(begin + bit / 8) >> (7 - bit % 8)) % 2;
    }
    return value;
  }

  void read_spans() {
    std::vector<std::int64_t> above;
    for (std::uint32_t row = 0; row < rows_; ++row) {
      std::vector<std::int64_t> edges;
      for (std::size_t left = 2 * number(); left > 0; --left) {
        const std::int64_t z = number(), left_edge = edges.empty() ? 0 : edges.back();
        const std::int64_t before = edges.size() < above.size() ? above[edges.size()] : left_edge;
        edges.push_back(before + (z % 2 == 0 ? z / 2 : -(z + 1) / 2));
        require_runs(edges.back() >= 0 && edges.back() <= static_cast<std::int64_t>(columns_), "beyond its row");
        require_runs(edges.size() < 2 || edges.back() > edges[edges.size() - 2], "spans that touch");
      }
      for (std::size_t i = 0; i < edges.size(); i += 2) {
        for (std::size_t x = static_cast<std::size_t>(edges[i]); x < static_cast<std::size_t>(edges[i + 1]); ++x) {
          inside_[columns_ * row + x] = 1;
          voxels_.push_back(columns_ * row + x);
        }
      }
      above = edges;
    }
  }

  void read_constant() {
    const std::uint32_t value = sample();
    for (const std::size_t voxel : voxels_) {
      for (std::size_t c = 0; c < channels_; ++c) values_[voxel * channels_ + c] = value;
    }
  }
  void read_packed() {
    for (std::size_t i = 0; i < voxels_.size(); ++i) values_[voxels_[i]] = bits_at(at_, i, bits_);
    at_ += (voxels_.size() * static_cast<std::size_t>(bits_) + 7) / 8;
  }

  std::uint32_t prediction(std::size_t voxel, std::size_t channel) const {
    const std::size_t x = voxel % columns_, row = voxel / columns_;
    const auto value = [&](std::size_t of) { return values_[of * channels_ + channel]; };
    if (row > 0 && inside_[voxel - columns_]) return value(voxel - columns_);
    if (x > 0 && inside_[voxel - 1]) return value(voxel - 1);
    if (row == 0) return 0;
    const std::size_t above = voxel - columns_ - x;
    for (std::size_t right = x; right < columns_; ++right) {
      if (inside_[above + right]) return value(above + right);
    }
    for (std::size_t left = columns_; left-- > 0;) {
      if (inside_[above + left]) return value(above + left);
    }
    return 0;
  }

  void read_differences() {
    for (std::size_t begin = 0; begin < voxels_.size(); begin += 1024) {
      const std::size_t count = voxels_.size() - begin < 1024 ? voxels_.size() - begin : 1024;
      const int width = byte();
      for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t z = width == 0 ? 0 : bits_at(at_, i, width);
        if (width == 16) z = z % 256 * 256 + z / 256;
        const std::uint32_t difference = z % 2 == 0 ? z / 2 : ~(z / 2);
        const std::size_t voxel = voxels_[begin + i];
        values_[voxel] = (prediction(voxel, 0) + difference) % (1u << bits_);
      }
      at_ += (count * static_cast<std::size_t>(width) + 7) / 8;
    }
  }
  void read_byte_planes() {
    for (std::size_t c = 0; c < channels_; ++c) {
      for (std::size_t i = 0; i < voxels_.size(); ++i) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 4; ++k) bits |= std::uint32_t{content_.at(at_ + k * voxels_.size() + i)} << 8 * k;
        values_[voxels_[i] * channels_ + c] = bits ^ prediction(voxels_[i], c);
      }
      at_ += 4 * voxels_.size();
    }
  }

  Bytes packed() const {
    Bytes out;
    for (std::size_t row = 0; row < rows_; ++row) {
      std::uint32_t held = 0;
      int used = 0;
      for (std::size_t i = 0; i < columns_ * channels_; ++i) {
        const std::uint32_t value = values_[row * columns_ * channels_ + i];
        for (int k = 0; bits_ >= 8 && k < bytes_; ++k) out.push_back(static_cast<std::uint8_t>(value >> 8 * k));
        if (bits_ >= 8) continue;
        held = held << bits_ | value;
        used += bits_;
        if (used < 8) continue;
        out.push_back(static_cast<std::uint8_t>(held));
        held = 0;
        used = 0;
      }
      if (used > 0) out.push_back(static_cast<std::uint8_t>(held << (8 - used)));
    }
    return out;
  }

  const Bytes content_;
  std::size_t at_ = 0;
  const int bits_, bytes_;
  const std::size_t columns_, rows_, channels_;
  Bytes inside_;
  std::vector<std::uint32_t> values_;
  std::vector<std::size_t> voxels_;
};

}  // namespace

TinyRuns read_tiny_runs(std::span<const std::uint8_t> frame, SampleType type, std::uint32_t columns, std::uint32_t rows,
                        std::uint32_t channels) {
  return Reader(frame, type, columns, rows, channels).read();
}

}  // namespace ccslice
