// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/raw_request.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <map>
#include <optional>
#include <string>

#include "ccslice/v1/service.pb.h"
#include "core/base/error.h"
#include "server/rpc/calls/parsed_size.h"
#include "server/service/base/limits.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::Message;

ServiceError too_large(const google::protobuf::Descriptor& type, const std::string& what, std::size_t most) {
  return ServiceError(ServiceErrorCode::kBatchTooLarge,
                      what + ", and a " + type.name() + " may have " + std::to_string(most) + ": send less at a time");
}

/// A printing job has maps for its cell regions, with tables of their own. Chunks of uploads have gRPC's limit.
std::size_t most_bytes(const google::protobuf::Descriptor& type) {
  if (&type == v1::UploadMeshRequest::descriptor()) return kMaxMessageBytes;
  const bool job = &type == v1::SliceRangeRequest::descriptor() || &type == v1::PlanSlicesRequest::descriptor();
  return job ? kMaxJobRequestBytes : kMaxRequestBytes;
}

/// Jobs, points and previews. Others are parsed by gRPC's own threads, which have no time for many small parts.
bool is_for_workers(const google::protobuf::Descriptor& type) {
  for (const google::protobuf::Descriptor* work :
       {v1::SliceRangeRequest::descriptor(), v1::PlanSlicesRequest::descriptor(), v1::ProbePointsRequest::descriptor(),
        v1::EvaluatePointsRequest::descriptor(), v1::TessellateBoundaryRequest::descriptor(),
        v1::PreviewRequest::descriptor()}) {
    if (&type == work) return true;
  }
  return false;
}

/// What a message may take once it is parsed. A chunk of an upload stays as large as it is; ids take twice as much.
std::size_t most_parsed_bytes(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  if (&type == v1::UploadMeshRequest::descriptor()) return kMaxParsedBytes + bytes.Length();
  return is_for_workers(type) ? kMaxParsedBytes : kMaxShortParsedBytes + 2 * bytes.Length();
}

std::map<const google::protobuf::Descriptor*, ParsedSize> sizes_of_requests() {
  std::map<const google::protobuf::Descriptor*, ParsedSize> sizes;
  const auto& service = *DescriptorPool::generated_pool()->FindServiceByName("ccslice.v1.SlicerService");
  for (int i = 0; i < service.method_count(); ++i) {
    const google::protobuf::Descriptor& type = *service.method(i)->input_type();
    sizes.try_emplace(&type, type);
  }
  return sizes;
}

ServiceError not_a_request(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  return ServiceError(ServiceErrorCode::kRequestMalformed, "a message of " + std::to_string(bytes.Length()) +
                                                               " bytes isn't a " + type.name() +
                                                               " of ccslice.v1: send what protobuf makes of one");
}

void require_parsed_size(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  static const auto kSizes = sizes_of_requests();
  const std::size_t most = most_parsed_bytes(bytes, type);
  const std::optional<std::size_t> parsed_bytes = kSizes.at(&type).at_most(bytes, most);
  if (!parsed_bytes) throw not_a_request(bytes, type);
  if (*parsed_bytes > most) {
    throw too_large(type, "unpacked, the message takes more than " + std::to_string(most) + " bytes", most);
  }
}

}  // namespace

void require_request_size(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  if (!bytes.Valid()) throw Error(ErrorCode::kCancelled, "the call ended before its request had come");
  const std::size_t most = most_bytes(type);
  if (bytes.Length() <= most) return;
  throw too_large(type, "the message has " + std::to_string(bytes.Length()) + " bytes", most);
}

void parse_request(const grpc::ByteBuffer& bytes, Message& request) {
  const google::protobuf::Descriptor& type = *request.GetDescriptor();
  require_request_size(bytes, type);
  require_parsed_size(bytes, type);
  grpc::ByteBuffer same(bytes);  // The reader wants one that it may change.
  grpc::ProtoBufferReader reader(&same);
  if (!reader.status().ok() || !request.ParseFromZeroCopyStream(&reader)) throw not_a_request(bytes, type);
}

}  // namespace ccslice::server
