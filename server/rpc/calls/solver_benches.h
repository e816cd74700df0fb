// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the batches of a call are worked on: solvers, which are costly to make, each with its part of the memory.

#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// One thread at a time.
template <class Solver>
class SolverBenches {
 public:
  struct Bench {
    explicit Bench(MemoryBudget& scratch) : share(scratch) {}

    MemoryBudget::Share share;     // Goes after the solver.
    std::optional<Solver> solver;  // Made by the first worker.
  };
  using BenchPtr = std::shared_ptr<Bench>;

  SolverBenches(MemoryBudget& scratch, std::size_t most) : scratch_(scratch), most_(most) {}

  std::size_t most() const { return most_; }
  bool has_idle() const { return !idle_.empty(); }
  /// Whether no more may be made.
  bool are_all_made() const { return made_ == most_; }

  /// An idle one, or a new one, without memory.
  BenchPtr take() {
    if (idle_.empty()) {
      ++made_;
      return std::make_shared<Bench>(scratch_);
    }
    BenchPtr bench = std::move(idle_.back());
    idle_.pop_back();
    return bench;
  }
  /// For the next batch, unless it never got memory.
  void put_back(BenchPtr bench) {
    if (bench->share.bytes() == 0) return note_gone();
    idle_.push_back(std::move(bench));
  }
  /// One that was taken doesn't come back.
  void note_gone() { --made_; }
  /// The idle ones, which are handed out: they may take their time to go.
  void move_idle_to(std::vector<BenchPtr>& benches) {
    made_ -= idle_.size();
    std::move(idle_.begin(), idle_.end(), std::back_inserter(benches));
    idle_.clear();
  }

 private:
  MemoryBudget& scratch_;
  const std::size_t most_;
  std::vector<BenchPtr> idle_;
  std::size_t made_ = 0;  // Those that are taken included.
};

}  // namespace ccslice::server
