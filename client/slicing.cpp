// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client.h"
#include "client/layer_assembler.h"

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

void check_header(const v1::SliceHeader& header, const v1::SliceRangeRequest& request) {
  const bool fits = header.mesh_id() == request.mesh_id() && header.first_layer() == request.first_layer() &&
                    header.layer_count() == request.layer_count() && header.planes_size() == request.planes_size();
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

void add_to(SliceOutcome& outcome, const Layer& layer) {
  ++outcome.layers;
  outcome.empty_layers += layer.end.empty();
  outcome.voxel_count += layer.end.voxel_count();
  outcome.voxels_interpolated += layer.end.statistics().voxels_interpolated();
  outcome.voxels_unresolved += layer.end.statistics().voxels_unresolved();
  outcome.max_residual_mm = std::max(outcome.max_residual_mm, layer.end.statistics().max_residual_mm());
  for (const Plane& plane : layer.planes) outcome.encoded_bytes += plane.encoded.size();
  const auto& voxels = layer.end.statistics().material_voxels();
  add_voxels(outcome.material_voxels, {voxels.begin(), voxels.end()});
}

/// A stream that is cancelled unless it was read to its end.
class SliceStream {
 public:
  SliceStream(const Endpoint& endpoint, const v1::SliceRangeRequest& request, const CallOptions& options)
      : call_(options, endpoint, request.mesh_id()), reader_(endpoint.stub->SliceRange(&call_.context(), request)) {}
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
      if (outcome.header.mesh_id().empty()) outcome.header = message.header();
      layers.emplace(message.header());
      continue;
    }
    if (std::optional<Layer> layer = layers->add(std::move(message))) {
      add_to(outcome, *layer);
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
  max_residual_mm = std::max(max_residual_mm, part.max_residual_mm);
  encoded_bytes += part.encoded_bytes;
  add_voxels(material_voxels, part.material_voxels);
}

SliceOutcome Client::slice(const v1::SliceRangeRequest& request, const LayerCallback& on_layer, const CallOptions& call,
                           SlicePin* pin) {
  SlicePin own_pin;
  SlicePin& pinned = pin ? *pin : own_pin;
  SliceOutcome outcome;
  Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, request.mesh_id());
  with_retries(call, attempts, outcome.reuploads, [&](const Endpoint&) {
    if (outcome.layers == request.layer_count() && outcome.layers > 0) return;
    outcome.resumes += outcome.layers > 0;
    slice_once(rest_of(request, outcome.layers), on_layer, call, pinned, attempts, outcome);
  });
  return outcome;
}

}  // namespace ccslice::client
