// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Mesh files of any kind from arbitrary bytes, and what is none: a mesh or an Error, nothing else, and never more
// memory than the limits. Here the kind is told from the bytes; read_format.cpp has the readers one by one.

#include <cstdint>
#include <string_view>

#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ccslice::MeshLimits limits;
  limits.max_vertices = 10'000;
  limits.max_cells = 10'000;
  try {
    ccslice::MeshFile file = ccslice::read_mesh({reinterpret_cast<const char*>(data), size}, limits);
    ccslice::validate(file.mesh, limits);
  } catch (const ccslice::Error&) {
  }
  return 0;
}
