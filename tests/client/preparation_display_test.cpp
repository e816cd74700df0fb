// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/preparation_display.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

namespace ccslice::cli {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Standard error is this file as long as it lives.
class StandardError {
 public:
  explicit StandardError(int descriptor) : kept_(dup(STDERR_FILENO)) {
    std::fflush(stderr);
    dup2(descriptor, STDERR_FILENO);
  }
  ~StandardError() {
    std::fflush(stderr);
    dup2(kept_, STDERR_FILENO);
    close(kept_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;

 private:
  const int kept_;
};

v1::GetPreparationResponse at(v1::PreparationPhase phase, std::uint64_t done, std::uint64_t total) {
  v1::GetPreparationResponse answer;
  answer.set_phase(phase);
  answer.set_done_cells(done);
  answer.set_total_cells(total);
  return answer;
}

void show_some(bool quiet) {
  PreparationDisplay display(quiet);
  display.update(at(v1::PREPARATION_PHASE_WAITING, 0, 0));
  display.update(at(v1::PREPARATION_PHASE_REFINING, 0, 0));
  for (const std::uint64_t done : {100u, 400u, 700u}) {
    display.update(at(v1::PREPARATION_PHASE_BUILDING, done, 1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
  }
  display.update(at(v1::PREPARATION_PHASE_MEASURING, 0, 0));
  display.update(at(v1::PREPARATION_PHASE_SEARCHING_FOLDS, 10, 1000));
  std::this_thread::sleep_for(std::chrono::milliseconds(120));
  display.update(at(v1::PREPARATION_PHASE_SEARCHING_FOLDS, 20, 1000));
  std::this_thread::sleep_for(std::chrono::milliseconds(120));
  display.update(at(static_cast<v1::PreparationPhase>(85), 1, 3));  // Of a newer server.
  display.finish();
}

/// What comes out of a terminal.
template <typename Show>
std::string shown_on_terminal(const Show& show) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  EXPECT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  const int line = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  EXPECT_GE(line, 0);
  {
    const StandardError shown(line);
    show();
  }
  fcntl(terminal, F_SETFL, O_NONBLOCK);
  std::string text;
  std::array<char, 4096> buffer;
  for (ssize_t length; (length = ::read(terminal, buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(length));
  }
  close(line);
  close(terminal);
  return text;
}

TEST(PreparationDisplay, HasABarForEachCountedPhaseOnATerminal) {
  const std::string text = shown_on_terminal([] { show_some(/*quiet=*/false); });
  EXPECT_THAT(text, HasSubstr("waits for its turn\r\nthe server refines the mesh\r\n"));
  EXPECT_THAT(text, HasSubstr("\rbuilding cells [=========               ] 400 of 1,000 cells"));
  EXPECT_THAT(text, HasSubstr("\rbuilding cells [========================] 1,000 of 1,000 cells")) << "it is done";
  EXPECT_THAT(text, HasSubstr("\rlooking for folds [                        ] 20 of 1,000 cells"));
  EXPECT_THAT(text, HasSubstr("the server measures the surface\r\n"));
}

TEST(PreparationDisplay, DoesNotCallDoneWhatAnotherServerBeginsAnew) {
  const std::string text = shown_on_terminal([] {
    PreparationDisplay display(/*quiet=*/false);
    for (const std::uint64_t done : {500u, 900u, 100u, 300u}) {
      display.update(at(v1::PREPARATION_PHASE_BUILDING, done, 1000));
      std::this_thread::sleep_for(std::chrono::milliseconds(120));
    }
    display.update(at(v1::PREPARATION_PHASE_READING, 0, 0));
  });
  EXPECT_THAT(text, HasSubstr(" 900 of 1,000 cells"));
  EXPECT_THAT(text, HasSubstr(" 300 of 1,000 cells"));
  EXPECT_THAT(text, Not(HasSubstr("1,000 of 1,000")));
}

TEST(PreparationDisplay, DoesNotCallDoneWhatWasUnderWayBeforeARestart) {
  const std::string text = shown_on_terminal([] {
    PreparationDisplay display(/*quiet=*/false);
    for (const std::uint64_t done : {400u, 500u}) {
      display.update(at(v1::PREPARATION_PHASE_BUILDING, done, 1000));
      std::this_thread::sleep_for(std::chrono::milliseconds(120));
    }
    display.restart();
    display.update(at(v1::PREPARATION_PHASE_SEARCHING_FOLDS, 10, 1000));
  });
  EXPECT_THAT(text, HasSubstr(" 500 of 1,000 cells"));
  EXPECT_THAT(text, Not(HasSubstr("1,000 of 1,000")));
}

TEST(PreparationDisplay, IsQuietIfAsked) {
  EXPECT_THAT(shown_on_terminal([] { show_some(/*quiet=*/true); }), IsEmpty());
}

TEST(PreparationDisplay, ShowsNoBarsWhereThereIsNoTerminal) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  {
    const StandardError shown(ends[1]);
    show_some(/*quiet=*/false);
  }
  close(ends[1]);
  std::array<char, 4096> buffer;
  const ssize_t length = ::read(ends[0], buffer.data(), buffer.size());
  close(ends[0]);
  ASSERT_GT(length, 0);
  const std::string text(buffer.data(), static_cast<std::size_t>(length));
  EXPECT_EQ(text,
            "the server has other work first; the mesh waits for its turn\n"
            "the server refines the mesh\n"
            "the server measures the surface\n");
}

}  // namespace
}  // namespace ccslice::cli
