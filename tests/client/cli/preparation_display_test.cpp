// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session/preparation_display.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>
#include <thread>

#include "tests/client/standard_error.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

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
