// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/mesh_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "core/base/error.h"
#include "core/mesh/channels.h"
#include "core/mesh/read_gmsh.h"
#include "core/mesh/read_medit.h"
#include "core/mesh/read_ovm.h"
#include "core/mesh/read_vtk.h"
#include "core/mesh/text_scanner.h"

namespace ccslice {

MeshFileKind mesh_file_kind(std::string_view bytes) {
  constexpr std::string_view kVtkMagic = "# vtk DataFile";
  if (equals_ignoring_case(bytes.substr(0, kVtkMagic.size()), kVtkMagic)) return MeshFileKind::kVtk;
  constexpr std::string_view kExodusMagics[] = {"\x89HDF\r\n", "CDF\x01", "CDF\x02", "CDF\x05"};
  if (std::ranges::any_of(kExodusMagics, [&](std::string_view magic) { return bytes.starts_with(magic); })) {
    return MeshFileKind::kExodus;
  }
  TextScanner scanner(bytes);
  const std::string_view word = scanner.peek();
  if (word == "$MeshFormat") return MeshFileKind::kGmsh;
  if (equals_ignoring_case(word, "MeshVersionFormatted")) return MeshFileKind::kMedit;
  const bool ovm = equals_ignoring_case(word, "OVM") || equals_ignoring_case(word.substr(0, 4), "OVMB");
  return ovm ? MeshFileKind::kOvm : MeshFileKind::kUnknown;
}

std::string read_file_bytes(const std::string& path, std::uint64_t max_bytes) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) {
    throw Error(ErrorCode::kFileUnreadable, path + " is a folder, not a file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::kFileUnreadable, "cannot open " + path + ": " + std::strerror(errno));
  std::string bytes;
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0) {
    bytes.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > max_bytes) {
      throw Error(ErrorCode::kMeshTooLarge, path + " has more than " + std::to_string(max_bytes) + " bytes");
    }
  }
  if (file.bad()) throw Error(ErrorCode::kFileUnreadable, "cannot read " + path + ": " + std::strerror(errno));
  return bytes;
}

namespace {

MeshFile read_whole(std::string_view bytes, const MeshLimits& limits) {
  switch (mesh_file_kind(bytes)) {
    case MeshFileKind::kGmsh: return read_gmsh(bytes, limits);
    case MeshFileKind::kMedit: return read_medit(bytes, limits);
    case MeshFileKind::kVtk: return read_vtk(bytes, limits);
    case MeshFileKind::kOvm: return read_ovm(bytes, limits);
    case MeshFileKind::kExodus:
      throw Error(ErrorCode::kFileUnsupported,
                  "a netCDF or HDF5 file, as Exodus is: convert it first, with 'meshio convert FILE part.vtk' (Debian: "
                  "meshio-tools)");
    case MeshFileKind::kUnknown: break;
  }
  throw Error(ErrorCode::kFileUnsupported,
              "neither a Gmsh file (first line '$MeshFormat'), nor a MEDIT mesh (first word 'MeshVersionFormatted'), "
              "nor a legacy VTK file (first line '# vtk DataFile Version ...'), nor an OpenVolumeMesh file (first line "
              "'OVM ASCII')");
}

void leave_out_unused_vertices(MeshFile& file) {
  ControlMesh& mesh = file.mesh;
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> kept(mesh.vertex_count(), kUnused);
  for (const std::uint32_t v : mesh.cell_vertices) {
    if (v < kept.size()) kept[v] = 0;
  }
  const auto unused = std::ranges::count(kept, kUnused);
  if (unused == 0) return;
  const std::size_t channels = mesh.channel_count();
  std::uint32_t next = 0;
  for (std::size_t v = 0; v < kept.size(); ++v) {
    if (kept[v] == kUnused) continue;
    mesh.positions[next] = mesh.positions[v];
    std::copy_n(mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(v * channels), channels,
                mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(next * channels));
    kept[v] = next++;
  }
  mesh.positions.resize(next);
  mesh.channel_values.resize(next * channels);
  for (std::uint32_t& v : mesh.cell_vertices) v = v < kept.size() ? kept[v] : v;
  file.warnings.push_back(std::to_string(unused) +
                          " vertices that no cell uses left out; vertex ids, and lists by vertex, count the others");
}

void leave_out_overlong_names(MeshFile& file, const MeshLimits& limits) {
  ControlMesh& mesh = file.mesh;
  const auto fits = [&](const std::string& name) { return name.size() <= limits.max_channel_name_bytes; };
  if (std::ranges::all_of(mesh.channel_names, fits)) return;
  std::vector<NamedChannel> fitting;
  for (std::size_t c = 0; c < mesh.channel_count(); ++c) {
    if (!fits(mesh.channel_names[c])) {
      file.warnings.push_back("channel '" + printable(mesh.channel_names[c]) + "' left out: its name has more than " +
                              std::to_string(limits.max_channel_name_bytes) + " bytes");
      continue;
    }
    NamedChannel& channel = fitting.emplace_back(NamedChannel{mesh.channel_names[c], {}});
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      channel.values.push_back(mesh.channel_values[v * mesh.channel_count() + c]);
    }
  }
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  append_channels(fitting, mesh);
}

}  // namespace

MeshFile read_mesh(std::string_view bytes, const MeshLimits& limits) {
  MeshFile file = read_whole(bytes, limits);
  if (file.mesh.cell_count() > 0) leave_out_unused_vertices(file);
  leave_out_overlong_names(file, limits);
  return file;
}

void check_cell_vertices(const ControlMesh& mesh) {
  constexpr std::size_t kMostNamed = 5;
  std::vector<std::int64_t> cells;
  std::size_t corner = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count() && cells.size() < kMostNamed; ++cell) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[cell]));
    const auto begin = mesh.cell_vertices.begin() + static_cast<std::ptrdiff_t>(corner);
    const bool bad = std::any_of(begin, begin + static_cast<std::ptrdiff_t>(corners),
                                 [&](std::uint32_t vertex) { return vertex >= mesh.vertex_count(); });
    if (bad) cells.push_back(static_cast<std::int64_t>(cell));
    corner += corners;
  }
  if (cells.empty()) return;
  std::string named;
  for (const std::int64_t cell : cells) named += (named.empty() ? "" : ", ") + std::to_string(cell);
  throw Error(ErrorCode::kMeshIndexOutOfRange,
              "cells " + named + " (from 0) use vertices that the file doesn't have; it has " +
                  std::to_string(mesh.vertex_count()),
              "cells", cells);
}

}  // namespace ccslice
