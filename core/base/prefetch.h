// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Asks for memory that is about to be read, where the order of reading isn't the order in memory.

#pragma once

#include <cstddef>
#include <cstdint>

namespace ccslice {

/// `objects` may be anywhere: nothing is read.
template <typename T>
void prefetch(const T* objects, std::size_t count = 1) noexcept {
  constexpr std::uintptr_t kLine = 64;
  const auto begin = reinterpret_cast<std::uintptr_t>(objects), end = begin + count * sizeof(T);
  for (std::uintptr_t line = begin & ~(kLine - 1); line < end; line += kLine) {
    __builtin_prefetch(reinterpret_cast<const void*>(line));
  }
}

}  // namespace ccslice
