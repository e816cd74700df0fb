// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What hostile_jobs tells of its seeds.

#pragma once

#include <span>
#include <string>

#include "tests/oracle/hostile/hostile_check.h"

namespace ccslice::bench {

/// Prints the sums of each check and of all. True if nothing failed.
bool print_summary(std::span<const oracle::HostileResult> results);

/// An array of objects, one a seed. Throws std::runtime_error.
void write_json(const std::string& path, std::span<const oracle::HostileResult> results);

}  // namespace ccslice::bench
