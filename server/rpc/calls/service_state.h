// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What all calls share.

#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>

#include "core/job/slice_limits.h"
#include "core/mesh/validate.h"
#include "server/service/base/limits.h"
#include "server/service/base/metrics.h"
#include "server/service/meshes/mesh_cache.h"
#include "server/service/meshes/preparation_memory.h"
#include "server/service/meshes/stored_meshes.h"
#include "server/service/network/access.h"
#include "server/service/options/options.h"
#include "server/service/scheduling/admission.h"
#include "server/service/scheduling/call_registry.h"
#include "server/service/scheduling/executor.h"
#include "server/service/scheduling/heap_trim.h"
#include "server/service/scheduling/idle_watch.h"
#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// How often the store learns of uses: well within the time after which it drops what isn't used.
inline std::chrono::milliseconds mark_every(const MeshStoreOptions& store) {
  constexpr std::chrono::milliseconds kUsual(60'000);
  if (store.time_to_live_s == 0) return kUsual;
  return std::min<std::chrono::milliseconds>(kUsual, std::chrono::seconds(store.time_to_live_s) / 4);
}

/// Well within the minutes after which somebody is called.
inline constexpr std::chrono::milliseconds kCheckStoreEvery(10'000);

/// Without a token file everybody may do everything.
inline Access make_access(const ServerOptions& options) {
  return options.token_file.empty() ? Access() : Access(options.token_file);
}

struct ServiceState {
  explicit ServiceState(const ServerOptions& server_options)
      : options(server_options),
        executor(options.threads),
        preparations(options.preparation_budget_bytes),
        preparation_memory(preparations),
        cache(executor, {.capacity_bytes = options.cache_bytes, .time_to_live = options.mesh_time_to_live}),
        uploads(options.upload_budget_bytes, {}, options.upload_loan),
        requests(options.connection_budget_bytes / 2),
        streams(options.stream_budget_bytes, [this] { admission.retry(); }),
        scratch(options.scratch_budget_bytes, [this] { admission.retry(); }),
        calls(static_cast<std::size_t>(options.memory_bytes / kOpenCallBytes)),
        access(make_access(options)),
        client_calls(options.max_calls_per_client),
        admission({.running = options.max_concurrent_calls,
                   .short_more = options.max_concurrent_calls / kShortShareOfCalls,
                   .waiting = options.max_waiting_calls,
                   .longest_wait = options.admission_wait}),
        idle_watch(options.idle_timeout),
        preview_watch(options.preview_idle_timeout),
        heap_trim([this] { return heap_figures(); }) {
    slice_limits.max_layer_bytes = std::min(slice_limits.max_layer_bytes, options.stream_window_bytes);
    if (options.mesh_store.place) {
      store = std::make_unique<StoredMeshes>(open_mesh_store(options.mesh_store), uploads,
                                             StoredMeshes::Options{.max_mesh_bytes = options.max_mesh_bytes,
                                                                   .mark_every = mark_every(options.mesh_store),
                                                                   .check_every = kCheckStoreEvery});
    }
    max_triangles = std::min(kMaxTriangles, options.stream_window_bytes / triangle_memory_bytes(/*channels=*/0));
  }
  /// Work that is still running uses the other members.
  ~ServiceState() {
    store.reset();
    executor.wait_idle();
  }

  HeapTrim::Figures heap_figures() {
    HeapTrim::Figures figures{.known_bytes = cache.use().used_bytes,
                              .resident_bytes = resident_memory_bytes(),
                              .is_idle = admission.running() == 0};
    for (const MemoryBudget* budget : {&uploads, &requests, &preparations, &streams, &scratch}) {
      figures.freed_bytes += budget->given_back_bytes();
      figures.known_bytes += budget->used_bytes();
    }
    return figures;
  }

  const ServerOptions options;
  MeshLimits mesh_limits;
  SliceLimits slice_limits;
  std::uint64_t max_triangles;  // In one TessellateBoundary.
  Executor executor;
  MemoryBudget preparations;             // Meshes on their way to solids,
  PreparationMemory preparation_memory;  // whose it is alone.
  MeshCache cache;
  MemoryBudget uploads;                 // Bytes of meshes that arrive.
  MemoryBudget requests;                // Other requests, also while they wait: gRPC counts them with connections.
  std::unique_ptr<StoredMeshes> store;  // None: this server's meshes are its own.
  MemoryBudget streams;                 // Layers and triangles on their way to clients.
  MemoryBudget scratch;                 // What slicers hold while they work.
  CallRegistry calls;
  Access access;
  ClientCalls client_calls;
  Metrics metrics;
  Admission admission;
  IdleWatch idle_watch;
  IdleWatch preview_watch;  // Of Preview calls that wait for requests.
  HeapTrim heap_trim;
};

}  // namespace ccslice::server
