// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Ctrl-C and SIGTERM: they cancel the running call, so that the command can tidy up and report.

#pragma once

#include <thread>

#include "client/cancellation.h"

namespace ccslice::cli {

/// While it lives, SIGINT and SIGTERM cancel what is running; a second one ends the program on the spot. Make it before
/// any other thread, so that all of them leave these signals alone.
class [[nodiscard]] InterruptGuard {
 public:
  explicit InterruptGuard(client::Cancellation& cancellation);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  std::thread waiter_;
};

}  // namespace ccslice::cli
