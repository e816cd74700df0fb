// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Gives memory that was freed back to the machine. The allocator keeps what lies between pieces still in use, for each
// thread that allocated; looking for it there takes some milliseconds, so it is done now and then, and only after much
// has been freed.

#pragma once

#include <cstdint>
#include <functional>
#include <utility>

namespace ccslice::server {

/// One thread.
class HeapTrim {
 public:
  /// `freed_bytes`: how much has been freed, or is about to be, since the beginning. About.
  explicit HeapTrim(std::function<std::uint64_t()> freed_bytes) : freed_bytes_(std::move(freed_bytes)) {}

  /// To be called now and then. Whether it was worth it.
  bool sweep();

 private:
  const std::function<std::uint64_t()> freed_bytes_;
  std::uint64_t seen_bytes_ = 0;
  bool again_ = false;  // What was about to be freed then has been by now.
};

}  // namespace ccslice::server
