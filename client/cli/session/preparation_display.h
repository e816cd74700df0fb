// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far the server is with preparing a mesh, as the user sees it.

#pragma once

#include <optional>

#include "ccslice/v1/mesh.pb.h"
#include "client/cli/base/console.h"

namespace ccslice::cli {

/// A bar for each phase that is counted (Progress), and a note for each other one: short ones are hardly ever met. One
/// thread at a time.
class PreparationDisplay {
 public:
  explicit PreparationDisplay(bool quiet) : quiet_(quiet) {}

  void update(const v1::GetPreparationResponse& answer);
  /// The mesh is prepared, so what was under way is done.
  void finish();
  /// The upload is repeated: what was under way won't be done.
  void restart();

 private:
  const bool quiet_;
  v1::GetPreparationResponse last_;
  std::optional<Progress> bar_;  // Of the last answer's phase, if it is counted.
};

}  // namespace ccslice::cli
