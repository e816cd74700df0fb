// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/logging.h"

#include <poll.h>
#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "server/service/base/log_text.h"

namespace ccslice::server {
namespace {

/// A payload with fields: kFieldsMark, the message, kFieldsBegin, the fields as JSON, each with a comma in front. What
/// clients sent never begins a message, and in the fields control characters are escaped.
constexpr char kFieldsMark = '\x1e', kFieldsBegin = '\x1f';

struct Payload {
  std::string_view message, fields;
};

Payload split(std::string_view payload) {
  if (!payload.starts_with(kFieldsMark)) return {.message = payload, .fields = {}};
  const std::size_t at = std::min(payload.rfind(kFieldsBegin), payload.size() - 1);
  return {.message = payload.substr(1, at - 1), .fields = payload.substr(at + 1)};
}

std::string json_of(const std::variant<std::string, double, std::uint64_t>& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return '"' + to_log_json(*text) + '"';
  if (const auto* number = std::get_if<double>(&value)) return fmt::format("{:.3f}", *number);
  return std::to_string(std::get<std::uint64_t>(value));
}

std::string payload_of(std::string_view message, const std::vector<LogField>& fields) {
  std::string payload = kFieldsMark + std::string(message) + kFieldsBegin;
  for (const LogField& field : fields) payload += ",\"" + std::string(field.name) + "\":" + json_of(field.value);
  return payload;
}

/// %F: the fields.
class Fields final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string_view fields = split({message.payload.data(), message.payload.size()}).fields;
    out.append(fields.data(), fields.data() + fields.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<Fields>(); }
};

/// %J: the message, safe in its format.
class SafeMessage final : public spdlog::custom_flag_formatter {
 public:
  using Escape = std::string (*)(std::string_view);
  explicit SafeMessage(Escape escape) : escape_(escape) {}

  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string text = escape_(split({message.payload.data(), message.payload.size()}).message);
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<SafeMessage>(escape_); }

 private:
  Escape escape_;
};

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug: return spdlog::level::debug;
    case LogLevel::kInfo: return spdlog::level::info;
    case LogLevel::kWarning: return spdlog::level::warn;
    case LogLevel::kError: return spdlog::level::err;
  }
  return spdlog::level::info;
}

/// Waits for room where the file has none.
bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      pollfd file{descriptor, POLLOUT, 0};
      ::poll(&file, 1, -1);
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

/// Writes to a file, and says what was lost before. The pool's thread alone runs it.
class DescriptorSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  DescriptorSink(int descriptor, spdlog::details::thread_pool& queue) : descriptor_(descriptor), queue_(queue) {}

  std::uint64_t unwritten() const { return unwritten_; }
  std::uint64_t flushes() {
    const std::lock_guard lock(flushed_mutex_);
    return flushes_;
  }
  bool wait_for_flush(std::uint64_t after, std::chrono::milliseconds limit) {
    std::unique_lock lock(flushed_mutex_);
    return flushed_.wait_for(lock, limit, [&] { return flushes_ > after; });
  }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::uint64_t lost = queue_.overrun_counter() + unwritten_;
    if (lost > told_ && write_line({"ccsliced", spdlog::level::warn, lost_text(lost - told_)})) told_ = lost;
    if (!write_line(message)) ++unwritten_;
  }
  void flush_() override {
    const std::lock_guard lock(flushed_mutex_);
    ++flushes_;
    flushed_.notify_all();
  }

  static std::string lost_text(std::uint64_t lines) {
    return std::to_string(lines) + " lines of the log are lost: they weren't read, or could not be written";
  }
  bool write_line(const spdlog::details::log_msg& message) {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    return write_all(descriptor_, {line.data(), line.size()});
  }

  const int descriptor_;
  spdlog::details::thread_pool& queue_;  // Not owned: its thread may be the last to hold a sink.
  std::atomic<std::uint64_t> unwritten_{0};
  std::uint64_t told_ = 0;
  std::mutex flushed_mutex_;
  std::condition_variable flushed_;
  std::uint64_t flushes_ = 0;
};

/// What set_up_logging() made last.
struct Log {
  std::shared_ptr<DescriptorSink> sink;
  std::shared_ptr<spdlog::async_logger> logger, audit;  // The second one writes at every level.
  std::shared_ptr<spdlog::details::thread_pool> queue;  // Last, so that its thread ends before what it writes to.
};

Log& current_log() {
  static Log log;
  return log;
}

}  // namespace

void set_up_logging(LogLevel level, LogFormat format, int descriptor, bool audits) {
  Log& log = current_log();
  log.queue = std::make_shared<spdlog::details::thread_pool>(kLogQueueLines, 1);
  log.sink = std::make_shared<DescriptorSink>(descriptor, *log.queue);
  log.logger = std::make_shared<spdlog::async_logger>("ccsliced", log.sink, log.queue,
                                                      spdlog::async_overflow_policy::overrun_oldest);
  const bool json = format == LogFormat::kJson;
  auto formatter = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  formatter->add_flag<SafeMessage>('J', json ? &to_log_json : &to_log_line)
      .add_flag<Fields>('F')
      .set_pattern(json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","message":"%J"%F})"
                        : "%Y-%m-%d %H:%M:%S.%e %l: %J");
  log.logger->set_formatter(std::move(formatter));
  log.audit = std::static_pointer_cast<spdlog::async_logger>(log.logger->clone("ccsliced"));
  log.audit->set_level(audits ? spdlog::level::info : spdlog::level::off);
  log.logger->set_level(to_spdlog(level));
  spdlog::set_default_logger(log.logger);
}

void log_with_fields(LogLevel level, std::string_view message, const std::vector<LogField>& fields) {
  if (!current_log().logger) return spdlog::log(to_spdlog(level), "{}", message);
  spdlog::log(to_spdlog(level), "{}", payload_of(message, fields));
}

void log_audit(const std::string& action, const std::string& message, std::vector<LogField> fields) {
  fields.insert(fields.begin(), {{"event", "audit"}, {"action", action}});
  const auto& audit = current_log().audit;
  if (!audit) return spdlog::info("{}: {}", action, message);
  audit->info("{}", payload_of(action + ": " + message, fields));
}

std::uint64_t lost_log_lines() {
  const Log& log = current_log();
  return log.queue ? log.queue->overrun_counter() + log.sink->unwritten() : 0;
}

bool flush_log(std::chrono::milliseconds limit) {
  Log& log = current_log();
  const std::uint64_t before = log.sink->flushes();
  log.logger->flush();
  return log.sink->wait_for_flush(before, limit);
}

}  // namespace ccslice::server
