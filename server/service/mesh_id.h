// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The id of a control mesh: "sha256:" and the 64 lower-case hexadecimal digits of the SHA-256 of its serialized bytes.

#pragma once

#include <string>
#include <string_view>

namespace ccslice::server {

bool is_mesh_id(std::string_view text) noexcept;

/// Throws ServiceError{kMeshIdInvalid} naming `field` unless is_mesh_id(text).
void require_mesh_id(std::string_view text, const std::string& field);

std::string mesh_id_of(std::string_view bytes);

}  // namespace ccslice::server
