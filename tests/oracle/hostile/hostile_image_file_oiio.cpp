// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/oracle/hostile/hostile_image_file.h"
#include "tests/oracle/hostile/hostile_numbers.h"

namespace ccslice::oracle {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Decoded {
  OIIO::ImageSpec spec;
  Bytes samples;  // Of spec's format and channels.
};

Decoded decode(std::span<const std::uint8_t> file, const char* name) {
  OIIO::Filesystem::IOMemReader source(file.data(), file.size());
  OIIO::ImageSpec as_written;
  as_written.attribute("oiio:UnassociatedAlpha", 1);  // Nothing is multiplied by alpha.
  OIIO::Filesystem::IOProxy* proxy = &source;
  as_written.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const auto input = OIIO::ImageInput::open(name, &as_written);
  if (!input) throw std::runtime_error("an image file that can't be opened: " + OIIO::geterror());
  Decoded decoded{input->spec(), {}};
  decoded.samples.resize(decoded.spec.image_bytes());
  if (!input->read_image(0, 0, 0, decoded.spec.nchannels, decoded.spec.format, decoded.samples.data())) {
    throw std::runtime_error("an image file that can't be read: " + input->geterror());
  }
  return decoded;
}

OIIO::TypeDesc type_of(SampleType type) {
  if (type == SampleType::kFloat32) return OIIO::TypeDesc::FLOAT;
  return type == SampleType::kUint16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
}

/// Alpha is 0 outside, and inside 1 or the largest number.
std::uint8_t inside_of(SampleType type, std::span<const std::uint8_t> alpha) {
  const float one = 1;
  Bytes opaque(alpha.size(), 0xff);
  if (type == SampleType::kFloat32) std::copy_n(reinterpret_cast<const std::uint8_t*>(&one), sizeof one, &opaque[0]);
  if (std::ranges::equal(alpha, opaque)) return 1;
  if (std::ranges::any_of(alpha, [](std::uint8_t byte) { return byte != 0; })) {
    throw std::runtime_error("alpha that is neither all nor nothing");
  }
  return 0;
}

/// Samples of `size` bytes, their channels in the order of these names.
Bytes in_order_of(std::span<const std::string> names, const Decoded& decoded, std::size_t size) {
  Bytes samples(decoded.samples.size());
  const std::vector<std::string>& there = decoded.spec.channelnames;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const auto from = static_cast<std::size_t>(std::ranges::find(there, names[c]) - there.begin());
    if (from == there.size()) throw std::runtime_error("an image file without a channel " + names[c]);
    for (std::size_t i = 0; i < samples.size(); i += names.size() * size) {
      std::copy_n(&decoded.samples[i + from * size], size, &samples[i + c * size]);
    }
  }
  return samples;
}

}  // namespace

ImageFile read_image_file(std::span<const std::uint8_t> file, const PlaneSpec& plane,
                          std::span<const std::string> names, const GridExtent& extent) {
  const Decoded decoded = decode(file, plane.encoding == Encoding::kExr ? "a.exr" : "a.tif");
  const bool has_alpha = plane.encoding == Encoding::kTiffAlpha;
  const std::size_t channels = channel_count(plane) + (has_alpha ? 1 : 0), size = type_of(plane.sample_type).size();
  if (decoded.spec.width != static_cast<int>(extent.columns) || decoded.spec.height != static_cast<int>(extent.rows) ||
      decoded.spec.nchannels != static_cast<int>(channels) || decoded.spec.format != type_of(plane.sample_type)) {
    throw std::runtime_error("an image file of another size or type");
  }
  ImageFile result;
  if (plane.sample_type == SampleType::kBit) {
    Bytes numbers = decoded.samples;
    for (std::uint8_t& number : numbers) number = number > 0 ? 1 : 0;
    result.samples = packed_numbers(numbers, SampleType::kBit, extent);
    return result;
  }
  if (!has_alpha && channels > 1) return {in_order_of(names, decoded, size), {}};
  if (!has_alpha) return {decoded.samples, {}};
  for (std::size_t i = 0; i < decoded.samples.size(); i += 2 * size) {
    result.samples.insert(result.samples.end(), &decoded.samples[i], &decoded.samples[i] + size);
    result.alpha.push_back(inside_of(plane.sample_type, std::span(decoded.samples).subspan(i + size, size)));
  }
  return result;
}

}  // namespace ccslice::oracle
