// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client.h"
#include "client/layer_assembler.h"
#include "client/layer_queue.h"

namespace ccslice::client {
namespace {

void pin_or_compare(const v1::SliceHeader& header, SlicePin& pin) {
  if (pin.engine_version.empty()) pin.engine_version = header.engine_version();
  if (!pin.grid) pin.grid = header.grid();
  if (header.engine_version() != pin.engine_version) {
    throw ClientError(grpc::StatusCode::ABORTED, local_reason::kEngineMixed,
                      "the server's engine is " + header.engine_version() + ", the layers so far are of " +
                          pin.engine_version + "; slice the whole job again with one engine");
  }
  if (header.grid().SerializeAsString() != pin.grid->SerializeAsString()) {
    throw ClientError(grpc::StatusCode::ABORTED, local_reason::kGridMixed,
                      "the server's grid differs from that of the layers so far; slice the whole job again");
  }
}

bool has_meshes_of(const v1::SliceJob& job, const v1::SliceHeader& header) {
  return std::ranges::equal(job.parts(), header.mesh_ids(), {}, &v1::Part::mesh_id);
}

void check_header(const v1::SliceHeader& header, const v1::SliceRangeRequest& request) {
  const bool fits = has_meshes_of(request.job(), header) && header.first_layer() == request.first_layer() &&
                    header.layer_count() == request.layer_count() &&
                    header.planes_size() == request.job().planes_size();
  if (!fits) {
    throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt,
                      "the server's answer is wrong: its header belongs to another request");
  }
}

/// What is left of `request` after the layers that have been delivered.
v1::SliceRangeRequest rest_of(const v1::SliceRangeRequest& request, std::uint64_t delivered) {
  v1::SliceRangeRequest rest = request;
  rest.set_first_layer(request.first_layer() + static_cast<std::uint32_t>(delivered));
  rest.set_layer_count(request.layer_count() - static_cast<std::uint32_t>(delivered));
  return rest;
}

void add_voxels(std::vector<std::uint64_t>& sums, const std::vector<std::uint64_t>& voxels) {
  sums.resize(std::max(sums.size(), voxels.size()));
  for (std::size_t i = 0; i < voxels.size(); ++i) sums[i] += voxels[i];
}

void add_parts(std::vector<v1::PartVoxels>& sums, const std::vector<v1::PartVoxels>& parts) {
  sums.resize(std::max(sums.size(), parts.size()));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    sums[p].set_voxel_count(sums[p].voxel_count() + parts[p].voxel_count());
    for (int m = 0; m < parts[p].material_voxels_size(); ++m) {
      if (m == sums[p].material_voxels_size()) sums[p].add_material_voxels(0);
      sums[p].set_material_voxels(m, sums[p].material_voxels(m) + parts[p].material_voxels(m));
    }
  }
}

void add_overlaps(std::vector<v1::PartOverlap>& sums, const std::vector<v1::PartOverlap>& overlaps) {
  for (const v1::PartOverlap& overlap : overlaps) {
    const auto known = std::ranges::find_if(sums, [&](const v1::PartOverlap& sum) {
      return sum.owner() == overlap.owner() && sum.covered() == overlap.covered();
    });
    if (known == sums.end()) {
      sums.push_back(overlap);
    } else {
      known->set_voxel_count(known->voxel_count() + overlap.voxel_count());
    }
  }
}

SliceOutcome counts_of(const Layer& layer) {
  const v1::LayerStatistics& statistics = layer.end.statistics();
  SliceOutcome counts;
  counts.layers = 1;
  counts.empty_layers = layer.end.empty() ? 1 : 0;
  counts.voxel_count = layer.end.voxel_count();
  counts.voxels_interpolated = statistics.voxels_interpolated();
  counts.voxels_unresolved = statistics.voxels_unresolved();
  counts.voxels_repainted = statistics.voxels_repainted();
  counts.max_residual_mm = statistics.max_residual_mm();
  for (const Plane& plane : layer.planes) counts.encoded_bytes += plane.encoded.size();
  counts.material_voxels = {statistics.material_voxels().begin(), statistics.material_voxels().end()};
  counts.voxels_off_map = statistics.voxels_off_map();
  counts.voxels_scaled_up = statistics.voxels_scaled_up();
  counts.least_fraction_sum = statistics.least_fraction_sum();
  counts.voxels_covered = statistics.voxels_covered();
  counts.voxels_cut = statistics.voxels_cut();
  counts.parts = {statistics.parts().begin(), statistics.parts().end()};
  counts.overlaps = {statistics.overlaps().begin(), statistics.overlaps().end()};
  return counts;
}

