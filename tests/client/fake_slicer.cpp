// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/client/fake_slicer.h"

#include <grpcpp/server_builder.h>
#include <zlib.h>
#include <zstd.h>

#include <utility>

#include "client/job.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace ccslice::client {
namespace {

constexpr std::uint32_t kColumns = 10, kRows = 6, kLayers = 20;

grpc::Status with_details(grpc::StatusCode code, const std::string& message,
                          const std::vector<const google::protobuf::Message*>& details) {
  google::rpc::Status status;
  status.set_code(code);
  status.set_message(message);
  for (const google::protobuf::Message* detail : details) status.add_details()->PackFrom(*detail);
  return {code, message, status.SerializeAsString()};
}

google::rpc::ErrorInfo error_info(const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_domain("ccslice");
  info.set_reason(reason);
  (*info.mutable_metadata())["field"] = "somewhere";
  return info;
}

std::string pattern(std::uint64_t bytes, std::uint32_t layer) {
  std::string samples(bytes, '\0');
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<char>((i * 7 + layer) & 0xff);
  return samples;
}

std::uint64_t plane_bytes(const v1::PlaneSpec& spec) {
  switch (spec.sample_type()) {
    case v1::SAMPLE_TYPE_BIT: return (kColumns + 7) / 8 * kRows;
    case v1::SAMPLE_TYPE_UINT16: return 2 * kColumns * kRows;
    case v1::SAMPLE_TYPE_FLOAT32: return 4 * kColumns * kRows;
    default: return kColumns * kRows;
  }
}

std::string encode(const std::string& samples, v1::PlaneEncoding encoding) {
  if (encoding == v1::PLANE_ENCODING_RAW) return samples;
  if (encoding == v1::PLANE_ENCODING_PNG) {
    return std::string("\x89PNG\r\n\x1a\n", 8) + samples + std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  }
  std::string frame(ZSTD_compressBound(samples.size()), '\0');
  frame.resize(ZSTD_compress(frame.data(), frame.size(), samples.data(), samples.size(), 1));
  return frame;
}

}  // namespace

grpc::Status failure(grpc::StatusCode code, const std::string& reason, const std::string& message) {
  const google::rpc::ErrorInfo info = error_info(reason);
  return with_details(code, message, {&info});
}

grpc::Status mesh_missing(const std::string& mesh_id) {
  const google::rpc::ErrorInfo info = error_info("MESH_MISSING");
  google::rpc::PreconditionFailure missing;
  missing.add_violations()->set_type("MISSING");
  missing.mutable_violations(0)->set_subject(mesh_id);
  return with_details(grpc::StatusCode::FAILED_PRECONDITION, "mesh " + mesh_id + " is not here", {&info, &missing});
}

grpc::Status busy_for(std::int64_t seconds, std::int32_t nanos) {
  const google::rpc::ErrorInfo info = error_info("SERVER_BUSY");
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(seconds);
  retry.mutable_retry_delay()->set_nanos(nanos);
  return with_details(grpc::StatusCode::UNAVAILABLE, "busy", {&info, &retry});
}

FakeSlicer::FakeSlicer(std::shared_ptr<grpc::ServerCredentials> credentials) {
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", credentials, &port);
  builder.RegisterService(this);
  server_ = builder.BuildAndStart();
  address_ = "127.0.0.1:" + std::to_string(port);
}

FakeSlicer::~FakeSlicer() { stop(); }

void FakeSlicer::stop() { server_->Shutdown(std::chrono::system_clock::now()); }

std::vector<std::string> FakeSlicer::metadata() const {
  const std::lock_guard lock(mutex_);
  return metadata_;
}

void FakeSlicer::note(const std::string& method, grpc::ServerContext& context) {
  if (at_begin) at_begin(context);
  const std::lock_guard lock(mutex_);
  for (const auto& [name, value] : context.client_metadata()) {
    if (name != "ccslice-mesh-id" && name != "authorization") continue;
    metadata_.push_back(method + " " + std::string(name.data(), name.size()) + "=" +
                        std::string(value.data(), value.size()));
  }
}

grpc::Status FakeSlicer::GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest*,
                                       v1::GetServerInfoResponse* response) {
  note("GetServerInfo", *context);
  ++info_calls;
  if (failing_info_calls-- > 0) return failure(grpc::StatusCode::UNAVAILABLE, "SERVER_BUSY", "busy");
  response->set_engine_version(engine_version);
  return answer(*response);
}

