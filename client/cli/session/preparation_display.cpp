// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session/preparation_display.h"

namespace ccslice::cli {
namespace {

/// In a phase that isn't counted; or nothing.
const char* what_the_server_does(v1::PreparationPhase phase) {
  switch (phase) {
    case v1::PREPARATION_PHASE_WAITING: return "the server has other work first; the mesh waits for its turn";
    case v1::PREPARATION_PHASE_READING: return "the server reads the mesh";
    case v1::PREPARATION_PHASE_CHECKING: return "the server checks the mesh";
    case v1::PREPARATION_PHASE_REFINING: return "the server refines the mesh";
    case v1::PREPARATION_PHASE_MEASURING: return "the server measures the surface";
    case v1::PREPARATION_PHASE_FINISHING: return "the server looks for overlaps";
    default: return nullptr;
  }
}

/// Newer servers may have more phases.
const char* what_is_done(v1::PreparationPhase phase) {
  switch (phase) {
    case v1::PREPARATION_PHASE_BUILDING: return "building cells";
    case v1::PREPARATION_PHASE_BOUNDING: return "bounding cells";
    case v1::PREPARATION_PHASE_SEARCHING_FOLDS: return "looking for folds";
    default: return "preparing";
  }
}

}  // namespace

void PreparationDisplay::update(const v1::GetPreparationResponse& answer) {
  const bool same_phase = answer.phase() == last_.phase();
  const bool again = same_phase ? answer.done_cells() < last_.done_cells() : answer.phase() < last_.phase();
  if (again) {
    bar_.reset();  // Of a server that failed; another one has begun.
  } else if (!same_phase) {
    finish();
  }
  if (again || !same_phase) {
    const char* note = what_the_server_does(answer.phase());
    if (note != nullptr && !quiet_) print_note(note);
    if (answer.total_cells() > 0) {
      bar_.emplace(what_is_done(answer.phase()), "cells", answer.total_cells(), quiet_, answer.done_cells());
    }
  }
  last_ = answer;
  if (bar_) bar_->update(answer.done_cells());
}

void PreparationDisplay::finish() {
  if (bar_) bar_->update(last_.total_cells());
  bar_.reset();
}

void PreparationDisplay::restart() {
  bar_.reset();
  last_.Clear();
}

}  // namespace ccslice::cli
