// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A PLANE is one picture of a layer: the occupancy, or one material channel. Its samples are what the checksum covers
// and what a client gets after decoding, whatever the encoding.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace ccslice {

enum class PlaneContent : std::uint8_t {
  kOccupancy,  // 1 bit a voxel.
  kChannel,    // One material channel, contone; outside voxels are 0.
};

enum class SampleType : std::uint8_t {
  kBit,      // Packed rows, most significant bit first, rows padded to whole bytes. Occupancy only.
  kUint8,    // round((value - min) / (max - min) * 255), clamped.
  kUint16,   // Likewise with 65535; little-endian in raw data.
  kFloat32,  // The value itself, little-endian IEEE 754.
};

enum class Encoding : std::uint8_t {
  kRaw,      // Rows of samples, row 0 first, no padding but that of kBit.
  kRawZstd,  // The same bytes as one zstd frame.
  kPng,      // 8 or 16 bit grey; kBit becomes 8 bit, 0 or 255. Not for kFloat32.
};

struct ValueRange {
  double min = 0, max = 1;
};

struct PlaneSpec {
  PlaneContent content = PlaneContent::kOccupancy;
  std::uint32_t channel = 0;  // kChannel: index into the solid's channels.
  SampleType sample_type = SampleType::kBit;
  Encoding encoding = Encoding::kRawZstd;
  std::optional<ValueRange> range;  // kChannel as integers: what 0 and the largest integer stand for. Default: the
                                    // channel's range in the control mesh (a constant channel maps to 0).
};

struct EncodedPlane {
  std::vector<std::uint8_t> bytes;
  std::uint64_t raw_bytes = 0;  // Size of the samples after decoding (kBit in PNG: after packing again).
  std::uint32_t crc32 = 0;      // CRC-32 (IEEE 802.3, as in PNG and zlib) over the samples.
};

}  // namespace ccslice