grpc::Status FakeSlicer::FindMissingMeshes(grpc::ServerContext* context, const v1::FindMissingMeshesRequest* request,
                                           v1::FindMissingMeshesResponse* response) {
  note("FindMissingMeshes", *context);
  for (const std::string& id : request->mesh_ids()) {
    if (!meshes.contains(id)) response->add_missing_mesh_ids(id);
  }
  return answer(*response);
}

grpc::Status FakeSlicer::UploadMesh(grpc::ServerContext* context, grpc::ServerReader<v1::UploadMeshRequest>* reader,
                                    v1::UploadMeshResponse* response) {
  note("UploadMesh", *context);
  ++uploads;
  v1::UploadMeshRequest message;
  reader->Read(&message);
  const std::string id = message.start().mesh_id();
  const std::uint64_t size = message.start().size_bytes();
  std::string bytes;
  while (reader->Read(&message)) bytes += message.chunk();
  if (before_upload_ends) before_upload_ends(*context);
  if (!upload_failures.empty()) {
    const grpc::Status status = upload_failures.back();
    upload_failures.pop_back();
    return status;
  }
  if (bytes.size() != size) return failure(grpc::StatusCode::INVALID_ARGUMENT, "UPLOAD_TRUNCATED", "too short");
  meshes.insert(id);
  response->mutable_mesh()->set_mesh_id(id);
  response->mutable_mesh()->set_size_bytes(size);
  return answer(*response);
}

grpc::Status FakeSlicer::GetPreparation(grpc::ServerContext* context, const v1::GetPreparationRequest*,
                                        v1::GetPreparationResponse* response) {
  note("GetPreparation", *context);
  ++preparation_calls;
  return preparation ? preparation(*context, *response) : grpc::Status(grpc::StatusCode::UNIMPLEMENTED, "");
}

grpc::Status FakeSlicer::GetMesh(grpc::ServerContext* context, const v1::GetMeshRequest* request,
                                 v1::GetMeshResponse* response) {
  note("GetMesh", *context);
  if (!meshes.contains(request->mesh_id())) return mesh_missing(request->mesh_id());
  response->mutable_mesh()->set_mesh_id(request->mesh_id());
  return answer(*response);
}

grpc::Status FakeSlicer::ListMeshes(grpc::ServerContext*, const v1::ListMeshesRequest*,
                                    v1::ListMeshesResponse* response) {
  for (const std::string& id : meshes) response->add_meshes()->set_mesh_id(id);
  return answer(*response);
}

grpc::Status FakeSlicer::DeleteMesh(grpc::ServerContext*, const v1::DeleteMeshRequest* request,
                                    v1::DeleteMeshResponse* response) {
  response->set_deleted(meshes.erase(request->mesh_id()) > 0);
  return answer(*response);
}

grpc::Status FakeSlicer::answer(google::protobuf::Message& response) const {
  if (tamper_answer) tamper_answer(response);
  return grpc::Status::OK;
}

void FakeSlicer::send(v1::SliceRangeResponse message, grpc::ServerWriter<v1::SliceRangeResponse>& writer) const {
  if (tamper) tamper(message);
  writer.Write(message);
}

void FakeSlicer::send_layer(std::uint32_t layer, const v1::SliceHeader& header,
                            grpc::ServerWriter<v1::SliceRangeResponse>& writer) const {
  v1::SliceRangeResponse begin, end;
  begin.mutable_layer_begin()->set_layer(layer);
  begin.mutable_layer_begin()->set_z_mm(layer + 0.5);
  end.mutable_layer_end()->set_layer(layer);
  end.mutable_layer_end()->set_voxel_count(layer);
  end.mutable_layer_end()->set_empty(layer == 0);
  std::vector<v1::SliceRangeResponse> chunks;
  for (int plane = 0; plane < header.planes_size(); ++plane) {
    const std::string samples = pattern(plane_bytes(header.planes(plane)), layer);
    const std::string encoded = encode(samples, header.planes(plane).encoding());
    begin.mutable_layer_begin()->add_encoded_bytes(encoded.size());
    constexpr std::size_t kChunk = 16;
    for (std::size_t at = 0; at < encoded.size(); at += kChunk) {
      v1::PlaneChunk& chunk = *chunks.emplace_back().mutable_plane_chunk();
      chunk.set_plane(static_cast<std::uint32_t>(plane));
      chunk.set_offset(at);
      chunk.set_data(encoded.substr(at, kChunk));
    }
    v1::PlaneResult& result = *end.mutable_layer_end()->add_planes();
    result.set_raw_bytes(samples.size());
    result.set_crc32(static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(samples.data()), static_cast<uInt>(samples.size()))));
  }
  send(std::move(begin), writer);
  for (v1::SliceRangeResponse& chunk : chunks) send(std::move(chunk), writer);
  send(std::move(end), writer);
}

