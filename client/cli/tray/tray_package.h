// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A 3MF package with objects on plates, as PrusaSlicer, OrcaSlicer, Bambu Studio and others save them, read as a list
// of meshes in their places. Facts come from
// - the 3MF Core Specification 1.4 [3MF]: units (3.4), matrices of twelve numbers for row vectors (3.3), build items
//   (3.4.3.1), components (4.2), the part that a package starts with (2.1);
// - the 3MF Production Extension 1.2 [3MF-P]: the path of items and components (3.1);
// - PrusaSlicer's src/libslic3r/Format/3mf.cpp [Prusa]: the first copy of an object has the mesh, each further one is
//   an object of one component; `printable` of items; names and volumes in Metadata/Slic3r_PE_model.config;
// - Bambu Studio's src/libslic3r/Format/bbs_3mf.cpp [Bambu], which OrcaSlicer goes by, too: meshes in parts of their
//   own, components with p:path, one item for each copy, names and plates in Metadata/model_settings.config.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

/// Points of a mesh of the file, mm, in a frame of the file's own.
using TrayPoints = std::shared_ptr<const std::vector<Vec3>>;

/// A mesh in one place: what is left of a build item and the components that lead to it.
struct TrayInstance {
  TrayPoints points;
  Placement placement = Placement::Identity();  // World mm.
  std::string name;                             // Empty if the file has none.
  std::string label;                            // For messages: "object 3 'ring' (copy 2)".
  bool printable = true;
  /// Says what it is if it isn't to be printed: "modifier_part", "support". Empty otherwise.
  std::string aid;
  /// The number of its plate; 0 if the file has plates, and it is on none of them.
  std::optional<std::uint32_t> plate;
};

struct TrayPlate {
  std::uint32_t number = 0;  // From 1 on.
  std::string name;          // May be empty.
};

struct TrayPackage {
  std::vector<TrayInstance> instances;  // In the file's order.
  std::vector<TrayPlate> plates;        // Empty: the file says nothing of plates.
};

/// Reads one. Throws Error{kFileUnreadable, kFileSyntax, kFileUnsupported, kMeshTooLarge}, which names the file, the
/// object and the remedy. `max_bytes`: of the file, and of all that is unpacked.
TrayPackage read_tray_package(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Most meshes in places that are read of one file: many more than a job takes.
inline constexpr std::size_t kMostTrayInstances = 65'536;

}  // namespace ccslice::cli
