// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Every maximum of the service that isn't an option. Those of meshes and slicing requests are the core's: MeshLimits
// and SliceLimits.

#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace ccslice::server {

/// What a gRPC client takes per message unless told otherwise, the whole message counted.
inline constexpr std::size_t kClientMessageBytes = 4u << 20;

/// Requests: those of a job hold up to 255 maps of materials with up to 256 points each; points come by the 4096. What
/// protobuf makes of the largest of them takes 4 MB (56 bytes for each point), in the count of parsed_size.h.
inline constexpr std::size_t kMaxJobRequestBytes = 2u << 20;
inline constexpr std::size_t kMaxRequestBytes = 256u << 10;
inline constexpr std::size_t kMaxParsedBytes = 8u << 20;
inline constexpr std::size_t kMaxShortParsedBytes = 16u << 10;  // Of requests without points or jobs, besides texts.
/// Of uploads: gRPC's own limit (--max-message-bytes) comes first.
inline constexpr std::size_t kMaxMessageBytes = 2047u << 20;

/// Payload of one message of a stream. The default keeps loopback throughput near its best.
inline constexpr std::uint32_t kMinChunkBytes = 4u << 10;
inline constexpr std::uint32_t kDefaultChunkBytes = 512u << 10;
inline constexpr std::uint32_t kMaxChunkBytes = 1u << 20;

/// Points in one message of ProbePoints and EvaluatePoints: with 64 channels the answer takes 2.5 MB.
inline constexpr std::uint32_t kMaxPointsPerMessage = 4096;
static_assert(kMaxPointsPerMessage * (64 + 16 + 12 + 3) * sizeof(double) < kClientMessageBytes);

/// Ids in one FindMissingMeshes, meshes in one page of ListMeshes (a summary takes some 90 kB with as many channels and
/// cell regions as there may be).
inline constexpr std::uint32_t kMaxIdsPerMessage = 1000;
inline constexpr std::uint32_t kMaxPageSize = 1000;
inline constexpr std::uint32_t kDefaultPageSize = 100;
inline constexpr std::size_t kMaxPageBytes = 3u << 20;

/// Ids and places listed in a summary or a warning.
inline constexpr std::size_t kMaxListedItems = 32;

/// Triangles of one TessellateBoundary: as many as the memory of a stream holds, but no more than the maximum. They
/// have half as many vertices, or somewhat more, with three numbers and a value for each channel.
inline constexpr std::uint64_t kMaxTriangles = 20'000'000;
constexpr std::uint64_t triangle_memory_bytes(std::size_t channels) {
  const std::uint64_t vertex = 3 * sizeof(double) + channels * sizeof(float);
  return std::max<std::uint64_t>(64, 3 * sizeof(std::uint32_t) + vertex * 5 / 8);
}
inline constexpr double kMinChordToleranceMm = 1e-5;
inline constexpr double kMaxChordToleranceMm = 1e3;
inline constexpr double kDefaultChordToleranceMm = 0.05;

/// Of the memory for scratch, what long work leaves to short work: an eighth, but at least 128 MiB or half of it, so
/// that some of that finds room. What takes more isn't short: others would wait for its end.
constexpr std::uint64_t scratch_for_short(std::uint64_t capacity_bytes) {
  return std::max(capacity_bytes / 8, std::min<std::uint64_t>(capacity_bytes / 2, 128u << 20));
}

/// How many calls run beyond --max-concurrent-calls, as long as these aren't long: a quarter.
inline constexpr std::size_t kShortShareOfCalls = 4;

/// Of the memory of the server, for a call that is open: 18 KB are what the least one takes.
inline constexpr std::uint64_t kOpenCallBytes = 64u << 10;

/// What the process itself (130 MB with OpenImageIO) and work that isn't counted take of the server's memory.
constexpr std::uint64_t process_memory(std::uint64_t memory_bytes) {
  return std::min<std::uint64_t>(256u << 20, memory_bytes / 4);
}

/// What a slicing call takes at least of the memory for streams.
inline constexpr std::uint64_t kMinStreamWindowBytes = 1u << 20;

/// What a client is told to wait after SERVER_BUSY or CACHE_FULL.
inline constexpr std::chrono::seconds kRetryDelay(2);

}  // namespace ccslice::server
