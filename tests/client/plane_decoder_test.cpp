// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_decoder.h"

#include <gtest/gtest.h>
#include <libdeflate.h>
#include <zstd.h>

#include <string>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

v1::GridExtent extent_of(std::uint32_t columns, std::uint32_t rows) {
  v1::GridExtent extent;
  extent.set_columns(columns);
  extent.set_rows(rows);
  return extent;
}

Plane plane_of(v1::SampleType type, v1::PlaneEncoding encoding, const std::string& encoded, std::uint64_t raw_bytes) {
  Plane plane;
  plane.spec.mutable_occupancy();
  plane.spec.set_sample_type(type);
  plane.spec.set_encoding(encoding);
  plane.encoded = encoded;
  plane.result.set_raw_bytes(raw_bytes);
  return plane;
}

/// A frame that doesn't say how much it holds.
std::string frame_of(const std::string& samples) {
  std::string frame(ZSTD_compressBound(samples.size()), '\0');
  ZSTD_CCtx* const context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  frame.resize(ZSTD_compress2(context, frame.data(), frame.size(), samples.data(), samples.size()));
  ZSTD_freeCCtx(context);
  return frame;
}

TEST(PlaneDecoder, ReadsFramesThatHoldAsMuchAsAFrameCan) {
  const std::string samples(std::size_t{4096} * 4096, '\0');
  Plane plane = plane_of(v1::SAMPLE_TYPE_UINT8, v1::PLANE_ENCODING_RAW_ZSTD, frame_of(samples), samples.size());
  plane.result.set_crc32(libdeflate_crc32(0, samples.data(), samples.size()));
  decode_plane(extent_of(4096, 4096), plane);
  EXPECT_EQ(plane.samples, samples);
}

TEST(PlaneDecoder, TakesNoMemoryForGridsThatAFrameCannotFill) {
  const std::uint64_t bytes = std::uint64_t{0xffffffff} * 0xffffffff;
  Plane plane = plane_of(v1::SAMPLE_TYPE_UINT8, v1::PLANE_ENCODING_RAW_ZSTD, frame_of("samples"), bytes);
  EXPECT_THROW(decode_plane(extent_of(0xffffffff, 0xffffffff), plane), ClientError);
}

TEST(PlaneDecoder, RefusesGridsOfMoreSamplesThanThereCanBe) {
  const std::uint32_t half = 1u << 31;  // Squared and with four bytes each: none, in 64 bits.
  Plane plane = plane_of(v1::SAMPLE_TYPE_FLOAT32, v1::PLANE_ENCODING_RAW, "", 0);
  EXPECT_THROW(decode_plane(extent_of(half, half), plane), ClientError);
}

}  // namespace
}  // namespace ccslice::client
