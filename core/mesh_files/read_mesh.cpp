// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_mesh.h"

#include <set>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/base/utf8.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_abaqus.h"
#include "core/mesh_files/read_exodus.h"
#include "core/mesh_files/read_gmsh.h"
#include "core/mesh_files/read_medit.h"
#include "core/mesh_files/read_ovm.h"
#include "core/mesh_files/read_vtk.h"
#include "core/mesh_files/read_vtu.h"
#include "core/mesh_files/unread_formats.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/partition_note.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

namespace {

bool is_abaqus_keyword_or_comment(std::string_view word) {
  if (word.size() < 2 || word[0] != '*') return false;
  return word[1] == '*' || (word[1] >= 'a' && word[1] <= 'z') || (word[1] >= 'A' && word[1] <= 'Z');
}

MeshFile read_kind(MeshFileKind kind, std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin) {
  switch (kind) {
    case MeshFileKind::kGmsh: return read_gmsh(bytes, limits);
    case MeshFileKind::kMedit: return read_medit(bytes, limits);
    case MeshFileKind::kVtk: return read_vtk(bytes, limits);
    case MeshFileKind::kVtu: return read_vtu(bytes, limits, origin);
    case MeshFileKind::kOvm: return read_ovm(bytes, limits);
    case MeshFileKind::kAbaqus: return read_abaqus(bytes, limits, origin);
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

/// Whether there is a line "$MeshFormat". Other sections may come before it, and other formats have comments that begin
/// as sections do.
bool has_gmsh_format(std::string_view bytes) {
  constexpr std::string_view kLine = "$MeshFormat";
  for (std::size_t at = bytes.find(kLine); at != std::string_view::npos; at = bytes.find(kLine, at + 1)) {
    const std::string_view behind = bytes.substr(at + kLine.size(), 1);
    if ((at == 0 || is_blank(bytes[at - 1])) && (behind.empty() || is_blank(behind[0]))) return true;
  }
  return false;
}

}  // namespace

MeshFileKind mesh_file_kind(std::string_view bytes) {
  bytes = without_utf8_mark(bytes);
  constexpr std::string_view kVtkMagic = "# vtk DataFile";
  if (equals_ignoring_case(bytes.substr(0, kVtkMagic.size()), kVtkMagic)) return MeshFileKind::kVtk;
  for (const char* netcdf : {"CDF\x01", "CDF\x02", "CDF\x05"}) {
    if (bytes.starts_with(netcdf)) return MeshFileKind::kExodus;
  }
  TextScanner scanner(bytes);
  const std::string_view word = scanner.peek();
  if (word.size() > 1 && word[0] == '<' && word[1] != '\0') return MeshFileKind::kVtu;
  if (word.starts_with('$') && has_gmsh_format(bytes)) return MeshFileKind::kGmsh;
  if (equals_ignoring_case(word, "MeshVersionFormatted")) return MeshFileKind::kMedit;
  if (is_abaqus_keyword_or_comment(word)) return is_ls_dyna(bytes) ? MeshFileKind::kUnknown : MeshFileKind::kAbaqus;
  const bool ovm = equals_ignoring_case(word, "OVM") || equals_ignoring_case(word.substr(0, 4), "OVMB");
  return ovm ? MeshFileKind::kOvm : MeshFileKind::kUnknown;
}

MeshFile read_mesh(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin) {
  MeshFile file = read_mesh_unresolved(bytes, limits, origin);
  resolve_collapsed_cells(file);
  return file;
}

MeshFile read_mesh_unresolved(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin) {
  const MeshFileKind kind = mesh_file_kind(bytes);
  // pugixml passes over the mark itself, and messages about .vtu files name bytes.
  if (kind != MeshFileKind::kVtu) bytes = without_utf8_mark(bytes);
  MeshFile file = read_kind(kind, bytes, limits, origin);
  if (kind == MeshFileKind::kVtu && !origin.path.empty()) add_partition_note(origin.path, file);
  recode_names(file);
  leave_out_numbers_with_known_names(file);
  return file;
}

UnreadFile describe_unread(std::string_view bytes) {
  bytes = without_utf8_mark(bytes);
  if (std::string text = name_unread_format(bytes); !text.empty()) return {std::move(text), true};
  return {
      "neither a Gmsh file (first line '$MeshFormat'), nor a MEDIT mesh (first word 'MeshVersionFormatted'), nor a "
      "legacy VTK file (first line '# vtk DataFile Version ...'), nor one of VTK's XML files (.vtu), nor an "
      "OpenVolumeMesh file (first word 'OVM'), nor an Abaqus input file (a keyword with a star first, such as "
      "'*NODE'), nor an Exodus file (first bytes 'CDF')"};
}

}  // namespace ccslice
