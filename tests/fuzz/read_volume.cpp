// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Uploaded volumes from arbitrary bytes: a volume or an Error, nothing else, and no more memory than was asked for.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "core/base/error.h"
#include "server/rpc/convert/volume_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kMost = 1 << 22;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  (void)ccslice::server::holds_volume({bytes});
  std::uint64_t reserved = 0;
  const auto reserve = [&](std::uint64_t asked) {
    if (asked > kMost) throw ccslice::Error(ccslice::ErrorCode::kMeshTooLarge, "too large for this test");
    reserved += asked;
  };
  try {
    const ccslice::Volume volume = ccslice::server::read_volume({bytes}, reserve);
    if (volume.memory_bytes() > reserved + sizeof(ccslice::Volume)) std::abort();
  } catch (const ccslice::Error&) {
  }
  return 0;
}
