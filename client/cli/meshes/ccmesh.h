// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of the contract's own control mesh: .ccmesh, which are a serialized ccslice.v1.ControlMesh, and .json, the same
// in protobuf's JSON mapping.

#pragma once

#include <string>
#include <string_view>

#include "ccslice/v1/mesh.pb.h"

namespace ccslice::cli {

/// Whether the bytes look like JSON: a '{' comes first.
bool is_json(std::string_view bytes);

/// Reads a control mesh, serialized or as JSON. Throws Error{kFileUnsupported} for bytes that are neither, and
/// {kFileSyntax, kMeshNonFinite}, with line and column, for JSON that isn't that of a control mesh. Fields go by either
/// of their names, and each at most once.
v1::ControlMesh parse_ccmesh(const std::string& bytes);

/// The mesh as JSON on one line, without spaces. Every number reads back as the same one, -0.0 included, whoever reads
/// it.
std::string to_json(const v1::ControlMesh& mesh);

}  // namespace ccslice::cli
