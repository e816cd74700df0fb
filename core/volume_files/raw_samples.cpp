// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/raw_samples.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/mesh_import/byte_order.h"
#include "core/mesh_import/text_scanner.h"
#include "core/volume/load_sample.h"

namespace ccslice {
namespace {

using Kind = RawFormat::Kind;

/// Samples of a file, by number.
class RawNumbers {
 public:
  RawNumbers(std::string_view bytes, RawFormat format) : bytes_(bytes), format_(format) {}

  double operator()(std::uint64_t index) const {
    const std::uint64_t bits = number_in_bytes(bytes_.substr(index * format_.bytes, format_.bytes), format_.big_endian);
    const int unused = 64 - 8 * format_.bytes;
    switch (format_.kind) {
      case Kind::kUnsigned: return static_cast<double>(bits);
      case Kind::kSigned: return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
      case Kind::kFloat: break;
    }
    if (format_.bytes == 8) return std::bit_cast<double>(bits);
    return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  }

 private:
  std::string_view bytes_;
  RawFormat format_;
};

/// The order of a volume's samples in a file.
class RawPlaces {
 public:
  RawPlaces(const VolumeShape& shape, RawOrder order) : shape_(shape) {
    const auto [ni, nj, nk] = shape.samples;
    const std::uint64_t places = std::uint64_t{ni} * nj * nk, c = order.channels_last ? 1 : shape.channels;
    channel_ = order.channels_last ? places : 1;
    strides_ = {c, c * ni, c * ni * nj};
    if (order.k_fastest) strides_ = {c * nk * nj, c * nk, c};
  }

  /// visit(index in the file), in a volume's order.
  template <typename Visit>
  void run(const Visit& visit) const {
    const auto [ni, nj, nk] = shape_.samples;
    for (std::uint64_t k = 0; k < nk; ++k) {
      for (std::uint64_t j = 0; j < nj; ++j) {
        for (std::uint64_t i = 0; i < ni; ++i) {
          const std::uint64_t place = i * strides_[0] + j * strides_[1] + k * strides_[2];
          for (std::uint64_t c = 0; c < shape_.channels; ++c) visit(place + c * channel_);
        }
      }
    }
  }

 private:
  const VolumeShape& shape_;
  std::array<std::uint64_t, 3> strides_{};
  std::uint64_t channel_ = 0;
};

template <typename NumberAt>
VolumeSampleType smallest_type(std::uint64_t count, const NumberAt& number_at, bool& rounds) {
  double least = 0, most = 0;
  bool is_whole = true, is_float = true;
  for (std::uint64_t index = 0; index < count; ++index) {
    const double number = number_at(index);
    if (std::isnan(number)) {
      is_whole = false;
      continue;
    }
    least = std::min(least, number);
    most = std::max(most, number);
    is_whole =
        is_whole && number == std::floor(number) && std::abs(number) < 1e9 && !(number == 0 && std::signbit(number));
    is_float = is_float && static_cast<double>(static_cast<float>(number)) == number;
  }
  const auto fits = [&](double low, double high) { return is_whole && least >= low && most <= high; };
  if (fits(0, 255)) return VolumeSampleType::kUint8;
  if (fits(-32768, 32767)) return VolumeSampleType::kInt16;
  if (fits(0, 65535)) return VolumeSampleType::kUint16;
  rounds = !is_float;
  return VolumeSampleType::kFloat32;
}

template <typename NumberAt>
void fill(const NumberAt& number_at, const RawPlaces& places, VolumeFile& file) {
  with_sample_type(file.shape.type, [&](auto typed) {
    using Sample = decltype(typed);
    std::byte* to = file.samples.data();
    places.run([&](std::uint64_t index) {
      const auto sample = static_cast<Sample>(number_at(index));
      std::memcpy(to, &sample, sizeof(Sample));
      to += sizeof(Sample);
    });
  });
}

template <typename NumberAt>
void take_smallest(std::uint64_t count, const NumberAt& number_at, const RawPlaces& places, VolumeFile& file) {
  bool rounds = false;
  file.shape.type = smallest_type(count, number_at, rounds);
  if (rounds) file.notes.push_back("samples are rounded to floats of 32 bits");
  file.samples.resize(file.shape.bytes());
  fill(number_at, places, file);
}

}  // namespace

std::uint64_t raw_bytes(const VolumeShape& shape, RawFormat format) {
  VolumeShape bytes = shape;
  bytes.type = VolumeSampleType::kUint8;
  const std::uint64_t samples = bytes.bytes();
  if (samples > kMostVolumeBytes / format.bytes) {
    throw Error(ErrorCode::kMeshTooLarge, std::to_string(samples) + " samples take more than the " +
                                              std::to_string(kMostVolumeBytes >> 30) +
                                              " GiB that are read; resample the volume, or crop it");
  }
  return samples * format.bytes;
}

std::string_view whole_samples(std::string_view data, std::uint64_t wanted) {
  if (data.size() >= wanted) return data.substr(0, wanted);
  throw Error(ErrorCode::kFileSyntax, std::to_string(data.size()) + " bytes of samples, and the header promises " +
                                          std::to_string(wanted) + "; the file was cut off");
}

void take_samples(std::string_view bytes, RawFormat format, RawOrder order, VolumeFile& file) {
  const RawNumbers numbers(bytes, format);
  const RawPlaces places(file.shape, order);
  if (format.bytes == 8 || (format.bytes == 4 && format.kind != Kind::kFloat)) {
    return take_smallest(bytes.size() / format.bytes, numbers, places, file);
  }
  if (format.bytes == 1) {
    file.shape.type = format.kind == Kind::kSigned ? VolumeSampleType::kInt16 : VolumeSampleType::kUint8;
  } else if (format.bytes == 2) {
    file.shape.type = format.kind == Kind::kSigned ? VolumeSampleType::kInt16 : VolumeSampleType::kUint16;
  } else {
    file.shape.type = VolumeSampleType::kFloat32;
  }
  file.samples.resize(file.shape.bytes());
  const bool is_in_order = !order.k_fastest && (!order.channels_last || file.shape.channels == 1);
  if (is_in_order && !format.big_endian && bytes_of(file.shape.type) == format.bytes) {
    std::memcpy(file.samples.data(), bytes.data(), bytes.size());
  } else {
    fill(numbers, places, file);
  }
}

void take_text(std::string_view text, RawOrder order, VolumeFile& file) {
  const std::uint64_t samples = raw_bytes(file.shape, {.bytes = sizeof(double)}) / sizeof(double);
  TextScanner scanner(text);
  std::vector<double> numbers;
  while (numbers.size() < samples) numbers.push_back(scanner.any_real("a sample"));
  take_smallest(
      numbers.size(), [&](std::uint64_t index) { return numbers[index]; }, RawPlaces(file.shape, order), file);
}

}  // namespace ccslice
