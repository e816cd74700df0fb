// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/client.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <utility>

#include "client/attempts.h"
#include "client/call.h"

namespace ccslice::client {
namespace {

constexpr std::size_t kUploadChunkBytes = 512 << 10;
/// With 64 channels an answer of so many points stays below the usual message limit of 4 MiB.
constexpr std::size_t kProbeBatchPoints = 4096;

void check_answer(const v1::ProbePointsResponse& answer, int points) {
  const bool fits = answer.locations_size() == points && answer.limit_cells_size() == points &&
                    answer.control_cells_size() == points && answer.residuals_mm_size() == points &&
                    answer.uvw_size() == 3 * points && answer.materials_size() % points == 0;
  if (!fits) {
    throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt,
                      "the server's answer is wrong: it doesn't fit the points asked for");
  }
}

std::shared_ptr<grpc::Channel> make_channel(const std::string& address) {
  grpc::ChannelArguments arguments;
  // Finds out about servers that vanished without a word; more often than every five minutes counts as abuse.
  constexpr int kKeepaliveMs = 6 * 60 * 1000;
  constexpr int kKeepaliveTimeoutMs = 20 * 1000;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  // A server that is back is looked for every fifth of a second. What is called the least pause is how long an attempt
  // to connect may take (gRPC's subchannel.cc).
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace

Client::Client(ClientOptions options) : Client(make_channel(options.address), options.retry) {}

Client::Client(std::shared_ptr<grpc::ChannelInterface> channel, RetryPolicy retry)
    : retry_(retry), channel_(std::move(channel)), stub_(v1::SlicerService::NewStub(channel_)) {}

std::shared_ptr<const MeshBytes> Client::remembered(const std::string& mesh_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = meshes_.find(mesh_id);
  return found == meshes_.end() ? nullptr : found->second;
}

v1::GetServerInfoResponse Client::server_info(const CallOptions& call) {
  return with_retries(call, [&] {
    Call one(call);
    v1::GetServerInfoResponse response;
    one.check(stub_->GetServerInfo(&one.context(), {}, &response));
    return response;
  });
}

v1::MeshSummary Client::mesh_summary(const std::string& mesh_id, const CallOptions& call) {
  return with_retries(call, [&] {
    Call one(call);
    v1::GetMeshRequest request;
    request.set_mesh_id(mesh_id);
    v1::GetMeshResponse response;
    one.check(stub_->GetMesh(&one.context(), request, &response));
    return response.mesh();
  });
}

std::vector<v1::MeshSummary> Client::list_meshes(const CallOptions& call) {
  std::vector<v1::MeshSummary> meshes;
  v1::ListMeshesRequest request;
  do {
    const v1::ListMeshesResponse page = with_retries(call, [&] {
      Call one(call);
      v1::ListMeshesResponse response;
      one.check(stub_->ListMeshes(&one.context(), request, &response));
      return response;
    });
    meshes.insert(meshes.end(), page.meshes().begin(), page.meshes().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return meshes;
}

bool Client::delete_mesh(const std::string& mesh_id, const CallOptions& call) {
  return with_retries(call, [&] {
    Call one(call);
    v1::DeleteMeshRequest request;
    request.set_mesh_id(mesh_id);
    v1::DeleteMeshResponse response;
    one.check(stub_->DeleteMesh(&one.context(), request, &response));
    return response.deleted();
  });
}

v1::PlanSlicesResponse Client::plan(const v1::PlanSlicesRequest& request, const CallOptions& call) {
  return with_retries(call, [&] {
    Call one(call);
    v1::PlanSlicesResponse response;
    one.check(stub_->PlanSlices(&one.context(), request, &response));
    return response;
  });
}

UploadOutcome Client::ensure_uploaded(std::shared_ptr<const MeshBytes> mesh, const UploadProgress& progress,
                                      const CallOptions& call) {
  {
    const std::lock_guard lock(mutex_);
    meshes_[mesh->id()] = mesh;
  }
  const bool missing = with_retries(call, [&] {
    Call one(call);
    v1::FindMissingMeshesRequest request;
    request.add_mesh_ids(mesh->id());
    v1::FindMissingMeshesResponse response;
    one.check(stub_->FindMissingMeshes(&one.context(), request, &response));
    return response.missing_mesh_ids_size() > 0;
  });
  if (!missing) return {mesh_summary(mesh->id(), call), true};
  v1::UploadMeshResponse response = with_retries(call, [&] { return upload_once(*mesh, progress, call); });
  return {std::move(*response.mutable_mesh()), response.already_cached()};
}

bool Client::forget(const std::string& mesh_id) {
  std::shared_ptr<const MeshBytes> mesh;  // Freed without the lock.
  const std::lock_guard lock(mutex_);
  const auto found = meshes_.find(mesh_id);
  if (found == meshes_.end()) return false;
  mesh = std::move(found->second);
  meshes_.erase(found);
  return true;
}

v1::UploadMeshResponse Client::upload_once(const MeshBytes& mesh, const UploadProgress& progress,
                                           const CallOptions& call) {
  Call one(call);
  v1::UploadMeshResponse response;
  const auto writer = stub_->UploadMesh(&one.context(), &response);
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id(mesh.id());
  message.mutable_start()->set_size_bytes(mesh.bytes().size());
  bool open = writer->Write(message);
  for (std::size_t at = 0; open && at < mesh.bytes().size(); at += kUploadChunkBytes) {
    message.set_chunk(mesh.bytes().substr(at, kUploadChunkBytes));
    open = writer->Write(message);
    if (open && progress) progress(at + message.chunk().size(), mesh.bytes().size());
  }
  // A write fails when the server has answered already, for better or worse: the status says which.
  if (open) writer->WritesDone();
  one.check(writer->Finish());
  return response;
}

std::vector<v1::ProbePointsResponse> Client::probe(const std::string& mesh_id, const v1::Placement& placement,
                                                   const std::vector<double>& points_mm, const CallOptions& call) {
  return with_retries(call, [&] {
    Call one(call);
    std::vector<v1::ProbePointsResponse> answers;
    const auto stream = stub_->ProbePoints(&one.context());
    v1::ProbePointsRequest batch;
    batch.set_mesh_id(mesh_id);
    *batch.mutable_placement() = placement;
    bool open = true;
    for (std::size_t at = 0; open && at < points_mm.size(); at += 3 * kProbeBatchPoints) {
      const std::size_t end = std::min(points_mm.size(), at + 3 * kProbeBatchPoints);
      batch.mutable_points_mm()->Assign(points_mm.begin() + static_cast<std::ptrdiff_t>(at),
                                        points_mm.begin() + static_cast<std::ptrdiff_t>(end));
      open = stream->Write(batch) && stream->Read(&answers.emplace_back());
      if (open) check_answer(answers.back(), batch.points_mm_size() / 3);
      batch.clear_placement();
    }
    if (open) stream->WritesDone();
    one.check(stream->Finish());
    if (!open) {
      throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt, "the server left points unanswered");
    }
    return answers;
  });
}

}  // namespace ccslice::client
