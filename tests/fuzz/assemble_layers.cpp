// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Answers of SliceRange from arbitrary bytes, the header first: layers or a ClientError, nothing else, and no memory
// for what is only announced.

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "client/client_error.h"
#include "client/layer_assembler.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/quiet_protobuf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ccslice::fuzz::ByteReader bytes(data, size);
  ccslice::v1::SliceRangeResponse message;
  if (!message.ParseFromString(bytes.message())) return 0;
  const ccslice::v1::SliceHeader header = message.header();
  ccslice::client::LayerAssembler assembler(header);
  try {
    while (!bytes.at_end() && message.ParseFromString(bytes.message())) {
      const std::uint32_t next = assembler.next_layer();
      const std::optional<ccslice::client::Layer> layer = assembler.add(std::move(message));
      if (!layer) continue;
      if (layer->index != next || layer->planes.size() != static_cast<std::size_t>(header.planes_size())) std::abort();
    }
  } catch (const ccslice::client::ClientError&) {
  }
  return 0;
}
