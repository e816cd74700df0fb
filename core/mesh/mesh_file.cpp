// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/mesh_file.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/utf8.h"
#include "core/mesh/byte_order.h"
#include "core/mesh/read_abaqus.h"
#include "core/mesh/read_exodus.h"
#include "core/mesh/read_gmsh.h"
#include "core/mesh/read_medit.h"
#include "core/mesh/read_ovm.h"
#include "core/mesh/read_vtk.h"
#include "core/mesh/read_vtu.h"
#include "core/mesh/text_scanner.h"

namespace ccslice {

namespace {

bool is_abaqus_keyword_or_comment(std::string_view word) {
  if (word.size() < 2 || word[0] != '*') return false;
  return word[1] == '*' || (word[1] >= 'a' && word[1] <= 'z') || (word[1] >= 'A' && word[1] <= 'Z');
}

MeshFile read_kind(MeshFileKind kind, std::string_view bytes, const MeshLimits& limits, const std::string& path) {
  switch (kind) {
    case MeshFileKind::kGmsh: return read_gmsh(bytes, limits);
    case MeshFileKind::kMedit: return read_medit(bytes, limits);
    case MeshFileKind::kVtk: return read_vtk(bytes, limits);
    case MeshFileKind::kVtu: return read_vtu(bytes, limits);
    case MeshFileKind::kOvm: return read_ovm(bytes, limits);
    case MeshFileKind::kAbaqus: return read_abaqus(bytes, limits, path);
    case MeshFileKind::kExodus: return read_exodus(bytes, limits);
    case MeshFileKind::kUnknown: break;
  }
  throw Error(ErrorCode::kFileUnsupported, describe_unread(bytes).text);
}

/// The contract's texts are UTF-8. What older programs write mostly is ISO 8859-1.
void recode_names(MeshFile& file) {
  std::size_t recoded = 0;
  const auto recode = [&](std::string& name) {
    if (is_utf8(name)) return;
    name = utf8_of_latin1(name);
    ++recoded;
  };
  for (std::string& name : file.mesh.channel_names) recode(name);
  for (CellNumbers& numbers : file.cell_numbers) {
    recode(numbers.name);
    for (auto& number_name : numbers.number_names) recode(number_name.second);
  }
  for (auto* sets : {&file.cell_sets, &file.cell_materials}) {
    for (CellSet& set : *sets) recode(set.name);
  }
  if (recoded > 0) {
    file.warnings.push_back("names that aren't in UTF-8 are taken to be in ISO 8859-1 (Latin-1): " +
                            std::to_string(recoded));
  }
}

/// An array 'a' of two components and another one 'a.1' come to one name, which could mean the first only.
void leave_out_numbers_with_known_names(MeshFile& file) {
  std::set<std::string> known;
  std::erase_if(file.cell_numbers, [&](const CellNumbers& numbers) {
    if (known.insert(numbers.name).second) return false;
    file.warnings.push_back("cell data '" + echoed(numbers.name) +
                            "' left out: others before are called so, too; rename one of the arrays");
    return true;
  });
}

/// A header of 80 bytes, the number of triangles, and 50 bytes for each, its unit normal or zeros first.
bool is_binary_stl(std::string_view bytes) {
  constexpr std::size_t kHead = 80, kTriangle = 50, kMostLookedAt = 100;
  constexpr double kTolerance = 1e-2;
  if (bytes.size() < kHead + 4 + kTriangle) return false;
  const std::uint64_t triangles = little_endian(bytes.substr(kHead, 4));
  if (bytes.size() != kHead + 4 + kTriangle * triangles) return false;
  for (std::size_t t = 0; t < std::min<std::size_t>(triangles, kMostLookedAt); ++t) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string_view number = bytes.substr(kHead + 4 + kTriangle * t + 4 * axis, 4);
      const double along = std::bit_cast<float>(static_cast<std::uint32_t>(little_endian(number)));
      squared += along * along;
    }
    if (squared != 0 && !(std::abs(squared - 1) < kTolerance)) return false;
  }
  return true;
}

/// The format's name if the file is known to hold triangles of a surface.
std::string_view surface_format(std::string_view bytes) {
  constexpr std::size_t kBegin = 1000;
  const bool has_facet = bytes.substr(0, kBegin).find("facet normal") != std::string_view::npos;
  if (is_binary_stl(bytes) || (bytes.starts_with("solid") && has_facet)) return "an STL file";
  return bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n") ? "a PLY file" : "";
}

}  // namespace

