// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Answers of TessellateBoundary from arbitrary bytes: a surface whose triangles have all their points, or a
// ClientError, nothing else.

#include <cstdint>
#include <cstdlib>
#include <utility>

#include "client/client_error.h"
#include "client/surface_assembler.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/quiet_protobuf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ccslice::fuzz::ByteReader bytes(data, size);
  ccslice::client::SurfaceAssembler assembler;
  ccslice::v1::TessellateBoundaryResponse message;
  try {
    while (!bytes.at_end() && message.ParseFromString(bytes.message())) assembler.add(message);
    const ccslice::client::Surface surface = std::move(assembler).finish();
    const std::size_t channels = static_cast<std::size_t>(surface.header.channels_size());
    if (surface.channel_values.size() != channels * surface.points_mm.size()) std::abort();
    for (const auto& triangle : surface.triangles) {
      for (const std::uint32_t vertex : triangle) {
        if (vertex >= surface.points_mm.size()) std::abort();
      }
    }
  } catch (const ccslice::client::ClientError&) {
  }
  return 0;
}