v1::Grid FakeSlicer::grid_of(const v1::GridSpec& spec) const {
  v1::Grid grid;
  *grid.mutable_pitch() = spec.pitch();
  grid.mutable_pitch()->set_x_mm(spec.pitch().x_mm() + pitch_drift_mm);
  grid.mutable_extent()->set_columns(kColumns);
  grid.mutable_extent()->set_rows(kRows);
  grid.mutable_extent()->set_layers(kLayers);
  return grid;
}

grpc::Status FakeSlicer::PlanSlices(grpc::ServerContext* context, const v1::PlanSlicesRequest* request,
                                    v1::PlanSlicesResponse* response) {
  note("PlanSlices", *context);
  if (!meshes.contains(mesh_id_of(request->job()))) return mesh_missing(mesh_id_of(request->job()));
  *response->mutable_grid() = grid_of(request->job().grid());
  response->set_layer_count(kLayers);
  response->set_engine_version(engine_version);
  return answer(*response);
}

grpc::Status FakeSlicer::SliceRange(grpc::ServerContext* context, const v1::SliceRangeRequest* request,
                                    grpc::ServerWriter<v1::SliceRangeResponse>* writer) {
  note("SliceRange", *context);
  {
    const std::lock_guard lock(mutex_);
    slice_requests.push_back(*request);
  }
  if (!meshes.contains(mesh_id_of(request->job()))) return mesh_missing(mesh_id_of(request->job()));
  v1::SliceRangeResponse message;
  v1::SliceHeader& header = *message.mutable_header();
  header.set_engine_version(engine_version);
  header.add_mesh_ids(mesh_id_of(request->job()));
  *header.mutable_grid() = grid_of(request->job().grid());
  header.set_first_layer(request->first_layer());
  header.set_layer_count(request->layer_count());
  *header.mutable_planes() = request->job().planes();
  const v1::SliceHeader sent = header;
  send(std::move(message), *writer);
  for (std::uint32_t layer = request->first_layer(); layer < request->first_layer() + request->layer_count(); ++layer) {
    if (before_layer) {
      const grpc::Status status = before_layer(layer, *context);
      if (!status.ok()) return status;
    }
    send_layer(layer, sent, *writer);
  }
  v1::SliceRangeResponse summary;
  summary.mutable_summary()->set_layers(request->layer_count());
  send(std::move(summary), *writer);
  return grpc::Status::OK;
}

grpc::Status FakeSlicer::ProbePoints(
    grpc::ServerContext* context, grpc::ServerReaderWriter<v1::ProbePointsResponse, v1::ProbePointsRequest>* stream) {
  note("ProbePoints", *context);
  v1::ProbePointsRequest batch;
  while (stream->Read(&batch)) {
    if (!meshes.contains(batch.mesh_id())) return mesh_missing(batch.mesh_id());
    if (before_probe) {
      const grpc::Status status = before_probe(batch);
      if (!status.ok()) return status;
    }
    probed_points.push_back(batch.points_mm_size() / 3);
    v1::ProbePointsResponse response;
    for (int i = 0; i < batch.points_mm_size(); i += 3) {
      response.add_locations(v1::POINT_LOCATION_INSIDE);
      response.add_limit_cells(0);
      response.add_control_cells(0);
      response.add_residuals_mm(0);
      for (int axis = 0; axis < 3; ++axis) response.add_uvw(0.5);
      response.add_channel_values(batch.points_mm(i));
    }
    stream->Write(response);
  }
  return grpc::Status::OK;
}

grpc::Status FakeSlicer::Preview(grpc::ServerContext*,
                                 grpc::ServerReaderWriter<v1::PreviewResponse, v1::PreviewRequest>* stream) {
  v1::PreviewRequest request;
  while (stream->Read(&request)) {
    v1::PreviewResponse response;
    response.set_number(request.number());
    response.set_stage(v1::PREVIEW_STAGE_FULL);
    response.mutable_header()->set_width(1);
    response.mutable_header()->set_height(1);
    response.mutable_header()->set_picture_bytes(4);
    response.set_picture("rgba");
    response.set_last(true);
    if (tamper_answer) tamper_answer(response);
    for (int i = 0; i < pictures_of_a_preview && stream->Write(response); ++i) continue;
  }
  return grpc::Status::OK;
}

}  // namespace ccslice::client
