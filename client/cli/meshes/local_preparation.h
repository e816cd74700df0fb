// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far this program is with what it works out itself, without a server, as the user sees it.

#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/cli/base/console.h"
#include "core/prepare/preparation_progress.h"

namespace ccslice::cli {

/// Shows solids that are prepared one after the other: a bar for each step that is counted (Progress), drawn by a
/// thread of its own. Nothing if quiet, or for what is soon done. Its functions are for the thread that has solids
/// prepared.
class LocalPreparation {
 public:
  /// `what` begins each bar: "fitting", say. Nothing: bars begin with the step.
  LocalPreparation(std::string what, bool quiet);
  ~LocalPreparation();
  LocalPreparation(const LocalPreparation&) = delete;
  LocalPreparation& operator=(const LocalPreparation&) = delete;

  /// The next solid, or another round: where preparing it tells its progress. Holds until this is called again.
  PreparationProgress* begin();
  /// Takes the least memory that preparing needs, as PrepareOptions::reserve is told it. Prints the first figure that
  /// is much, and those that are much more than the last one printed.
  void tell_memory(std::uint64_t bytes);
  /// A bar of other work, in items of the whole.
  void count(const std::string& step, std::uint64_t done, std::uint64_t total);

 private:
  void watch(std::stop_token stop);
  void draw();
  void end_bar();

  const std::string what_;
  const bool quiet_;
  std::uint64_t told_bytes_ = 0;
  std::mutex mutex_;  // Guards what follows.
  std::condition_variable_any stopping_;
  std::unique_ptr<PreparationProgress> progress_;
  std::optional<Progress> bar_;
  PreparationStep bar_step_ = PreparationStep::kWaiting;
  std::uint64_t bar_total_ = 0;
  std::jthread thread_;  // Last: it uses the others.
};

}  // namespace ccslice::cli
