// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/logging.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// What the log writes to, with its reader.
class Pipe {
 public:
  Pipe() {
    std::signal(SIGPIPE, SIG_IGN);
    EXPECT_EQ(pipe(ends_), 0);
  }
  ~Pipe() {
    close_reader();
    set_up_logging(LogLevel::kInfo, LogFormat::kText);  // Nobody writes to it any more.
    close(ends_[1]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int writer() const { return ends_[1]; }
  void close_reader() {
    if (ends_[0] >= 0) close(ends_[0]);
    ends_[0] = -1;
  }
  /// Reads until this text has come.
  std::string read_until(const std::string& text) {
    std::string all;
    while (all.find(text) == std::string::npos) {
      char block[4096];
      pollfd file{ends_[0], POLLIN, 0};
      if (poll(&file, 1, 10'000) != 1) return all;
      const ssize_t count = read(ends_[0], block, sizeof block);
      if (count <= 0) return all;
      all.append(block, static_cast<std::size_t>(count));
    }
    return all;
  }

 private:
  int ends_[2] = {-1, -1};
};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(Logging, WritesSafeLinesInOrder) {
  Pipe pipe;
  set_up_logging(LogLevel::kInfo, LogFormat::kJson, pipe.writer());
  spdlog::debug("not this");
  spdlog::info("one \"{}\"", "\n\x1b");
  spdlog::warn("two");
  EXPECT_TRUE(flush_log(10s));
  const std::string text = pipe.read_until("two");
  EXPECT_EQ(count_of(text, "\n"), 2u);
  EXPECT_THAT(text, HasSubstr(R"("level":"info","message":"one \"\u000a\u001b\""})"));
  EXPECT_LT(text.find("one"), text.find("two"));
  EXPECT_EQ(text.find("not this"), std::string::npos);
}

TEST(Logging, FieldsGoIntoJsonAndNotIntoPlainLines) {
  Pipe pipe;
  set_up_logging(LogLevel::kInfo, LogFormat::kJson, pipe.writer());
  log_with_fields(LogLevel::kInfo, "said \x1f\x1e", {{"text", "\"\x1f"}, {"count", std::uint64_t{7}}, {"ms", 1.5}});
  log_audit("uploaded", "a mesh", {{"client", "farm"}});
  EXPECT_TRUE(flush_log(10s));
  const std::string text = pipe.read_until("farm");
  EXPECT_THAT(text, HasSubstr(R"("message":"said \u001f\u001e","text":"\"\u001f","count":7,"ms":1.500})"));
  EXPECT_THAT(text, HasSubstr(R"("message":"uploaded: a mesh","event":"audit","action":"uploaded","client":"farm"})"));
  EXPECT_EQ(lost_log_lines(), 0u);

  Pipe plain;
  set_up_logging(LogLevel::kInfo, LogFormat::kText, plain.writer());
  log_with_fields(LogLevel::kInfo, "said", {{"text", "hidden"}});
  spdlog::info("\x1e");
  spdlog::info("over");
  EXPECT_TRUE(flush_log(10s));
  const std::string lines = plain.read_until("over");
  EXPECT_THAT(lines, HasSubstr("said\n"));
  EXPECT_EQ(lines.find("hidden"), std::string::npos);
}

TEST(Logging, AuditLinesAreWrittenAtEveryLevel) {
  for (const LogLevel level : {LogLevel::kDebug, LogLevel::kInfo, LogLevel::kWarning, LogLevel::kError}) {
    for (const LogFormat format : {LogFormat::kText, LogFormat::kJson}) {
      Pipe pipe;
      set_up_logging(level, format, pipe.writer());
      log_audit("refused", "SliceRange of farm: ROLE_MISSING", {{"client", "farm"}});
      spdlog::info("the call");
      spdlog::error("the end");
      EXPECT_TRUE(flush_log(10s));
      const std::string text = pipe.read_until("the end");
      EXPECT_THAT(text, HasSubstr("refused: SliceRange of farm: ROLE_MISSING"));
      EXPECT_EQ(count_of(text, R"("event":"audit","action":"refused","client":"farm")"),
                format == LogFormat::kJson ? 1u : 0u);
      EXPECT_EQ(count_of(text, "the call"), level <= LogLevel::kInfo ? 1u : 0u);
    }
  }
}

TEST(Logging, LeavesAuditLinesOutIfNobodyWantsThem) {
  Pipe pipe;
  set_up_logging(LogLevel::kInfo, LogFormat::kText, pipe.writer(), false);
  log_audit("uploaded", "a mesh", {});
  spdlog::info("the end");
  EXPECT_TRUE(flush_log(10s));
  EXPECT_EQ(pipe.read_until("the end").find("uploaded"), std::string::npos);
}

TEST(Logging, NeverWaitsForAReaderThatStopsAndSaysWhatItLost) {
  constexpr std::size_t kThreads = 4, kLines = 3 * kLogQueueLines;
  Pipe pipe;
  set_up_logging(LogLevel::kInfo, LogFormat::kText, pipe.writer());
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([] {
      for (std::size_t i = 0; i < kLines; ++i) spdlog::info("a line of {}", i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(flush_log(50ms)) << "nobody reads";
  spdlog::info("the last");
  const std::string text = pipe.read_until("the last");
  const std::string marker = " lines of the log are lost";
  std::size_t lost = 0;
  for (std::size_t at = text.find(marker); at != std::string::npos; at = text.find(marker, at + 1)) {
    lost += static_cast<std::size_t>(std::atol(text.c_str() + text.rfind(' ', at - 1)));
  }
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(lost + count_of(text, "a line of"), kThreads * kLines);
  EXPECT_TRUE(flush_log(10s));
}

TEST(Logging, OutlivesItsReader) {
  Pipe pipe;
  set_up_logging(LogLevel::kInfo, LogFormat::kText, pipe.writer());
  pipe.close_reader();
  for (int i = 0; i < 100; ++i) spdlog::info("to nobody");
  EXPECT_TRUE(flush_log(10s));
}

TEST(Logging, WaitsForRoomInAFileThatDoesNotBlock) {
  Pipe pipe;
  fcntl(pipe.writer(), F_SETFL, fcntl(pipe.writer(), F_GETFL) | O_NONBLOCK);
  set_up_logging(LogLevel::kInfo, LogFormat::kText, pipe.writer());
  const std::string long_line(1000, 'x');
  for (int i = 0; i < 200; ++i) spdlog::info("{} {}", i, long_line);
  spdlog::info("the last");
  EXPECT_EQ(count_of(pipe.read_until("the last"), long_line), 200u);
}

}  // namespace
}  // namespace ccslice::server
