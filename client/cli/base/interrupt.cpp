// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/interrupt.h"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include "client/cli/base/exit_codes.h"
#include "client/cli/base/output_file.h"

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

/// What a command has for ending by itself. Where it can't, as while it opens a FIFO that nobody writes to, nothing is
/// lost if it ends right there: files appear whole or not at all.
constexpr timespec kLastWords{.tv_sec = 2, .tv_nsec = 0};

void wait_for_signals(client::Cancellation& cancellation) {
  const sigset_t signals = waited_signals();
  int signal = 0;
  if (sigwait(&signals, &signal) != 0 || signal == kLeave) return;
  cancellation.cancel();
  if (sigtimedwait(&signals, nullptr, &kLastWords) == kLeave) return;
  remove_unfinished_files();
  _exit(kExitInterrupted);
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
