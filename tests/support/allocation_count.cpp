// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/allocation_count.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> total_bytes = 0, held_bytes = 0, most_held_bytes = 0;

void* count(void* block, std::size_t size) {
  if (block == nullptr) throw std::bad_alloc();
  total_bytes += size;
  const std::size_t held = held_bytes += malloc_usable_size(block);
  std::size_t most = most_held_bytes;
  while (held > most && !most_held_bytes.compare_exchange_weak(most, held)) {
  }
  return block;
}

void release(void* block) {
  held_bytes -= malloc_usable_size(block);
  std::free(block);
}

}  // namespace

void* operator new(std::size_t size) { return count(std::malloc(std::max<std::size_t>(1, size)), size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto step = static_cast<std::size_t>(alignment);
  return count(std::aligned_alloc(step, std::max<std::size_t>(1, (size + step - 1) / step) * step), size);
}
// Sanitizers have one of their own, which wouldn't be counted, while what it gave comes back to be deleted here.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* block) noexcept { release(block); }
void operator delete(void* block, const std::nothrow_t&) noexcept { release(block); }
void operator delete(void* block, std::size_t) noexcept { release(block); }
void operator delete(void* block, std::align_val_t) noexcept { release(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { release(block); }

std::size_t ccslice::oracle::allocated_bytes() { return total_bytes; }

ccslice::oracle::HeldMemory::HeldMemory() : before_(held_bytes) { most_held_bytes = before_; }

std::size_t ccslice::oracle::HeldMemory::bytes() const {
  const std::size_t held = held_bytes;
  return held - std::min(held, before_);
}

std::size_t ccslice::oracle::HeldMemory::most_bytes() const { return most_held_bytes - before_; }
