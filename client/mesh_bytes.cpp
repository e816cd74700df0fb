// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/mesh_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <openssl/sha.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

constexpr std::string_view kPrefix = "sha256:";

std::string serialize_deterministically(const google::protobuf::Message& mesh, const char* what = "the control mesh") {
  constexpr std::size_t kSlack = 64;  // The stream doubles the string when less than 16 bytes are left.
  std::string bytes;
  bytes.reserve(mesh.ByteSizeLong() + kSlack);
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  const bool complete = mesh.SerializeToCodedStream(&coded);
  coded.Trim();
  if (!complete) {
    throw ClientError(grpc::StatusCode::INVALID_ARGUMENT, local_reason::kNotControlMesh,
                      std::string(what) + " is too large to be serialized");
  }
  return bytes;
}

}  // namespace

std::string sha256_of(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string mesh_id_of(std::string_view bytes) { return std::string(kPrefix) + sha256_of(bytes); }

bool is_mesh_id(std::string_view text) {
  return text.size() == kPrefix.size() + 2 * SHA256_DIGEST_LENGTH && text.substr(0, kPrefix.size()) == kPrefix &&
         std::all_of(text.begin() + kPrefix.size(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

MeshBytes::MeshBytes(const v1::ControlMesh& mesh)
    : bytes_(serialize_deterministically(mesh)), id_(mesh_id_of(bytes_)) {}

MeshBytes MeshBytes::from_serialized(std::string bytes) {
  v1::ControlMesh mesh;
  if (!mesh.ParseFromString(bytes) || mesh.cell_kinds().empty()) {
    throw ClientError(grpc::StatusCode::INVALID_ARGUMENT, local_reason::kNotControlMesh,
                      "the bytes are no serialized ccslice.v1.ControlMesh with cells");
  }
  MeshBytes result;
  result.id_ = mesh_id_of(bytes);
  result.bytes_ = std::move(bytes);
  return result;
}

MeshBytes MeshBytes::of_volume(v1::Volume volume, std::string_view samples) {
  constexpr int kFast = 1;
  std::string& packed = *volume.mutable_samples_zstd();
  packed.resize(ZSTD_compressBound(samples.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), samples.data(), samples.size(), kFast);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();
  packed.resize(size);
  MeshBytes result;
  result.bytes_ = serialize_deterministically(volume, "the volume");
  result.id_ = mesh_id_of(result.bytes_);
  return result;
}

}  // namespace ccslice::client
