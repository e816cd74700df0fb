// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Volumes as clients send them.

#pragma once

#include <zstd.h>

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "ccslice/v1/volume.pb.h"

namespace ccslice::server {

inline std::string zstd_frame(const std::string& bytes, int level = 1) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) throw std::runtime_error("zstd");
  packed.resize(size);
  return packed;
}

template <typename Sample>
v1::Volume volume_message(std::array<std::uint32_t, 3> counts, v1::VolumeSampleType type,
                          const std::vector<Sample>& samples) {
  v1::Volume volume;
  volume.set_samples_i(counts[0]);
  volume.set_samples_j(counts[1]);
  volume.set_samples_k(counts[2]);
  volume.set_sample_type(type);
  volume.set_samples_zstd(zstd_frame({reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(Sample)}));
  return volume;
}

}  // namespace ccslice::server
