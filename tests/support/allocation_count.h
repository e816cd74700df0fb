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

}  // namespace ccslice::oracle