/// A stream that is cancelled unless it was read to its end.
class SliceStream {
 public:
  SliceStream(const Endpoint& endpoint, const v1::SliceRangeRequest& request, const CallOptions& options)
      : call_(options, endpoint, mesh_id_of(request.job())),
        reader_(endpoint.stub->SliceRange(&call_.context(), request)) {}
  ~SliceStream() {
    if (finished_) return;
    call_.context().TryCancel();
    reader_->Finish();
  }
  SliceStream(const SliceStream&) = delete;
  SliceStream& operator=(const SliceStream&) = delete;

  bool read(v1::SliceRangeResponse* message) { return reader_->Read(message); }
  void finish() {
    finished_ = true;
    call_.check(reader_->Finish());
  }

 private:
  Call call_;
  std::unique_ptr<grpc::ClientReader<v1::SliceRangeResponse>> reader_;
  bool finished_ = false;
};

/// The header as if one stream had brought all layers.
v1::SliceHeader header_of_all(const v1::SliceHeader& header, const v1::SliceRangeRequest& request) {
  v1::SliceHeader whole = header;
  whole.set_first_layer(request.first_layer());
  whole.set_layer_count(request.layer_count());
  return whole;
}

/// Threads that fill a queue. When this ends, they do.
class SliceThreads {
 public:
  SliceThreads(LayerQueue& queue, Cancellation& ending) : queue_(queue), ending_(ending) {}
  ~SliceThreads() {
    queue_.stop();
    // What still runs is no more than needed if an error ends the job; else it is over.
    if (!queue_.done()) ending_.cancel();
    for (std::thread& thread : threads_) thread.join();
  }
  SliceThreads(const SliceThreads&) = delete;
  SliceThreads& operator=(const SliceThreads&) = delete;

  template <typename Body>
  void start(Body body) {
    threads_.emplace_back(std::move(body));
  }

 private:
  LayerQueue& queue_;
  Cancellation& ending_;
  std::vector<std::thread> threads_;
};

}  // namespace

/// One stream, from its header to its end. `outcome` counts what has been delivered, whatever happens.
void Client::slice_once(const v1::SliceRangeRequest& request, const LayerCallback& on_layer, const CallOptions& call,
                        SlicePin& pin, Attempts& attempts, SliceOutcome& outcome) {
  SliceStream stream(*attempts.endpoint(), request, call);
  std::optional<LayerAssembler> layers;
  v1::SliceRangeResponse message;
  while (stream.read(&message)) {
    if (!layers) {
      check_header(message.header(), request);
      pin_or_compare(message.header(), pin);
      if (outcome.header.mesh_ids().empty()) outcome.header = message.header();
      layers.emplace(message.header());
      continue;
    }
    if (std::optional<Layer> layer = layers->add(std::move(message))) {
      outcome.add_counts(counts_of(*layer));
      attempts.progress();
      on_layer(outcome.header, std::move(*layer));
    }
  }
  stream.finish();
  if (!layers || !layers->complete()) {
    throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt,
                      "the server's answer is wrong: it ended before its summary");
  }
}

void SliceOutcome::add_counts(const SliceOutcome& part) {
  layers += part.layers;
  empty_layers += part.empty_layers;
  voxel_count += part.voxel_count;
  voxels_interpolated += part.voxels_interpolated;
  voxels_unresolved += part.voxels_unresolved;
  voxels_repainted += part.voxels_repainted;
  max_residual_mm = std::max(max_residual_mm, part.max_residual_mm);
  encoded_bytes += part.encoded_bytes;
  add_voxels(material_voxels, part.material_voxels);
  voxels_off_map += part.voxels_off_map;
  voxels_covered += part.voxels_covered;
  voxels_cut += part.voxels_cut;
  add_parts(parts, part.parts);
  add_overlaps(overlaps, part.overlaps);
  if (part.voxels_scaled_up > 0) {
    const bool first = voxels_scaled_up == 0;
    least_fraction_sum = first ? part.least_fraction_sum : std::min(least_fraction_sum, part.least_fraction_sum);
    voxels_scaled_up += part.voxels_scaled_up;
  }
}

