// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/local_preparation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "tests/client/standard_error.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Long enough for the display's thread to look twice, however busy the machine.
void wait_a_little() { std::this_thread::sleep_for(std::chrono::milliseconds(500)); }

/// Two solids, the second one's cells not all built, then other work.
void show_two_solids(bool quiet) {
  LocalPreparation display("fitting", quiet);
  for (const std::uint64_t cells : {1000u, 3000u}) {
    PreparationProgress& progress = *display.begin();
    progress.begin(PreparationStep::kRefining);
    progress.begin(PreparationStep::kBuilding, cells);
    progress.add(500);
    wait_a_little();
    if (cells == 3000) continue;
    progress.add(500);
    progress.begin(PreparationStep::kFolding, 2000);
    progress.add(1000);
    wait_a_little();
  }
  display.count("sampling channels", 10, 40);
  wait_a_little();
  display.count("sampling channels", 20, 40);
}

TEST(LocalPreparation, HasABarForEachCountedStepOnATerminal) {
  const std::string text = shown_on_terminal([] { show_two_solids(/*quiet=*/false); });
  EXPECT_THAT(text, HasSubstr("\rfitting, building cells [============            ] 500 of 1,000 cells"));
  EXPECT_THAT(text, HasSubstr("\rfitting, building cells [========================] 1,000 of 1,000 cells"));
  EXPECT_THAT(text, HasSubstr("\rfitting, looking for folds [============            ] 1,000 of 2,000 cells"));
  EXPECT_THAT(text, HasSubstr("\rfitting, building cells [====                    ] 500 of 3,000 cells"));
  EXPECT_THAT(text, HasSubstr("\rfitting, sampling channels [============            ] 20 of 40 cells"));
}

TEST(LocalPreparation, DoesNotCallDoneWhatFails) {
  const std::string text = shown_on_terminal([] {
    LocalPreparation display("", /*quiet=*/false);
    PreparationProgress& progress = *display.begin();
    progress.begin(PreparationStep::kBuilding, 1000);
    progress.add(300);
    wait_a_little();
  });
  EXPECT_THAT(text, HasSubstr("\rbuilding cells [=======                 ] 300 of 1,000 cells"));
  EXPECT_THAT(text, Not(HasSubstr("1,000 of 1,000")));
}

TEST(LocalPreparation, IsQuietIfAskedAndForWhatIsSoonDone) {
  EXPECT_THAT(shown_on_terminal([] { show_two_solids(/*quiet=*/true); }), IsEmpty());
  EXPECT_THAT(shown_on_terminal([] {
                LocalPreparation display("", /*quiet=*/false);
                display.begin()->begin(PreparationStep::kBuilding, 100);
                display.tell_memory(99'000'000);
              }),
              IsEmpty());
}

TEST(LocalPreparation, TellsOfMuchMemoryAndOfMuchMore) {
  const std::string text = shown_on_terminal([] {
    LocalPreparation display("", /*quiet=*/false);
    for (const std::uint64_t megabytes : {50u, 200u, 210u, 250u, 500u, 500u}) {
      display.tell_memory(megabytes * 1'000'000);
    }
  });
  EXPECT_EQ(text,
            "preparing the mesh takes at least 200.0 MB of memory, here or on a server\r\n"
            "preparing the mesh takes at least 500.0 MB of memory, here or on a server\r\n");
}

}  // namespace
}  // namespace ccslice::cli
