// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>

#include "core/base/cancellation.h"
#include "core/mesh/validate.h"
#include "core/prepare/preparation_progress.h"

namespace ccslice {

struct PrepareOptions {
  MeshLimits limits;
  CancellationToken cancel;
  int threads = 1;  // At most. The solid is the same for any number.
  /// Told how much memory the preparation takes at most: by the numbers of control cells of each kind first, then by
  /// what they are refined into and by the operators of different neighbourhoods, each time before it is used, and
  /// never less than before. What it throws ends the preparation, and nothing else bounds it. An estimate, some tenths
  /// above what was measured.
  std::function<void(std::uint64_t bytes)> reserve;
  PreparationProgress* progress = nullptr;  // Told how far it is, if not null.

  void begin(PreparationStep step, std::uint64_t items = 0) const noexcept {
    if (progress != nullptr) progress->begin(step, items);
  }
  void count(std::uint64_t items) const noexcept {
    if (progress != nullptr) progress->add(items);
  }
};

}  // namespace ccslice
