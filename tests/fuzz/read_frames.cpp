// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the guard of a connection says of arbitrary bytes: the same, whether they come at once or one by one, and never
// that a connection may go on which was to end.

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>

#include "server/service/network/frame_guard.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using ccslice::server::FrameGuard;
  const std::span<const std::uint8_t> bytes(data, size);
  const FrameGuard::Clock::time_point now;
  FrameGuard whole(4), cut(4);
  const bool passes = whole.take(bytes, now);
  bool passes_cut = true;
  for (std::size_t i = 0; i < size; ++i) {
    const bool goes_on = cut.take(bytes.subspan(i, 1), now);
    if (goes_on && !passes_cut) throw std::logic_error("a connection that goes on after its end");
    passes_cut = goes_on;
  }
  if (passes != passes_cut || whole.fault() != cut.fault()) throw std::logic_error("it matters how bytes are cut");
  return 0;
}
