// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The contract's control meshes from arbitrary bytes: a mesh or an Error, nothing else. Serialized or as JSON, as
// CCSLICE_READS_JSON says.

#include <cstdint>
#include <string>

#include "client/cli/meshes/ccmesh.h"
#include "client/cli/meshes/mesh_convert.h"
#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "tests/fuzz/quiet_protobuf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (ccslice::cli::is_json(bytes) != CCSLICE_READS_JSON) return 0;
  try {
    ccslice::ControlMesh mesh = ccslice::cli::from_proto(ccslice::cli::parse_ccmesh(bytes));
    ccslice::validate(mesh);
  } catch (const ccslice::Error&) {
  }
  return 0;
}
