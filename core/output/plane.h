// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A PLANE is one picture of a layer: the occupancy, one or several material channels, or printable materials. Its
// samples are what the checksum covers and what a client gets after decoding, whatever the encoding.
//
// A HALFTONED layer (IndexImage) has a byte a voxel: 0 is the background, i in 1..n the i-th of the job's materials.
// Planes are made of it: its numbers packed into 1, 2, 4 or 8 bits, or one bit for one of the materials. Cell regions
// are shown in the same way.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/raster/layer_window.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

enum class PlaneContent : std::uint8_t {
  kOccupancy,     // 1 bit a voxel.
  kChannel,       // One material channel, contone.
  kChannels,      // Several, kFloat32: the values of a voxel follow each other.
  kMaterials,     // The material's number, 0 outside: kBit, kUint2, kUint4, kUint8.
  kMaterialMask,  // kBit: which voxels are of one material.
  kCellRegions,   // 1 + the index of the voxel's cell region, 0 outside; sample types as kMaterials.
};

enum class SampleType : std::uint8_t {
  kBit,      // Packed rows, most significant bit first, rows padded to whole bytes.
  kUint8,    // round((value - min) / (max - min) * 255), clamped; a material's number as it is.
  kUint16,   // As kUint8 with 65535 for 255; little-endian in raw data.
  kFloat32,  // The value itself, little-endian IEEE 754.
  kUint2,    // Materials' numbers in 2 bits, packed like kBit.
  kUint4,    // Materials' numbers in 4 bits, packed like kBit.
};

enum class Encoding : std::uint8_t {
  kRaw,        // Rows of samples, row 0 first, no padding but that of kBit.
  kRawZstd,    // The bytes of kRaw as one zstd frame.
  kPng,        // 8 or 16 bit grey; kBit becomes 8 bit, 0 or 255. Not for kFloat32. Materials: indexed.
  kTiff,       // 1, 8, 16 bit or float grey. Not for kChannels.
  kExr,        // OpenEXR with named channels. kFloat32 only.
  kPngRgba,    // Materials only: 4 bytes a voxel, of the materials' and the background's colours.
  kPngAlpha,   // kChannel: grey and alpha, 8 or 16 bit each; alpha is 0 outside and the largest number inside.
  kTiffAlpha,  // kChannel: grey and alpha, 8 or 16 bit each or float; alpha as in kPngAlpha, 1 inside for floats.
  kRunsZstd,   // Spans and the samples inside them, as one zstd frame (runs_frame.h).
};

struct ValueRange {
  double min = 0, max = 1;
};

struct PlaneSpec {
  PlaneContent content = PlaneContent::kOccupancy;
  std::string channel;                // kChannel: its name.
  std::vector<std::string> channels;  // kChannels: likewise, at least one, all different.
  std::uint32_t material = 0;         // kMaterialMask: 1..n.
  SampleType sample_type = SampleType::kBit;
  Encoding encoding = Encoding::kRawZstd;
  std::optional<ValueRange> range;  // kChannel as integers: what 0 and the largest integer stand for. Default: the
                                    // channel's range (a constant channel maps to 0).
  double outside_sample = 0;        // kChannel, kChannels: the sample of voxels outside, as it is stored.
};

/// The size of a pixel in mm, for files that can say it. 0: unknown.
struct PixelPitch {
  double x_mm = 0, y_mm = 0;
};

/// The samples of a plane, rows from 0 up, as SampleType lays them out. Not owned.
struct SampleImage {
  SampleType type = SampleType::kBit;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::span<const std::uint8_t> samples;            // Of all of the picture, or of its window.
  std::span<const std::string> channel_names = {};  // One a sample of a voxel; none: one sample without a name.
  PixelPitch pitch = {};
  std::span<const std::uint8_t> inside = {};  // For encodings with alpha: which voxels are, laid out as kBit.
  std::span<const VoxelRun> spans = {};       // The voxels inside, by row, then by column; none touch.
  std::array<std::uint8_t, 4> outside = {};   // The sample of all others; as many bytes as it has.
  std::optional<LayerWindow> window = {};     // For encodings that take windows: what `samples` hold, spans included.
};

/// A layer of numbers, of materials or of cell regions, rows from 0 up. Not owned.
struct IndexImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::span<const std::uint8_t> indices;   // width * height, or those of the window.
  std::span<const std::uint32_t> palette;  // 0xRRGGBBAA, sRGB: the background's colour, then one for each material.
  PixelPitch pitch = {};
  std::span<const VoxelRun> spans = {};  // The voxels inside, as above. All others are the background's.
  std::optional<LayerWindow> window = {};
};

/// What an image's samples or indices hold of it: no row, behind its last one, if that is nothing.
template <typename Image>
LayerWindow image_window(const Image& image) {
  const LayerWindow window = image.window.value_or(LayerWindow{0, 0, image.width, image.height});
  return window.columns == 0 ? LayerWindow{0, image.height, 0, 0} : window;
}

/// Samples of a voxel.
inline std::uint32_t channel_count(const SampleImage& image) {
  return image.channel_names.empty() ? 1 : static_cast<std::uint32_t>(image.channel_names.size());
}

/// Samples of a voxel of the plane.
inline std::uint32_t channel_count(const PlaneSpec& plane) {
  return plane.content == PlaneContent::kChannels ? static_cast<std::uint32_t>(plane.channels.size()) : 1;
}

/// Size of a plane's samples.
std::uint64_t sample_bytes(SampleType type, std::uint32_t width, std::uint32_t height, std::uint32_t channels = 1);

/// The same of a window of it.
std::uint64_t sample_bytes(const PlaneSpec& plane, const LayerWindow& window);

struct EncodedPlane {
  std::vector<std::uint8_t> bytes;
  std::uint64_t raw_bytes = 0;  // Size of the samples after decoding (kBit in PNG: after packing again).
  std::uint32_t crc32 = 0;      // CRC-32 (IEEE 802.3, as in PNG and zlib) over the samples.
};

}  // namespace ccslice
