// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The id of a control mesh: "sha256:" and the 64 lower-case hexadecimal digits of the SHA-256 of its serialized bytes.

#pragma once

#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // OpenSSL's EVP_MD_CTX.

namespace ccslice::server {

bool is_mesh_id(std::string_view text) noexcept;

/// Throws ServiceError{kMeshIdInvalid} naming `field` unless is_mesh_id(text).
void require_mesh_id(std::string_view text, const std::string& field);

std::string mesh_id_of(std::string_view bytes);

/// Computes the id of bytes that come piece by piece.
class MeshIdHasher {
 public:
  MeshIdHasher();
  void add(std::string_view bytes);
  /// The id of all bytes that were added. REQUIRES: called once, nothing added later.
  std::string mesh_id();

 private:
  struct FreeContext {
    void operator()(evp_md_ctx_st* context) const noexcept;
  };
  std::unique_ptr<evp_md_ctx_st, FreeContext> context_;
};

}  // namespace ccslice::server
