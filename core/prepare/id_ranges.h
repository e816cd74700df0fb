// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Work on all cells, or on all faces, one range after the other or several at a time. Ranges are the same for any
// number of threads, so what depends on a range alone is, too.
//
// Private to core/limit.

#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>

#include "core/base/ids.h"

namespace ccslice {

/// The number-th range.
template <typename IdType>
struct NumberedRange {
  std::uint32_t number;
  IdRange<IdType> ids;
};

inline constexpr std::uint32_t kLeastIdsPerRange = 16, kMostIdsPerRange = 256;

/// Where there are few ids, ranges are small, so that threads end at about the same time.
constexpr std::uint32_t ids_per_range_of(std::uint32_t ids, std::uint32_t least = kLeastIdsPerRange,
                                         std::uint32_t most = kMostIdsPerRange) {
  constexpr std::uint32_t kRanges = 32;
  return std::clamp(ids / kRanges, least, most);
}

constexpr std::uint32_t range_count(std::uint32_t ids, std::uint32_t ids_per_range) {
  return (ids + ids_per_range - 1) / ids_per_range;
}

/// Calls work(worker, range) for all ranges. Each thread makes a worker of its own. Throws what they throw.
template <typename IdType, typename MakeWorker, typename Work>
void for_each_range(IdRange<IdType> ids, int threads, std::uint32_t ids_per_range, MakeWorker make_worker, Work work) {
  const auto range = [&](std::uint32_t number) {
    const std::uint32_t begin = number * ids_per_range;
    return NumberedRange<IdType>{number, {IdType{begin}, IdType{std::min(begin + ids_per_range, ids.size())}}};
  };
  const std::uint32_t count = range_count(ids.size(), ids_per_range);
  if (threads <= 1 || count <= 1) {
    auto worker = make_worker();
    for (std::uint32_t number = 0; number < count; ++number) work(worker, range(number));
    return;
  }
  tbb::enumerable_thread_specific<decltype(make_worker())> workers(make_worker);
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t number) { work(workers.local(), range(number)); });
  });
}

}  // namespace ccslice
