// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/served_job.h"

#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "client/cli/meshes/mesh_convert.h"
#include "client/mesh_bytes.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {
namespace {

void ask_for_contone(const ChannelRange& channel, v1::SliceJob& asked) {
  asked.add_planes()->mutable_occupancy();
  v1::PlaneSpec& plane = *asked.add_planes();
  plane.mutable_channel()->set_name(channel.name);
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  for (v1::PlaneSpec& each : *asked.mutable_planes()) each.set_encoding(v1::PLANE_ENCODING_RUNS_ZSTD);
}

void ask_for_materials(const ChannelRange& channel, v1::PlaneEncoding encoding, v1::SliceJob& asked) {
  v1::PlaneSpec& plane = *asked.add_planes();
  plane.mutable_materials();
  plane.set_encoding(encoding);
  v1::BlendMap& blend = *asked.mutable_printing()->mutable_map()->mutable_blend();
  blend.set_channel(channel.name);
  const std::array<std::pair<const char*, std::uint32_t>, 3> materials = {
      {{"soft", 0xff0000ff}, {"middle", 0x00ff00ff}, {"hard", 0x0000ffff}}};
  for (std::size_t i = 0; i < materials.size(); ++i) {
    v1::PrintMaterial& material = *asked.mutable_printing()->add_materials();
    material.set_name(materials[i].first);
    material.set_rgba(materials[i].second);
    v1::BlendStop& stop = *blend.add_stops();
    stop.set_value(channel.min + (channel.max - channel.min) * static_cast<double>(i) / (materials.size() - 1));
    stop.set_material(materials[i].first);
  }
}

v1::SliceRangeRequest request_for(const PrinterJob& job, const std::string& mesh_id, const LayerRange& range,
                                  JobPictures pictures = JobPictures::kContone) {
  v1::SliceRangeRequest request;
  v1::SliceJob& asked = *request.mutable_job();
  asked.add_parts()->set_mesh_id(mesh_id);
  v1::VoxelPitch& pitch = *asked.mutable_grid()->mutable_pitch();
  pitch.set_x_mm(job.job.grid.pitch.x_mm);
  pitch.set_y_mm(job.job.grid.pitch.y_mm);
  pitch.set_z_mm(job.job.grid.pitch.z_mm);
  const ChannelRange& channel = job.solid->summary().channels[0];
  switch (pictures) {
    case JobPictures::kContone: ask_for_contone(channel, asked); break;
    case JobPictures::kIndexed: ask_for_materials(channel, v1::PLANE_ENCODING_PNG, asked); break;
    case JobPictures::kRgba: ask_for_materials(channel, v1::PLANE_ENCODING_PNG_RGBA, asked); break;
  }
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

ServedCost JobServer::run(const PrinterJob& job, const LayerRange& range, JobPictures pictures) {
  ServedCost cost;
  const auto mesh = mesh_bytes(job);
  const Stopwatch upload;
  client_.ensure_uploaded(mesh);
  cost.upload_seconds = upload.seconds();
  const Stopwatch slicing;
  const client::SliceOutcome outcome =
      client_.slice(request_for(job, mesh->id(), range, pictures), [](const v1::SliceHeader&, const client::Layer&) {});
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