SliceOutcome Client::slice_from(std::size_t turn, const v1::SliceRangeRequest& request, const LayerCallback& on_layer,
                                const CallOptions& call, SlicePin& pin) {
  SliceOutcome outcome;
  Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, mesh_ids_of(request.job()), turn);
  with_retries(call, attempts, outcome.reuploads, [&](const Endpoint&) {
    if (outcome.layers == request.layer_count() && outcome.layers > 0) return;
    outcome.resumes += outcome.layers > 0;
    slice_once(rest_of(request, outcome.layers), on_layer, call, pin, attempts, outcome);
  });
  return outcome;
}

/// What one of several threads does: block after block, first asked of endpoint number `turn`.
void Client::slice_blocks(std::size_t turn, v1::SliceRangeRequest request, const CallOptions& call, SlicePin pin,
                          LayerQueue& queue, SliceOutcome& outcome) {
  const auto put = [&](const v1::SliceHeader& header, Layer layer) {
    if (!queue.put(header, std::move(layer))) throw_cancelled_here();
  };
  try {
    while (const std::optional<LayerBlock> block = queue.take()) {
      request.set_first_layer(block->first);
      request.set_layer_count(block->count);
      const SliceOutcome part = slice_from(turn, request, put, call, pin);
      outcome.resumes += part.resumes;
      outcome.reuploads += part.reuploads;
    }
  } catch (...) {
    queue.fail(std::current_exception());
  }
}

SliceOutcome Client::slice_split(unsigned streams, const v1::SliceRangeRequest& request, const LayerCallback& on_layer,
                                 const CallOptions& call, SlicePin& pin) {
  constexpr std::uint64_t kMostBytes = 256 << 20;
  constexpr std::chrono::milliseconds kLook(50);  // How often to look whether the call is cancelled.
  LayerQueue queue({request.first_layer(), request.layer_count()}, streams, kMostBytes);
  Cancellation ending;
  CallOptions own_call = call;
  own_call.cancellation = &ending;
  std::vector<SliceOutcome> parts(streams);
  SliceOutcome outcome;
  {
    SliceThreads threads(queue, ending);
    for (unsigned i = 0; i < streams; ++i) {
      threads.start([&, i, own_pin = pin] { slice_blocks(i, request, own_call, own_pin, queue, parts[i]); });
    }
    while (!queue.done()) {
      if (call.cancellation && call.cancellation->cancelled()) throw_cancelled_here();
      std::optional<LayerQueue::Item> item = queue.next(kLook);
      if (!item) continue;
      pin_or_compare(item->header, pin);
      if (outcome.layers == 0) outcome.header = header_of_all(item->header, request);
      outcome.add_counts(counts_of(item->layer));
      on_layer(outcome.header, std::move(item->layer));
    }
  }
  for (const SliceOutcome& part : parts) {
    outcome.resumes += part.resumes;
    outcome.reuploads += part.reuploads;
  }
  return outcome;
}

SliceOutcome Client::slice(const v1::SliceRangeRequest& request, const LayerCallback& on_layer, const CallOptions& call,
                           SlicePin* pin) {
  SlicePin own_pin;
  SlicePin& pinned = pin ? *pin : own_pin;
  const std::size_t endpoints = call.split > 1 ? endpoints_->in_order(mesh_id_of(request.job())).size() : 1;
  const auto streams = static_cast<unsigned>(std::min<std::size_t>({call.split, endpoints, request.layer_count()}));
  if (streams > 1) return slice_split(streams, request, on_layer, call, pinned);
  return slice_from(0, request, on_layer, call, pinned);
}

}  // namespace ccslice::client
