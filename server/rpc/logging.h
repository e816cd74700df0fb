// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's log.

#pragma once

#include "server/service/options.h"

namespace ccslice::server {

/// Logs to standard error from now on: plain lines, or one JSON object a line {"time", "level", "message"}.
/// Messages are made safe (see log_text.h): they may hold what clients sent.
void set_up_logging(LogLevel level, LogFormat format);

}  // namespace ccslice::server
