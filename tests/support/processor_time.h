// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <ctime>

namespace ccslice {

/// Processor time of all threads of the process since the object was made, s. Tests bound work by it: other programs
/// don't add to it, so it says the same on a busy machine.
class ProcessorTime {
 public:
  double seconds() const { return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace ccslice
