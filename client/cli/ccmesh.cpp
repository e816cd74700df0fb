// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/ccmesh.h"

#include <google/protobuf/util/json_util.h>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

v1::ControlMesh parse_json(const std::string& text) {
  v1::ControlMesh mesh;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &mesh);
  if (!status.ok()) {
    throw Error(ErrorCode::kFileSyntax, "not the JSON of a ccslice.v1.ControlMesh: " + std::string(status.message()));
  }
  if (mesh.cell_kinds().empty()) throw Error(ErrorCode::kMeshEmpty, "the JSON has no cellKinds", "cell_kinds");
  return mesh;
}

}  // namespace

bool is_json(std::string_view bytes) {
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && bytes[first] == '{';
}

v1::ControlMesh parse_ccmesh(const std::string& bytes) {
  v1::ControlMesh mesh;
  if (is_json(bytes)) return parse_json(bytes);
  if (!mesh.ParseFromString(bytes) || mesh.cell_kinds().empty()) {
    throw Error(ErrorCode::kFileUnsupported,
                "neither a MEDIT mesh (first word 'MeshVersionFormatted'), nor a legacy VTK file (first line '# vtk "
                "DataFile Version ...'), nor an OpenVolumeMesh file (first line 'OVM ASCII'), nor a "
                "ccslice.v1.ControlMesh, be it serialized (.ccmesh) or JSON");
  }
  return mesh;
}

std::string to_json(const v1::ControlMesh& mesh) {
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(mesh, &text);
  if (!status.ok()) throw Error(ErrorCode::kInternal, "JSON: " + std::string(status.message()));
  return text;
}

}  // namespace ccslice::cli
