// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads along with what a client sends over HTTP/2 (RFC 9113), before gRPC does, and says when that is more than a
// connection may ask for. gRPC 1.51 bounds neither: its limit of headers is for a frame and holds once the client has
// agreed to it, and its limit of streams knows nothing of those that are reset (CVE-2023-44487).
//
//     headers    of a list, once they are unpacked: HeaderSizes::kMostBytes
//     calls      begun and not yet ended: twice as many as may be open, for those that are ending
//
// Some calls end before the server hears of them. So one each 100 ms is forgotten, once gRPC bounds those that are
// open.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/service/network/header_sizes.h"

namespace ccslice::server {

class FrameGuard {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Fault { kNone, kHeaders, kCalls };

  /// `calls`: so many may be open; 0: any number.
  explicit FrameGuard(std::size_t calls) : most_calls_(2 * calls) {}

  /// What came next, cut anywhere. False if the connection is to end; from then on always. One thread at a time.
  [[nodiscard]] bool take(std::span<const std::uint8_t> bytes, Clock::time_point now);
  /// A call has ended, for everybody. Any thread.
  void note_end() noexcept { ++ended_; }
  /// Why it is to end. Any thread.
  Fault fault() const noexcept { return fault_; }

 private:
  static constexpr std::size_t kPrefaceBytes = 24, kFrameHeaderBytes = 9;

  bool take_headers(std::span<const std::uint8_t> bytes);
  bool begin_frame(Clock::time_point now);
  bool begin_call(std::uint32_t stream, Clock::time_point now);

  const std::int64_t most_calls_;
  std::atomic<std::int64_t> ended_ = 0;
  std::atomic<Fault> fault_ = Fault::kNone;
  std::array<std::uint8_t, kFrameHeaderBytes> frame_{};     // The header of one that begins,
  std::size_t frame_bytes_ = 0;                             // as far as it has come.
  std::size_t skipped_ = kPrefaceBytes, header_bytes_ = 0;  // Still to come: first what doesn't matter, then these.
  bool ends_list_ = false;                                  // With them.
  HeaderSizes headers_;
  bool acknowledged_ = false;  // gRPC's settings.
  std::uint32_t last_stream_ = 0;
  std::int64_t begun_ = 0, forgotten_ = 0;
  Clock::time_point forgotten_at_;
};

}  // namespace ccslice::server
