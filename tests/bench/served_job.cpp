// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/served_job.h"

#include <memory>
#include <stdexcept>
#include <string>

#include "client/cli/mesh_convert.h"
#include "client/mesh_bytes.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {
namespace {

v1::SliceRangeRequest request_for(const PrinterJob& job, const std::string& mesh_id, const LayerRange& range) {
  v1::SliceRangeRequest request;
  request.set_mesh_id(mesh_id);
  v1::VoxelPitch& pitch = *request.mutable_grid()->mutable_pitch();
  pitch.set_x_mm(job.job.grid.pitch.x_mm);
  pitch.set_y_mm(job.job.grid.pitch.y_mm);
  pitch.set_z_mm(job.job.grid.pitch.z_mm);
  request.add_planes()->mutable_occupancy();
  v1::PlaneSpec& channel = *request.add_planes();
  channel.mutable_channel()->set_name(job.solid->summary().channels[0].name);
  channel.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  for (v1::PlaneSpec& plane : *request.mutable_planes()) plane.set_encoding(v1::PLANE_ENCODING_RAW_ZSTD);
  request.set_first_layer(range.first);
  request.set_layer_count(range.count);
  return request;
}

std::shared_ptr<const client::MeshBytes> mesh_bytes(const PrinterJob& job) {
  return std::make_shared<const client::MeshBytes>(cli::to_proto(job.mesh));
}

}  // namespace

JobServer::JobServer(int threads)
    : server_({"--threads", std::to_string(threads)}), client_({.address = server_.address()}) {
  client_.server_info();  // Connects.
}

void JobServer::upload(const PrinterJob& job) { client_.ensure_uploaded(mesh_bytes(job)); }

ServedCost JobServer::run(const PrinterJob& job, const LayerRange& range) {
  ServedCost cost;
  const auto mesh = mesh_bytes(job);
  const Stopwatch upload;
  client_.ensure_uploaded(mesh);
  cost.upload_seconds = upload.seconds();
  const Stopwatch slicing;
  const client::SliceOutcome outcome =
      client_.slice(request_for(job, mesh->id(), range), [](const v1::SliceHeader&, const client::Layer&) {});
  cost.slice_seconds = slicing.seconds();
  cost.layers = outcome.layers;
  cost.voxels = outcome.voxel_count;
  cost.encoded_bytes = outcome.encoded_bytes;
  return cost;
}

double JobServer::first_layer_seconds(const PrinterJob& job, std::uint32_t first) {
  const std::uint32_t count = job.job.grid.extent.layers - first;
  const v1::SliceRangeRequest request = request_for(job, mesh_bytes(job)->id(), {first, count});
  struct Arrived {
    double seconds;
  };
  const Stopwatch slicing;
  try {
    client_.slice(request, [&](const v1::SliceHeader&, const client::Layer&) { throw Arrived{slicing.seconds()}; });
  } catch (const Arrived& arrived) {
    return arrived.seconds;
  }
  throw std::runtime_error("no layer came");
}

}  // namespace ccslice::bench
