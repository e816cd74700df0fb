// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's log. Lines go through a bounded queue to a thread of its own, so that no call waits for whoever reads
// them. Where nobody does, the oldest lines of the queue are lost; a warning says how many as soon as somebody reads
// on.

#pragma once

#include <unistd.h>

#include <chrono>
#include <cstddef>

#include "server/service/options.h"

namespace ccslice::server {

/// How many lines wait at most.
inline constexpr std::size_t kLogQueueLines = 8192;

/// Logs to this file from now on: plain lines, or one JSON object a line {"time", "level", "message"}. Messages are
/// made safe (see log_text.h), as they may hold what clients sent. REQUIRES: SIGPIPE is ignored, for the reader of a
/// pipe may go.
void set_up_logging(LogLevel level, LogFormat format, int descriptor = STDERR_FILENO);

/// Waits until the lines so far are written, for so long at most; whether they are. REQUIRES: set_up_logging().
bool flush_log(std::chrono::milliseconds limit);

}  // namespace ccslice::server
