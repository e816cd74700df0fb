// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// PLANE_ENCODING_RUNS_ZSTD: the spans of a plane and the samples inside them, nothing of what is outside, in one zstd
// frame. docs/runs.md describes it for those who write a reader.
//
// Samples that change slowly are predicted by the sample of the row above, and what is left of them takes few bits:
//
//   residual  d = (sample - prediction) mod 2^bits, as a signed number
//   zigzag    z = 2 d for d >= 0, else -2 d - 1
//
// A block of 1024 residuals takes as many bits each as its largest one needs. Halftones aren't predicted: blue noise
// has neither matches nor neighbours that tell anything, so their numbers are packed as they are, for an entropy coder.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/plane.h"
#include "core/output/zstd_frame.h"

namespace ccslice {

/// How the samples inside are written.
enum class RunsCoding : std::uint8_t {
  kConstant = 0,     // One sample stands for all.
  kPacked = 1,       // As they are.
  kDifferences = 2,  // Blocks of residuals, of kUint8 and kUint16.
  kBytePlanes = 3,   // Residuals by XOR, byte by byte, of kFloat32.
};

/// One thread's encoder: keeps scratch memory from plane to plane.
class RunsEncoder {
 public:
  /// `coding`: kPacked for numbers of materials and regions, kConstant where all samples inside are equal; else
  /// coding_of() the type. REQUIRES: image.spans are its voxels inside, in its window; all others have image.outside.
  /// Throws Error{kCancelled, kInternal}.
  [[nodiscard]] std::vector<std::uint8_t> frame(const SampleImage& image, RunsCoding coding, ZstdEncoder& zstd,
                                                const CancellationToken& cancel);

 private:
  void put_spans(const SampleImage& image);
  void put_packed(const SampleImage& image, const CancellationToken& cancel);
  template <typename Sample>
  void put_differences(const SampleImage& image, const CancellationToken& cancel);
  void put_byte_planes(const SampleImage& image, const CancellationToken& cancel);
  template <typename Sample>
  void put_blocks(std::vector<Sample>& residuals, std::size_t& count, bool last);

  std::vector<std::uint8_t> content_;
};

/// How samples of channels are written.
RunsCoding coding_of(SampleType type);

}  // namespace ccslice
