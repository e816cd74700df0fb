// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/summary.h"

#include <algorithm>
#include <string>

#include "core/base/engine_version.h"
#include "server/rpc/convert/convert.h"
#include "server/service/base/limits.h"

namespace ccslice::server {
namespace {

void write_counts(const SolidSummary& solid, v1::MeshSummary& summary) {
  summary.set_control_vertices(solid.control_vertices);
  summary.set_control_cells(solid.control_cells);
  summary.set_limit_cells(solid.limit_cells);
  summary.set_regular_cells(solid.regular_cells);
  summary.set_line_cells(solid.line_cells);
  summary.set_vertex_cells(solid.vertex_cells);
  summary.set_extraordinary_edges(solid.extraordinary_edges);
  summary.set_extraordinary_vertices(solid.extraordinary_vertices);
  summary.set_irregular_boundary_edges(solid.irregular_boundary_edges);
  summary.set_sharp_edges(solid.sharp_edges);
  summary.set_boundary_faces(solid.boundary_faces);
}

v1::VolumeSampleType sample_type_of(VolumeSampleType type) {
  switch (type) {
    case VolumeSampleType::kUint8: return v1::VOLUME_SAMPLE_TYPE_UINT8;
    case VolumeSampleType::kInt16: return v1::VOLUME_SAMPLE_TYPE_INT16;
    case VolumeSampleType::kUint16: return v1::VOLUME_SAMPLE_TYPE_UINT16;
    case VolumeSampleType::kFloat32: break;
  }
  return v1::VOLUME_SAMPLE_TYPE_FLOAT32;
}

v1::PreparationPhase phase_of(PreparationStep step) {
  switch (step) {
    case PreparationStep::kWaiting: return v1::PREPARATION_PHASE_WAITING;
    case PreparationStep::kReading: return v1::PREPARATION_PHASE_READING;
    case PreparationStep::kChecking: return v1::PREPARATION_PHASE_CHECKING;
    case PreparationStep::kRefining: return v1::PREPARATION_PHASE_REFINING;
    case PreparationStep::kBuilding: return v1::PREPARATION_PHASE_BUILDING;
    case PreparationStep::kMeasuring: return v1::PREPARATION_PHASE_MEASURING;
    case PreparationStep::kBounding: return v1::PREPARATION_PHASE_BOUNDING;
    case PreparationStep::kFolding: return v1::PREPARATION_PHASE_SEARCHING_FOLDS;
    case PreparationStep::kFinishing: return v1::PREPARATION_PHASE_FINISHING;
  }
  return v1::PREPARATION_PHASE_UNSPECIFIED;
}

void write_warnings(const SolidSummary& solid, v1::MeshSummary& summary) {
  summary.set_inverted_control_cell_count(solid.inverted_control_cells.size());
  const std::size_t listed = std::min(solid.inverted_control_cells.size(), kMaxListedItems);
  for (std::size_t i = 0; i < listed; ++i) summary.add_inverted_control_cells(solid.inverted_control_cells[i]);
  summary.set_folding_cells(solid.folding_cells);
  summary.set_undecided_cells(solid.undecided_cells);
  for (const FoldPlace& fold : solid.folds) *summary.add_folds() = to_message(fold);
  *summary.mutable_overlaps() = to_message(solid.overlaps);
}

void write_solid(const SolidSummary& solid, v1::MeshSummary& summary) {
  write_counts(solid, summary);
  *summary.mutable_bounding_box() = to_message(solid.bounding_box);
  *summary.mutable_deviation() = to_message(solid.deviation);
  for (const ChannelRange& channel : solid.channels) *summary.add_channels() = to_message(channel);
  for (const CellRegionSummary& region : solid.cell_regions) *summary.add_cell_regions() = to_message(region);
  write_warnings(solid, summary);
}

v1::VolumeSummary volume_summary(const Volume& volume) {
  const VolumeShape& shape = volume.shape();
  v1::VolumeSummary summary;
  summary.set_samples_i(shape.samples[0]);
  summary.set_samples_j(shape.samples[1]);
  summary.set_samples_k(shape.samples[2]);
  summary.set_sample_type(sample_type_of(shape.type));
  for (const Volume::ChannelSamples& samples : volume.channels()) {
    v1::VolumeChannel& channel = *summary.add_channels();
    channel.set_min_sample(samples.min);
    channel.set_max_sample(samples.max);
    channel.set_nan_samples(samples.nan);
  }
  return summary;
}

}  // namespace

v1::MeshSummary summarize(const ListedMesh& listed) {
  const CachedMesh& mesh = *listed.mesh;
  v1::MeshSummary summary;
  summary.set_mesh_id(mesh.id());
  summary.set_size_bytes(mesh.prepared().serialized_bytes);
  summary.set_memory_bytes(mesh.prepared().memory_bytes);
  if (mesh.volume()) {
    *summary.mutable_volume() = volume_summary(*mesh.volume());
  } else {
    write_solid(mesh.solid()->summary(), summary);
  }
  summary.set_engine_version(std::string(kEngineVersion));
  *summary.mutable_preparation_time() = to_duration(mesh.prepared().preparation_time);
  *summary.mutable_create_time() = to_timestamp(mesh.created());
  *summary.mutable_last_use_time() = to_timestamp(listed.last_use);
  if (listed.expires) *summary.mutable_expire_time() = to_timestamp(*listed.expires);
  return summary;
}

v1::MeshSummary summarize(MeshCache& cache, const MeshPtr& mesh) {
  // Deleted in the meantime: still a fine summary.
  return summarize(cache.peek(mesh->id()).value_or(ListedMesh{.mesh = mesh, .last_use = Clock::now(), .expires = {}}));
}

v1::GetPreparationResponse preparation_of(MeshCache& cache, const std::string& mesh_id) {
  v1::GetPreparationResponse response;
  // A preparation that ends in between has put its mesh into the cache before.
  if (const auto state = cache.preparation(mesh_id)) {
    response.set_phase(phase_of(state->step));
    response.set_done_cells(state->done);
    response.set_total_cells(state->total);
  } else if (cache.peek(mesh_id)) {
    response.set_phase(v1::PREPARATION_PHASE_PREPARED);
  }
  return response;
}

}  // namespace ccslice::server
