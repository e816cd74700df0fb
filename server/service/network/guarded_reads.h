// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Shows guards what gRPC reads, before gRPC sees it, and without a copy: this program has a recvmsg() and an SSL_read()
// of its own, which the linker prefers to those of the libraries. Whatever isn't guarded they leave alone.
//
//     plain:  recvmsg() -> guard -> gRPC
//     TLS:    recvmsg() -> OpenSSL -> SSL_read() -> guard -> gRPC
//
// Where a guard says that the connection is to end, gRPC reads an error and closes it.

#pragma once

#include <memory>

#include "server/service/network/frame_guard.h"

namespace ccslice::server {

/// As long as it lives, what recvmsg() reads from this socket goes through the guard, if there is one. Whatever comes
/// later for the same number takes its place.
class GuardedReads {
 public:
  GuardedReads(int descriptor, std::shared_ptr<FrameGuard> guard);
  ~GuardedReads();
  GuardedReads(const GuardedReads&) = delete;
  GuardedReads& operator=(const GuardedReads&) = delete;

 private:
  const int descriptor_;
  const std::shared_ptr<FrameGuard> guard_;
};

/// What sessions of TLS read goes through the guard, if this thread makes them while it lives.
class GuardedSessions {
 public:
  explicit GuardedSessions(std::shared_ptr<FrameGuard> guard);
  ~GuardedSessions();
  GuardedSessions(const GuardedSessions&) = delete;
  GuardedSessions& operator=(const GuardedSessions&) = delete;
};

}  // namespace ccslice::server
