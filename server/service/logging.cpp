// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/logging.h"

#include <poll.h>
#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "server/service/log_text.h"

namespace ccslice::server {
namespace {

/// %J: the message, safe in its format.
class SafeMessage final : public spdlog::custom_flag_formatter {
 public:
  using Escape = std::string (*)(std::string_view);
  explicit SafeMessage(Escape escape) : escape_(escape) {}

  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string text = escape_({message.payload.data(), message.payload.size()});
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
  std::uint64_t unwritten_ = 0, told_ = 0;
  std::mutex flushed_mutex_;
  std::condition_variable flushed_;
  std::uint64_t flushes_ = 0;
};

/// What set_up_logging() made last.
struct Log {
  std::shared_ptr<spdlog::details::thread_pool> queue;
  std::shared_ptr<DescriptorSink> sink;
  std::shared_ptr<spdlog::async_logger> logger;
};

Log& current_log() {
  static Log log;
  return log;
}

}  // namespace

void set_up_logging(LogLevel level, LogFormat format, int descriptor) {
  Log& log = current_log();
  log.queue = std::make_shared<spdlog::details::thread_pool>(kLogQueueLines, 1);
  log.sink = std::make_shared<DescriptorSink>(descriptor, *log.queue);
  log.logger = std::make_shared<spdlog::async_logger>("ccsliced", log.sink, log.queue,
                                                      spdlog::async_overflow_policy::overrun_oldest);
  const bool json = format == LogFormat::kJson;
  auto formatter = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  formatter->add_flag<SafeMessage>('J', json ? &to_log_json : &to_log_line)
      .set_pattern(json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","message":"%J"})"
                        : "%Y-%m-%d %H:%M:%S.%e %l: %J");
  log.logger->set_formatter(std::move(formatter));
  log.logger->set_level(to_spdlog(level));
  spdlog::set_default_logger(log.logger);
}

bool flush_log(std::chrono::milliseconds limit) {
  Log& log = current_log();
  const std::uint64_t before = log.sink->flushes();
  log.logger->flush();
  return log.sink->wait_for_flush(before, limit);
}

}  // namespace ccslice::server
