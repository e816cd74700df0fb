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
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace ccslice::server {

enum class LogLevel { kDebug, kInfo, kWarning, kError };
enum class LogFormat { kText, kJson };

/// How many lines wait at most.
inline constexpr std::size_t kLogQueueLines = 8192;

/// What a line of JSON says besides its message.
struct LogField {
  const char* name;
  std::variant<std::string, double, std::uint64_t> value;
};

/// Logs a line with fields; plain lines leave them out.
void log_with_fields(LogLevel level, std::string_view message, const std::vector<LogField>& fields);

/// Who changed what, and who was refused: {"event": "audit", "action": ...}. Such lines have the level info, and are
/// written whatever the log's level is.
void log_audit(const std::string& action, const std::string& message, std::vector<LogField> fields);

/// Lines that were lost so far.
[[nodiscard]] std::uint64_t lost_log_lines();

/// Logs to this file from now on: plain lines, or one JSON object a line {"time", "level", "message", fields}. Messages
/// are made safe (see log_text.h), as they may hold what clients sent. REQUIRES: SIGPIPE is ignored, for the reader of
/// a pipe may go. `audits`: whether lines of log_audit() are written.
void set_up_logging(LogLevel level, LogFormat format, int descriptor = STDERR_FILENO, bool audits = true);

/// Waits until the lines so far are written, for so long at most; whether they are. REQUIRES: set_up_logging().
bool flush_log(std::chrono::milliseconds limit);

}  // namespace ccslice::server
