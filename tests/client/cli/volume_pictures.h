// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of grey numbers as files.

#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "core/output/png.h"

namespace ccslice {

/// A grey PNG of so many columns: 8 bits a sample, or 16.
inline void write_picture(const std::filesystem::path& path, std::uint32_t columns,
                          const std::vector<std::uint8_t>& samples, SampleType type = SampleType::kUint8) {
  SampleImage image;
  image.type = type;
  image.width = columns;
  image.height = static_cast<std::uint32_t>(samples.size()) / columns / (type == SampleType::kUint8 ? 1 : 2);
  image.samples = samples;
  const std::vector<std::uint8_t> file = PngEncoder().grey(image, {});
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
}

}  // namespace ccslice
