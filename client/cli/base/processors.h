// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What work on this machine may use of it.

#pragma once

#include <algorithm>
#include <thread>

namespace ccslice::cli {

/// All of the machine's processors, one at least.
inline int processors() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

}  // namespace ccslice::cli
