// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A control mesh, or a volume, ready to be uploaded: its serialized bytes and the id that follows from them. The same
// mesh gives the same bytes each time, so servers that hold it are recognized.

#pragma once

#include <string>
#include <string_view>

#include "ccslice/v1/mesh.pb.h"
#include "ccslice/v1/volume.pb.h"

namespace ccslice::client {

class MeshBytes {
 public:
  explicit MeshBytes(const v1::ControlMesh& mesh);
  /// Bytes as they are, for example from a .ccmesh file. Throws ClientError (NOT_CONTROL_MESH) unless they parse.
  static MeshBytes from_serialized(std::string bytes);
  /// A volume of these samples, as Volume.samples_zstd says their order. `volume`: all but them. Throws ClientError
  /// (NOT_CONTROL_MESH) if they are too large to be sent.
  static MeshBytes of_volume(v1::Volume volume, std::string_view samples);

  const std::string& bytes() const noexcept { return bytes_; }
  /// "sha256:" and 64 hexadecimal digits.
  const std::string& id() const noexcept { return id_; }

 private:
  MeshBytes() = default;

  std::string bytes_;
  std::string id_;
};

/// SHA-256 in lower-case hexadecimal.
std::string sha256_of(std::string_view bytes);

/// "sha256:" and the digest of `bytes` in lower-case hexadecimal.
std::string mesh_id_of(std::string_view bytes);

/// Whether `text` has the form of a mesh id.
bool is_mesh_id(std::string_view text);

}  // namespace ccslice::client
