// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/heap_trim.h"

#include <malloc.h>

namespace ccslice::server {
namespace {

constexpr std::uint64_t kWorthIt = 64u << 20;

}  // namespace

bool HeapTrim::sweep() {
  const std::uint64_t freed_bytes = freed_bytes_();
  const bool is_much = freed_bytes - seen_bytes_ >= kWorthIt;
  if (!is_much && !again_) return false;
  again_ = is_much;
  seen_bytes_ = freed_bytes;
  malloc_trim(0);
  return true;
}

}  // namespace ccslice::server
