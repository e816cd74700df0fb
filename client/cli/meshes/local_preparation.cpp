// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/local_preparation.h"

#include <chrono>
#include <utility>

namespace ccslice::cli {
namespace {

constexpr std::chrono::milliseconds kPause{100};

/// What a step that is counted is called.
const char* name_of(PreparationStep step) {
  switch (step) {
    case PreparationStep::kBounding: return "bounding cells";
    case PreparationStep::kFolding: return "looking for folds";
    default: return "building cells";
  }
}

}  // namespace

LocalPreparation::LocalPreparation(std::string what, bool quiet)
    : what_(what.empty() ? std::move(what) : what + ", "), quiet_(quiet) {
  if (!quiet_) thread_ = std::jthread([this](std::stop_token stop) { watch(std::move(stop)); });
}

LocalPreparation::~LocalPreparation() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  draw();  // Leaves the last state standing, which isn't the end if preparing failed.
}

PreparationProgress* LocalPreparation::begin() {
  const std::lock_guard lock(mutex_);
  end_bar();
  progress_ = std::make_unique<PreparationProgress>();
  return progress_.get();
}

void LocalPreparation::tell_memory(std::uint64_t bytes) {
  constexpr std::uint64_t kMuch = 100'000'000;
  if (quiet_ || bytes < kMuch || bytes / 3 < told_bytes_ / 2) return;
  const std::lock_guard lock(mutex_);
  end_bar();
  print_note(what_ + "preparing the mesh takes at least " + show_bytes(bytes) + " of memory, here or on a server");
  told_bytes_ = bytes;
}

void LocalPreparation::count(const std::string& step, std::uint64_t done, std::uint64_t total) {
  const std::lock_guard lock(mutex_);
  progress_.reset();
  if (bar_step_ != PreparationStep::kWaiting) end_bar();
  if (!bar_) bar_.emplace(what_ + step, "cells", total, quiet_);
  bar_->update(done);
}

void LocalPreparation::watch(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    draw();
    stopping_.wait_for(lock, stop, kPause, [] { return false; });
  }
}

void LocalPreparation::draw() {
  if (!progress_) return;
  const PreparationProgress::State state = progress_->state();
  if (bar_ && state.step != bar_step_) end_bar();
  if (state.total == 0) return;
  if (!bar_) {
    bar_.emplace(what_ + name_of(state.step), "cells", state.total, quiet_, state.done);
    bar_step_ = state.step;
    bar_total_ = state.total;
  }
  bar_->update(state.done);
}

/// A step that another one follows is done.
void LocalPreparation::end_bar() {
  if (bar_ && bar_total_ > 0) bar_->update(bar_total_);
  bar_.reset();
  bar_step_ = PreparationStep::kWaiting;
  bar_total_ = 0;
}

}  // namespace ccslice::cli
