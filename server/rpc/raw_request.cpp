// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/raw_request.h"

#include <grpcpp/support/proto_buffer_reader.h>

#include <memory>
#include <mutex>
#include <string>

#include "ccslice/v1/service.pb.h"
#include "core/base/error.h"
#include "server/service/limits.h"
#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

using google::protobuf::Message;

ServiceError too_large(const google::protobuf::Descriptor& type, const std::string& what, std::size_t bytes,
                       std::size_t most) {
  return ServiceError(ServiceErrorCode::kBatchTooLarge, what + " " + std::to_string(bytes) + " bytes, and a " +
                                                            type.name() + " may have " + std::to_string(most) +
                                                            ": send less at a time");
}

/// A printing job has maps for its cell regions, with tables of their own. Chunks of uploads have gRPC's limit.
std::size_t most_bytes(const google::protobuf::Descriptor& type) {
  if (&type == v1::UploadMeshRequest::descriptor()) return kMaxMessageBytes;
  const bool job = &type == v1::SliceRangeRequest::descriptor() || &type == v1::PlanSlicesRequest::descriptor();
  return job ? kMaxJobRequestBytes : kMaxRequestBytes;
}

void parse(const grpc::ByteBuffer& bytes, Message& request) {
  grpc::ByteBuffer same(bytes);  // The reader wants one that it may change.
  grpc::ProtoBufferReader reader(&same);
  if (reader.status().ok() && request.ParseFromZeroCopyStream(&reader)) return;
  throw ServiceError(ServiceErrorCode::kRequestMalformed, "a message of " + std::to_string(bytes.Length()) +
                                                              " bytes isn't a " + request.GetDescriptor()->name() +
                                                              " of ccslice.v1: send what protobuf makes of one");
}

}  // namespace

void require_request_size(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  if (!bytes.Valid()) throw Error(ErrorCode::kCancelled, "the call ended before its request had come");
  const std::size_t most = most_bytes(type);
  if (bytes.Length() > most) throw too_large(type, "the message has", bytes.Length(), most);
}

/// Large ones are parsed one after the other: nobody knows before what will come of one.
void parse_request(const grpc::ByteBuffer& bytes, Message& request) {
  const google::protobuf::Descriptor& type = *request.GetDescriptor();
  require_request_size(bytes, type);
  if (bytes.Length() <= kSmallRequestBytes || &type == v1::UploadMeshRequest::descriptor()) {
    return parse(bytes, request);
  }
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const std::unique_ptr<Message> parsed(request.New());
  parse(bytes, *parsed);
  const std::size_t memory_bytes = parsed->SpaceUsedLong();
  if (memory_bytes > kMaxParsedBytes)
    throw too_large(type, "unpacked, the message takes", memory_bytes, kMaxParsedBytes);
  request.GetReflection()->Swap(&request, parsed.get());
}

}  // namespace ccslice::server
