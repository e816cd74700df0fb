// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls of every method with messages of arbitrary bytes, to a real server that holds a small mesh and slices small
// layers only: each request through its parser and its converter, and what it asks for. They end with an answer or an
// error that has a reason, and soon. What the parser makes of a message takes no more than was known before.
//
// Byte 0: bits 0-3 are the method, bit 7 says that mesh_id stays as it is; otherwise it becomes the id of the mesh that
// the server holds. Then come the messages.

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/sync_stream.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/meshes/mesh_convert.h"
#include "server/rpc/calls/parsed_size.h"
#include "server/service/base/logging.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/server/test_server.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace {

using namespace ccslice;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

constexpr std::chrono::seconds kLongestCall(20);

/// Five sectors round an edge, in two cell regions and with two channels.
v1::ControlMesh make_mesh() {
  ControlMesh mesh = oracle::fan_mesh(5, 1, 1);
  oracle::add_random_channels(mesh, 2, 1);
  return cli::to_proto(oracle::with_regions(mesh, 2, [](const Vec3& center) { return center.x() < 0 ? 0 : 1; }));
}

class SmallServer {
 public:
  SmallServer() {
    server::set_up_logging(server::LogLevel::kError, server::LogFormat::kText);
    SliceLimits& limits = state().slice_limits;
    limits.max_columns = limits.max_rows = 64;
    limits.max_layers = 16;
    limits.max_layer_bytes = 1 << 20;
    limits.min_contour_tolerance_mm = 1e-4;
    state().max_triangles = 10'000;
  }

  const std::string& mesh_id() {
    if (mesh_id_.empty() || !state().cache.find(mesh_id_)) mesh_id_ = server_.upload_good(make_mesh());
    return mesh_id_;
  }

  /// Reads to the end.
  grpc::Status call(const MethodDescriptor& method, const std::vector<std::string>& messages) {
    // To a server all methods look like streams.
    const std::string path = "/" + method.service()->full_name() + "/" + method.name();
    const grpc::internal::RpcMethod rpc(path.c_str(), grpc::internal::RpcMethod::BIDI_STREAMING);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kLongestCall);
    const std::unique_ptr<grpc::ClientReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>> stream(
        grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, grpc::ByteBuffer>::Create(server_.channel().get(),
                                                                                              rpc, &context));
    for (const std::string& message : messages) {
      const grpc::Slice slice(message);
      if (!stream->Write(grpc::ByteBuffer(&slice, 1))) break;
    }
    stream->WritesDone();
    grpc::ByteBuffer answer;
    while (stream->Read(&answer)) continue;
    return stream->Finish();
  }

 private:
  server::ServiceState& state() { return server_.server().state(); }

  server::TestServer server_;
  std::string mesh_id_;
};

/// Expects the bound of what the parser makes of the bytes to be one, and to refuse none that it takes.
void check_parsed_size(const std::string& bytes, const MethodDescriptor& method) {
  auto& factory = *google::protobuf::MessageFactory::generated_factory();
  const std::unique_ptr<Message> message(factory.GetPrototype(method.input_type())->New());
  if (!message->ParseFromString(bytes)) return;
  const grpc::Slice slice(bytes);
  constexpr std::size_t kNoLimit = 1u << 30;
  const auto bound = server::ParsedSize(*method.input_type()).at_most(grpc::ByteBuffer(&slice, 1), kNoLimit);
  if (bound && *bound >= message->SpaceUsedLong()) return;
  std::fprintf(stderr, "a %s takes more than was said\n", method.input_type()->name().c_str());
  std::abort();
}

/// Gives the message the id, where it names a mesh itself, and the first part of its job, or of its layer's job.
void set_mesh_id(Message& message, const std::string& mesh_id) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (const auto* const field = type.FindFieldByName("mesh_id")) reflection.SetString(&message, field, mesh_id);
  for (const char* const name : {"job", "plane", "layer"}) {
    const auto* const field = type.FindFieldByName(name);
    const bool holds_message = field != nullptr && field->message_type() != nullptr;
    if (!holds_message || !reflection.HasField(message, field)) continue;
    set_mesh_id(*reflection.MutableMessage(&message, field), mesh_id);
  }
  const auto* const parts = type.FindFieldByName("parts");
  if (parts == nullptr || reflection.FieldSize(message, parts) == 0) return;
  set_mesh_id(*reflection.MutableRepeatedMessage(&message, parts, 0), mesh_id);
}

/// The same message for the mesh with this id, if it is one that names a mesh.
std::string with_mesh_id(const std::string& bytes, const MethodDescriptor& method, const std::string& mesh_id) {
  auto& factory = *google::protobuf::MessageFactory::generated_factory();
  const std::unique_ptr<Message> message(factory.GetPrototype(method.input_type())->New());
  if (!message->ParseFromString(bytes)) return bytes;
  set_mesh_id(*message, mesh_id);
  return message->SerializeAsString();
}

void check(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::OK: return;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::UNKNOWN: break;
    default:
      if (!server::failure_of(status).reason.empty()) return;
  }
  std::fprintf(stderr, "%d: %s\n", status.error_code(), status.error_message().c_str());
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static SmallServer server;
  static const ServiceDescriptor& service =
      *google::protobuf::DescriptorPool::generated_pool()->FindServiceByName("ccslice.v1.SlicerService");
  fuzz::ByteReader bytes(data, size);
  const std::uint8_t head = bytes.next();
  const MethodDescriptor& method = *service.method((head & 15) % service.method_count());
  const bool own_id = head & 128;
  const std::string& mesh_id = server.mesh_id();
  std::vector<std::string> messages;
  do {
    const std::string message = bytes.message();
    check_parsed_size(message, method);
    messages.push_back(own_id ? message : with_mesh_id(message, method, mesh_id));
  } while (!bytes.at_end());
  check(server.call(method, messages));
  return 0;
}
