// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Estimates what a job comes to from some of its layers.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/client.h"

namespace ccslice::cli {

/// Consecutive layers, and how many of the job's they stand for, themselves included.
struct LayerSample {
  std::uint32_t first_layer = 0, layer_count = 0, stands_for = 0;
};

/// At most 16 layers, and a quarter, of each of 16 equal parts of the job; all layers of a job that has no more than
/// 16. They lie anywhere in their part, since what repeats with the height would look the same in the middle of each.
std::vector<LayerSample> layers_to_sample(std::uint32_t first_layer, std::uint32_t layer_count);

class JobCosts {
 public:
  /// `sliced`: what the sample's layers came to.
  void add(const LayerSample& sample, const client::SliceOutcome& sliced);

  v1::JobCosts document(const v1::SliceJob& job) const;
  std::string text(const v1::SliceJob& job) const;

 private:
  client::SliceOutcome total_;  // Of the whole job.
  std::uint64_t sampled_ = 0, layers_ = 0;
};

}  // namespace ccslice::cli
