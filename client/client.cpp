// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/client.h"

#include <set>
#include <utility>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client_error.h"
#include "client/endpoints.h"
#include "client/preparation_watch.h"

namespace ccslice::client {
namespace {

constexpr std::size_t kUploadChunkBytes = 512 << 10;

}  // namespace

Client::Client(const ClientOptions& options)
    : retry_(options.retry), endpoints_(std::make_unique<Endpoints>(options)) {}

Client::Client(std::shared_ptr<grpc::ChannelInterface> channel, RetryPolicy retry)
    : retry_(retry), endpoints_(std::make_unique<Endpoints>(std::move(channel))) {}

Client::~Client() = default;

std::shared_ptr<const Endpoint> Client::endpoint_of(const std::string& mesh_id, const CallOptions& call) {
  const EndpointList endpoints = endpoints_->in_order(mesh_id);
  if (endpoints.size() == 1) return endpoints.front();
  CallOptions once = call;
  once.retry = RetryPolicy{.max_attempts = 1};
  Attempts attempts(*once.retry, once, *endpoints_, {mesh_id});
  int reuploads = 0;
  try {
    // GetMesh, so that a server that hasn't met the mesh gets it.
    with_retries(once, attempts, reuploads, [&](const Endpoint& at) { get_mesh(at, mesh_id, once); });
    return attempts.endpoint();
  } catch (const ClientError&) {
    return endpoints.front();  // Its own error says more.
  }
}

std::shared_ptr<const MeshBytes> Client::remembered(const std::string& mesh_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = meshes_.find(mesh_id);
  return found == meshes_.end() ? nullptr : found->second;
}

v1::GetServerInfoResponse Client::server_info(const CallOptions& call) {
  return with_retries(call, {}, [&](const Endpoint& at) {
    Call one(call, at, "");
    v1::GetServerInfoResponse response;
    one.check(at.stub->GetServerInfo(&one.context(), {}, &response));
    return response;
  });
}

v1::MeshSummary Client::get_mesh(const Endpoint& endpoint, const std::string& mesh_id, const CallOptions& call,
                                 const PreparationReport& preparation) {
  Call one(call, endpoint, mesh_id);
  v1::GetMeshRequest request;
  request.set_mesh_id(mesh_id);
  v1::GetMeshResponse response;
  PreparationWatch watch(endpoint, mesh_id, preparation, one.context());
  const grpc::Status status = endpoint.stub->GetMesh(&one.context(), request, &response);
  watch.stop();
  one.check(status);
  return response.mesh();
}

v1::MeshSummary Client::mesh_summary(const std::string& mesh_id, const CallOptions& call,
                                     const PreparationReport& preparation) {
  return with_retries(call, {mesh_id}, [&](const Endpoint& at) { return get_mesh(at, mesh_id, call, preparation); });
}

std::vector<v1::MeshSummary> Client::list_meshes(const CallOptions& call) {
  constexpr std::uint64_t kMostBytes = 256 << 20;  // Of summaries, which take some 500 bytes each.
  std::uint64_t bytes = 0;
  std::vector<v1::MeshSummary> meshes;
  v1::ListMeshesRequest request;
  do {
    const v1::ListMeshesResponse page = with_retries(call, {}, [&](const Endpoint& at) {
      Call one(call, at, "");
      v1::ListMeshesResponse response;
      one.check(at.stub->ListMeshes(&one.context(), request, &response));
      return response;
    });
    require_answer(page.meshes_size() > 0 || page.next_page_token().empty(), "a page of meshes without any");
    bytes += page.ByteSizeLong();
    require_answer(bytes <= kMostBytes, "a list of more meshes than a server can hold");
    meshes.insert(meshes.end(), page.meshes().begin(), page.meshes().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return meshes;
}

bool Client::delete_mesh(const std::string& mesh_id, const CallOptions& call) {
  bool deleted = false;
  for (std::size_t turn = endpoints_->in_order(mesh_id).size(); turn-- > 0;) {
    // Of each server in turn: one that can't be reached leaves its turn to another.
    Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, {mesh_id}, turn);
    int reuploads = 0;
    deleted |= with_retries(call, attempts, reuploads, [&](const Endpoint& at) {
      Call one(call, at, mesh_id);
      v1::DeleteMeshRequest request;
      request.set_mesh_id(mesh_id);
      v1::DeleteMeshResponse response;
      one.check(at.stub->DeleteMesh(&one.context(), request, &response));
      return response.deleted();
    });
  }
  return deleted;
}

v1::PlanSlicesResponse Client::plan(const v1::PlanSlicesRequest& request, const CallOptions& call) {
  const std::string mesh_id = mesh_id_of(request.job());
  return with_retries(call, mesh_ids_of(request.job()), [&](const Endpoint& at) {
    Call one(call, at, mesh_id);
    v1::PlanSlicesResponse response;
    one.check(at.stub->PlanSlices(&one.context(), request, &response));
    return response;
  });
}

void Client::upload_missing(const Endpoint& endpoint, const std::vector<std::string>& mesh_ids,
                            const CallOptions& call) {
  std::vector<std::string> missing = mesh_ids;
  if (mesh_ids.size() > 1) {
    Call one(call, endpoint, mesh_ids.front());
    v1::FindMissingMeshesRequest request;
    for (const std::string& id : std::set<std::string>(mesh_ids.begin(), mesh_ids.end())) request.add_mesh_ids(id);
    v1::FindMissingMeshesResponse response;
    one.check(endpoint.stub->FindMissingMeshes(&one.context(), request, &response));
    missing.assign(response.missing_mesh_ids().begin(), response.missing_mesh_ids().end());
  }
  for (const std::string& id : missing) {
    if (const auto mesh = remembered(id)) upload_once(endpoint, *mesh, mesh_ids.front(), {}, call);
  }
}

UploadOutcome Client::ensure_uploaded(std::shared_ptr<const MeshBytes> mesh, const UploadProgress& progress,
                                      const CallOptions& call, const PreparationReport& preparation,
                                      const std::string& chosen_by) {
  {
    const std::lock_guard lock(mutex_);
    meshes_[mesh->id()] = mesh;
  }
  std::vector<std::string> ids = {mesh->id()};
  if (!chosen_by.empty() && chosen_by != mesh->id()) ids.insert(ids.begin(), chosen_by);
  const bool missing = with_retries(call, ids, [&](const Endpoint& at) {
    Call one(call, at, ids.front());
    v1::FindMissingMeshesRequest request;
    request.add_mesh_ids(mesh->id());
    v1::FindMissingMeshesResponse response;
    one.check(at.stub->FindMissingMeshes(&one.context(), request, &response));
    return response.missing_mesh_ids_size() > 0;
  });
  if (!missing && ids.size() == 1) return {mesh_summary(mesh->id(), call, preparation), true};
  if (!missing) return {{}, true};
  v1::UploadMeshResponse response = with_retries(
      call, ids, [&](const Endpoint& at) { return upload_once(at, *mesh, ids.front(), progress, call, preparation); });
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

v1::UploadMeshResponse Client::upload_once(const Endpoint& endpoint, const MeshBytes& mesh,
                                           const std::string& chosen_by, const UploadProgress& progress,
                                           const CallOptions& call, const PreparationReport& preparation) {
  Call one(call, endpoint, chosen_by);
  v1::UploadMeshResponse response;
  const auto writer = endpoint.stub->UploadMesh(&one.context(), &response);
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
  PreparationWatch watch(endpoint, mesh.id(), preparation, one.context());
  const grpc::Status status = writer->Finish();
  watch.stop();
  if (status.error_code() == grpc::StatusCode::CANCELLED) {
    // Where the server holds the mesh it answers before it has read all, and some proxies make a reset of that.
    *response.mutable_mesh() = get_mesh(endpoint, mesh.id(), call);
    response.set_already_cached(true);
    return response;
  }
  one.check(status);
  return response;
}

}  // namespace ccslice::client
