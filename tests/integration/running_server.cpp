// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/integration/running_server.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

std::vector<std::string> with_program(const std::vector<std::string>& options) {
  std::vector<std::string> command = {CCSLICED_BINARY};
  command.insert(command.end(), options.begin(), options.end());
  return command;
}

}  // namespace

RunningServer::RunningServer(const std::vector<std::string>& options) {
  std::vector<std::string> command = with_program(options);
  if (std::ranges::find(options, "--listen") == options.end())
    command.insert(command.end(), {"--listen", "127.0.0.1:0"});
  process_ = std::make_unique<client::Process>(command, folder_.path());
  const std::string marker = "serves on ";
  if (!logs(marker, 20s)) throw std::runtime_error("ccsliced doesn't serve: " + log());
  const std::string text = log();
  const std::size_t begin = text.find(marker) + marker.size();
  address_ = text.substr(begin, text.find(": ", begin) - begin);
  stub_ = v1::SlicerService::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
}

std::string RunningServer::log() const { return client::read_whole(folder_.path() / "stderr"); }

bool RunningServer::logs(const std::string& text, std::chrono::milliseconds limit) const {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    const std::string so_far = log();
    const std::size_t found = so_far.find(text);
    if (found != std::string::npos && so_far.find('\n', found) != std::string::npos) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

std::string RunningServer::upload(const v1::ControlMesh& mesh) {
  const std::string bytes = mesh.SerializeAsString();
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = stub_->UploadMesh(&context, &response);
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id(mesh_id_of(bytes));
  message.mutable_start()->set_size_bytes(bytes.size());
  writer->Write(message);
  message.set_chunk(bytes);
  writer->Write(message);
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  if (!status.ok()) throw std::runtime_error("upload: " + status.error_message());
  return response.mesh().mesh_id();
}

client::ProcessResult run_ccsliced(const std::vector<std::string>& options) {
  const client::TemporaryFolder folder;
  client::Process process(with_program(options), folder.path());
  return process.wait();
}

}  // namespace ccslice::server
