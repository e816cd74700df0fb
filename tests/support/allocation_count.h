// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What operator new has been asked for: it is replaced for the whole program in the executables that link
// ccslice_allocation_count.

#pragma once

#include <cstddef>

namespace ccslice::oracle {

/// In all, since the program began.
std::size_t allocated_bytes();

/// How much more is held than when this was made, and was at once, at most. One at a time.
class HeldMemory {
 public:
  HeldMemory();
  std::size_t bytes() const;
  std::size_t most_bytes() const;

 private:
  std::size_t before_;
};

}  // namespace ccslice::oracle