MeshFileKind mesh_file_kind(std::string_view bytes) {
  constexpr std::string_view kVtkMagic = "# vtk DataFile";
  if (equals_ignoring_case(bytes.substr(0, kVtkMagic.size()), kVtkMagic)) return MeshFileKind::kVtk;
  for (const char* netcdf : {"CDF\x01", "CDF\x02", "CDF\x05"}) {
    if (bytes.starts_with(netcdf)) return MeshFileKind::kExodus;
  }
  constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf";
  if (bytes.starts_with(kUtf8Mark)) bytes.remove_prefix(kUtf8Mark.size());
  TextScanner scanner(bytes);
  const std::string_view word = scanner.peek();
  if (word.size() > 1 && word[0] == '<' && word[1] != '\0') return MeshFileKind::kVtu;
  if (word == "$MeshFormat") return MeshFileKind::kGmsh;
  if (equals_ignoring_case(word, "MeshVersionFormatted")) return MeshFileKind::kMedit;
  if (is_abaqus_keyword_or_comment(word)) return MeshFileKind::kAbaqus;
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

MeshFile read_mesh(std::string_view bytes, const MeshLimits& limits, const std::string& path) {
  MeshFile file = read_kind(mesh_file_kind(bytes), bytes, limits, path);
  recode_names(file);
  leave_out_numbers_with_known_names(file);
  return file;
}

UnreadFile describe_unread(std::string_view bytes) {
  struct Magic {
    std::string_view bytes, text;
  };
  constexpr std::string_view kHdf5 =
      "this is an Exodus file in HDF5's container, or another HDF5 file, which is not read; convert it with netCDF's "
      "nccopy (apt install netcdf-bin): 'nccopy -k cdf5 part.e part-classic.e', or with meshio (apt install "
      "meshio-tools python3-netcdf4), which keeps no names of blocks: 'meshio convert part.e part.vtk'";
  constexpr std::string_view kUtf16 = "the text is in UTF-16, which is not read; save it as UTF-8";
  constexpr std::string_view kMeditBinary =
      "this is MEDIT's binary format (.meshb), which is not read; save it as .mesh";
  constexpr std::string_view kStep =
      "this is a STEP file, a part of CAD; `gmsh -3 part.step -o part.msh` makes a mesh of it (docs/from-cad.md)";
  constexpr std::string_view kGzip = "the file is compressed with gzip; unpack it first";
  constexpr Magic kMagics[] = {{"\x89HDF\r\n", kHdf5},
                               {"\xff\xfe", kUtf16},
                               {"\xfe\xff", kUtf16},
                               {{"<\0", 2}, kUtf16},
                               {{"\0<", 2}, kUtf16},
                               {"\x1f\x8b", kGzip},
                               {{"\1\0\0\0", 4}, kMeditBinary},
                               {{"\0\0\0\1", 4}, kMeditBinary},
                               {"ISO-10303-21", kStep},
                               {"$NOD", "Gmsh files of version 1 are not read; save it with `gmsh -format msh41`"}};
  for (const Magic& magic : kMagics) {
    if (bytes.starts_with(magic.bytes)) return {std::string(magic.text), true};
  }
  const std::string surface =
      "which holds a surface only; " + kNeedsVolumeCells + " (docs/from-cad.md); 'meshio convert' makes none";
  if (const std::string_view format = surface_format(bytes); !format.empty()) {
    return {"this is " + std::string(format) + ", " + surface, true};
  }
  if (bytes.starts_with("PK\x03\x04")) {
    return {"this is a ZIP archive; unpack it first, unless it is a .3mf, " + surface, true};
  }
  return {
      "neither a Gmsh file (first line '$MeshFormat'), nor a MEDIT mesh (first word 'MeshVersionFormatted'), nor a "
      "legacy VTK file (first line '# vtk DataFile Version ...'), nor one of VTK's XML files (.vtu), nor an "
      "OpenVolumeMesh file (first word 'OVM'), nor an Abaqus input file (a keyword with a star first, such as "
      "'*NODE'), nor an Exodus file (first bytes 'CDF')"};
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
