// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/interrupt.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include "client/cli/exit_codes.h"

namespace ccslice::cli {
namespace {

/// Tells the waiting thread to end.
constexpr int kLeave = SIGUSR1;

sigset_t waited_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, kLeave}) sigaddset(&signals, signal);
  return signals;
}

void wait_for_signals(client::Cancellation& cancellation) {
  const sigset_t signals = waited_signals();
  for (int signal = 0; sigwait(&signals, &signal) == 0 && signal != kLeave;) {
    if (cancellation.cancelled()) _exit(kExitInterrupted);
    cancellation.cancel();
  }
}

}  // namespace

InterruptGuard::InterruptGuard(client::Cancellation& cancellation) {
  const sigset_t signals = waited_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::thread([&cancellation] { wait_for_signals(cancellation); });
}

InterruptGuard::~InterruptGuard() {
  pthread_kill(waiter_.native_handle(), kLeave);
  waiter_.join();
}

}  // namespace ccslice::cli
