// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_id.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kPrefix = "sha256:";
constexpr std::size_t kDigestBytes = 32;

void require(bool worked) {
  if (!worked) throw std::runtime_error("libcrypto can't compute SHA-256");
}

bool is_lower_hex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

}  // namespace

bool is_mesh_id(std::string_view text) noexcept {
  return text.size() == kPrefix.size() + 2 * kDigestBytes && text.starts_with(kPrefix) &&
         std::all_of(text.begin() + kPrefix.size(), text.end(), is_lower_hex);
}

void require_mesh_id(std::string_view text, const std::string& field) {
  if (is_mesh_id(text)) return;
  throw ServiceError(ServiceErrorCode::kMeshIdInvalid,
                     field + (text.empty() ? std::string(" is empty") : " isn't a mesh id") +
                         ": give \"sha256:\" and the 64 lower-case hexadecimal digits of the serialized mesh's SHA-256",
                     field);
}

std::string mesh_id_of(std::string_view bytes) {
  MeshIdHasher hasher;
  hasher.add(bytes);
  return hasher.mesh_id();
}

void MeshIdHasher::FreeContext::operator()(evp_md_ctx_st* context) const noexcept { EVP_MD_CTX_free(context); }

MeshIdHasher::MeshIdHasher() : context_(EVP_MD_CTX_new()) {
  require(context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
}

void MeshIdHasher::add(std::string_view bytes) {
  require(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
}

std::string MeshIdHasher::mesh_id() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int digest_bytes = 0;
  require(EVP_DigestFinal_ex(context_.get(), digest.data(), &digest_bytes) == 1 && digest_bytes == kDigestBytes);
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string id(kPrefix);
  for (std::size_t i = 0; i < kDigestBytes; ++i) {
    id += kDigits[digest[i] >> 4];
    id += kDigits[digest[i] & 15];
  }
  return id;
}

}  // namespace ccslice::server
