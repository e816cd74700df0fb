// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs beside the paper's figures: Tables 1 to 3 of [Luu19] as text, all figures as JSON, and a picture.

#pragma once

#include <optional>
#include <span>
#include <string>

#include "tests/bench/model_run.h"

namespace ccslice::bench {

struct PaperReport {
  std::optional<SliceRun> slice;  // Table 1: if the coyote was run.
  std::vector<ModelRun> models;   // In the order of Table 2.
  int threads = 1;                // Of the jobs.
};

void print_table_1(const PaperReport& report);
void print_table_2(const PaperReport& report);
void print_table_3(const PaperReport& report);
/// Times per voxel and stage, one thread, errors, and what was sampled.
void print_stages(const PaperReport& report);
void print_samples(const PaperReport& report);
/// What the engine has to keep to, and whether it does.
void print_bars(const PaperReport& report);
/// All jobs together.
void print_sum(const PaperReport& report);

std::string to_json(const PaperReport& report);

/// A PNG of the time per voxel by model and stage. Throws std::runtime_error.
void plot(const PaperReport& report, const std::string& path);

}  // namespace ccslice::bench
