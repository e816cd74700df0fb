// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The whole way of an uploaded mesh, from arbitrary bytes: read as the server reads it, prepared, one small layer
// sliced. What the reader takes, however it is cut, protobuf takes to the same mesh. What prepares is sliced without an
// internal error, and soon.

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/meshes/mesh_convert.h"
#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/validate.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "server/rpc/convert/mesh_reader.h"
#include "tests/fuzz/quiet_protobuf.h"

namespace {

using namespace ccslice;

constexpr std::uint64_t kMostMemoryBytes = 512 << 20;
constexpr double kMostVoxels = 24;  // Along an axis.

MeshLimits mesh_limits() {
  MeshLimits limits;
  limits.max_vertices = 2'000;
  limits.max_cells = 1'000;
  return limits;
}

/// The mesh, or why there is none.
struct Reading {
  std::optional<ControlMesh> mesh;
  ErrorCode error = ErrorCode::kInternal;
};

Reading read(const std::vector<std::string>& blocks) {
  try {
    return {.mesh = server::read_control_mesh(blocks, mesh_limits())};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal) std::abort();
    return {.mesh = std::nullopt, .error = error.code()};
  }
}

std::string serialized(const ControlMesh& mesh) { return cli::to_proto(mesh).SerializeAsString(); }

std::vector<std::string> cut(const std::string& bytes) {
  constexpr std::size_t kBlockBytes = 7;
  std::vector<std::string> blocks;
  for (std::size_t at = 0; at < bytes.size(); at += kBlockBytes) blocks.push_back(bytes.substr(at, kBlockBytes));
  return blocks;
}

std::optional<ControlMesh> read_and_compare(const std::string& bytes) {
  Reading whole = read({bytes}), pieces = read(cut(bytes));
  if (whole.mesh.has_value() != pieces.mesh.has_value() || whole.error != pieces.error) std::abort();
  if (!whole.mesh) return std::nullopt;
  v1::ControlMesh message;
  if (!message.ParseFromString(bytes) || message.SerializeAsString() != serialized(*whole.mesh)) std::abort();
  if (serialized(*pieces.mesh) != serialized(*whole.mesh)) std::abort();
  return std::move(whole.mesh);
}

std::shared_ptr<const LimitSolid> prepare(ControlMesh mesh) {
  PrepareOptions options;
  options.limits = mesh_limits();
  options.reserve = [](std::uint64_t bytes) {
    if (bytes > kMostMemoryBytes) throw Error(ErrorCode::kMeshTooLarge, "more memory than a target of a fuzzer has");
  };
  return prepare_solid(std::move(mesh), options);
}

PlaneSpec plane_of(PlaneContent content, SampleType sample_type) {
  PlaneSpec plane;
  plane.content = content;
  plane.sample_type = sample_type;
  return plane;
}

/// Two materials, blended over a channel's range.
Printing printing_of(const ChannelRange& channel) {
  Printing printing;
  printing.materials = {{"low", 0x000000ff}, {"high", 0xffffffff}};
  if (channel.min < channel.max) {
    printing.map.kind = BlendMap{.channel = channel.name, .stops = {{channel.min, 1}, {channel.max, 2}}};
  }
  return printing;
}

/// Occupancy, the first channel, halftones of it, cell regions and contours, in a box of at most 24 x 24 x 24 voxels.
SliceJob job_of(const LimitSolid& solid) {
  SliceJob job;
  const double pitch_mm = solid.summary().bounding_box.sizes().maxCoeff() / kMostVoxels;
  GridRequest request;
  request.pitch = {pitch_mm, pitch_mm, pitch_mm};
  job.grid = plan_grid(solid, job.placement, request);
  job.contours = true;
  job.planes.push_back(plane_of(PlaneContent::kOccupancy, SampleType::kBit));
  if (solid.channel_count() > 0) {
    job.printing = printing_of(solid.summary().channels[0]);
    job.planes.push_back(plane_of(PlaneContent::kChannel, SampleType::kUint8));
    job.planes.back().channel = solid.summary().channels[0].name;
    job.planes.push_back(plane_of(PlaneContent::kMaterials, SampleType::kUint8));
  }
  if (!solid.summary().cell_regions.empty()) {
    job.planes.push_back(plane_of(PlaneContent::kCellRegions, SampleType::kUint8));
  }
  validate_job(solid, job);
  return job;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::optional<ControlMesh> mesh = read_and_compare({reinterpret_cast<const char*>(data), size});
  if (!mesh) return 0;
  try {
    const std::shared_ptr<const LimitSolid> solid = prepare(std::move(*mesh));
    const SliceJob job = job_of(*solid);
    const Layer layer = LayerSlicer(solid, job).slice(job.grid.extent.layers / 2, {});
    if (layer.planes.size() != job.planes.size()) std::abort();
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal) std::abort();
  }
  return 0;
}
