// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/frame_guard.h"

#include <algorithm>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kHeaders = 1, kSettings = 4, kContinuation = 9;
constexpr std::uint8_t kAck = 0x1, kEndHeaders = 0x4, kPadded = 0x8, kPriority = 0x20;
constexpr std::size_t kPriorityBytes = 5;
constexpr auto kUntilForgotten = 100ms;

}  // namespace

bool FrameGuard::take(std::span<const std::uint8_t> bytes, Clock::time_point now) {
  while (!bytes.empty() && fault_ == Fault::kNone) {
    std::size_t some = 0;
    if (skipped_ > 0) {
      some = std::min(skipped_, bytes.size());
      skipped_ -= some;
    } else if (header_bytes_ > 0) {
      some = std::min(header_bytes_, bytes.size());
      header_bytes_ -= some;
      if (!take_headers(bytes.first(some))) fault_ = Fault::kHeaders;
    } else {
      some = std::min(frame_.size() - frame_bytes_, bytes.size());
      std::ranges::copy(bytes.first(some), frame_.begin() + static_cast<std::ptrdiff_t>(frame_bytes_));
      frame_bytes_ += some;
      if (frame_bytes_ == frame_.size() && !begin_frame(now) && fault_ == Fault::kNone) fault_ = Fault::kHeaders;
    }
    bytes = bytes.subspan(some);
  }
  return fault_ == Fault::kNone;
}

bool FrameGuard::take_headers(std::span<const std::uint8_t> bytes) {
  return headers_.take(bytes) && (header_bytes_ > 0 || !ends_list_ || headers_.is_between_headers());
}

/// Padding isn't known to gRPC, which would take it for headers.
bool FrameGuard::begin_frame(Clock::time_point now) {
  frame_bytes_ = 0;
  const std::size_t length = std::size_t{frame_[0]} << 16 | std::size_t{frame_[1]} << 8 | frame_[2];
  const std::uint8_t kind = frame_[3], flags = frame_[4];
  if (kind != kHeaders && kind != kContinuation) {
    skipped_ = length;
    if (kind == kSettings && (flags & kAck) != 0 && !acknowledged_) {
      acknowledged_ = true;
      forgotten_at_ = now;
    }
    return true;
  }
  header_bytes_ = length;
  ends_list_ = (flags & kEndHeaders) != 0;
  if (kind == kContinuation) return header_bytes_ > 0 || take_headers({});
  headers_.begin_list();
  if ((flags & kPadded) != 0) return false;
  if ((flags & kPriority) != 0) {
    if (length < kPriorityBytes) return false;
    skipped_ = kPriorityBytes;
    header_bytes_ -= kPriorityBytes;
  }
  const std::uint32_t stream = std::uint32_t{frame_[5] & 0x7fu} << 24 | std::uint32_t{frame_[6]} << 16 |
                               std::uint32_t{frame_[7]} << 8 | frame_[8];
  return begin_call(stream, now);
}

/// Headers of a stream that isn't new are those that end a call.
bool FrameGuard::begin_call(std::uint32_t stream, Clock::time_point now) {
  if (stream <= last_stream_) return true;
  last_stream_ = stream;
  ++begun_;
  if (acknowledged_) {
    const auto some = (now - forgotten_at_) / kUntilForgotten;
    forgotten_ += some;
    forgotten_at_ += some * kUntilForgotten;
  }
  const std::int64_t ended = ended_;
  forgotten_ = std::min(forgotten_, begun_ - 1 - ended);
  if (most_calls_ == 0 || begun_ - ended - forgotten_ <= most_calls_) return true;
  fault_ = Fault::kCalls;
  return false;
}

}  // namespace ccslice::server
