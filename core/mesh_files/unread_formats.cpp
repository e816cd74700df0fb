// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/unread_formats.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "core/base/similar_name.h"
#include "core/mesh_import/byte_order.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::size_t kLookedAt = 1 << 16;  // Bytes, for words that don't stand at the beginning.

struct Magic {
  std::string_view bytes, text;
};

constexpr std::string_view kUtf16 = "the text is in UTF-16, which is not read; save it as UTF-8";
constexpr std::string_view kMeditBinary = "this is MEDIT's binary format (.meshb), which is not read; save it as .mesh";
constexpr std::string_view kMfem =
    "this is MFEM's own mesh format, which is not read; MFEM's tool saves it as VTK: `mesh-explorer -m part.mesh`, "
    "then "
    "V";
constexpr std::string_view kUcd =
    "this is an AVS UCD file, which is not read; save it as .vtu in ParaView, or, if it is text, 'meshio convert "
    "--input-format avsucd part.inp part.vtk' (apt install meshio-tools)";
constexpr std::string_view kTecplot =
    "this is a Tecplot file, which is not read; 'meshio convert --input-format tecplot part.dat part.vtk' (apt install "
    "meshio-tools)";

/// By the first bytes.
constexpr Magic kMagics[] = {
    {"\xff\xfe", kUtf16},
    {"\xfe\xff", kUtf16},
    {{"<\0", 2}, kUtf16},
    {{"\0<", 2}, kUtf16},
    {"\x1f\x8b", "the file is compressed with gzip; unpack it first"},
    {"BZh", "the file is compressed with bzip2; unpack it first"},
    {"\xfd"
     "7zXZ",
     "the file is compressed with xz; unpack it first"},
    {"\x28\xb5\x2f\xfd", "the file is compressed with zstd; unpack it first"},
    {"7z\xbc\xaf", "this is a 7z archive; unpack it first"},
    {{"\1\0\0\0", 4}, kMeditBinary},
    {{"\0\0\0\1", 4}, kMeditBinary},
    {"ISO-10303-21",
     "this is a STEP file, a part of CAD; `gmsh -3 part.step -o part.msh` makes a mesh of it (docs/from-cad.md)"},
    {"DBRep_DrawableShape",
     "this is a BREP file, a part of CAD; `gmsh -3 part.brep -o part.msh` makes a mesh of it (docs/from-cad.md)"},
    {"$NOD", "Gmsh files of version 1 are not read; save it with `gmsh -format msh41`"},
    {"version https://git-lfs.github.com/spec/",
     "this is a Git LFS pointer, which stands for the file; `git lfs pull` in its repository fetches the file itself"},
    {"/annex/objects/",
     "this is a git-annex pointer, which stands for the file; `git annex get` in its repository fetches the file "
     "itself"},
    {"MFEM ", kMfem},
    {"libMesh-",
     "this is a file of libMesh's (.xda), which is not read; its tool saves it as Exodus: `meshtool -i part.xda -o "
     "part.e`"},
    {"# Created by COMSOL",
     "this is a COMSOL mesh, which is not read; export it from COMSOL as a NASTRAN file, which 'meshio convert "
     "part.nas "
     "part.vtk' reads (apt install meshio-tools)"},
    {"mesh3d",
     "this is a Netgen mesh (.vol), which is not read; 'meshio convert part.vol part.vtk' (apt install meshio-tools)"},
    {"#RADIOSS",
     "this is a Radioss input file, which is not read; save the mesh as Abaqus input (.inp) in the preprocessor that "
     "wrote it"},
    {"\xc0\xa8\xa3\xa9"
     "ADF Database",
     "this is a CGNS file, which is not read; save it as .vtu in ParaView"},
    {"\7", kUcd},  // Its binary kind.
    {"NDIME", "this is an SU2 mesh, which is not read; 'meshio convert part.su2 part.vtk' (apt install meshio-tools)"},
    {"* FLAC3D",
     "this is a FLAC3D grid, which is not read; 'meshio convert part.f3grid part.vtk' (apt install meshio-tools)"},
};

constexpr std::string_view kAnsys =
    "this is an ANSYS input file (.cdb), which is not read; Python's mapdl-archive makes a grid of VTK's of it: "
    "`mapdl_archive.Archive('part.cdb').grid.save('part.vtu')`";
constexpr std::string_view kNastran =
    "this is a Nastran file, which is not read; 'meshio convert part.bdf part.vtk' (apt install meshio-tools)";
constexpr std::string_view kLsDyna =
    "this is an LS-DYNA keyword file (*KEYWORD), which is not read; Python's lsdyna-mesh-reader makes a grid of VTK's "
    "of it: `lsdyna_mesh_reader.Deck('part.k').to_grid().save('part.vtu')`";

bool is_word_end(std::string_view text) {
  return text.empty() || is_blank(text.front()) || text.front() == ',' || text.front() == '=' || text.front() == '*';
}

/// Whether the line begins with these words, in any case.
bool begins_with_words(std::string_view line, std::string_view words) {
  return equals_ignoring_case(line.substr(0, words.size()), words) &&
         (line.size() <= words.size() || is_word_end(line.substr(words.size())));
}

/// The first lines that aren't empty and begin with none of these characters, which open comments.
std::vector<std::string_view> first_lines(std::string_view bytes, std::string_view comments, std::size_t most) {
  std::vector<std::string_view> lines;
  bytes = bytes.substr(0, kLookedAt);
  while (!bytes.empty() && lines.size() < most) {
    const std::string_view line = bytes.substr(0, bytes.find('\n'));
    bytes.remove_prefix(std::min(line.size() + 1, bytes.size()));
    const std::size_t first = line.find_first_not_of(" \t\r\v\f");
    if (first != std::string_view::npos && comments.find(line[first]) == std::string_view::npos) lines.push_back(line);
  }
  return lines;
}

/// The whole numbers that the line consists of; none if it has anything else.
std::vector<std::uint64_t> whole_numbers(std::string_view line) {
  std::vector<std::uint64_t> numbers;
  TextScanner scanner(line);
  while (!scanner.at_end()) {
    const auto number = parse_count(scanner.next("a number"));
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

std::string name_hdf5(std::string_view bytes) {
  constexpr std::string_view kMagic = "\x89HDF\r\n";
  if (!bytes.starts_with(kMagic)) return {};
  const auto holds = [&](std::string_view word) { return bytes.find(word) != std::string_view::npos; };
  if (holds("CGNSLibraryVersion")) {
    return "this is a CGNS file, which is not read; 'meshio convert part.cgns part.vtk' (apt install meshio-tools "
           "python3-h5py), or save it as .vtu in ParaView";
  }
  if (holds("VTKHDF")) return "this is a VTKHDF file, which is not read; save it as .vtu in ParaView";
  if (holds("INFOS_GENERALES")) {
    return "this is a MED file of Salome, which is not read; 'meshio convert part.med part.vtk' (apt install "
           "meshio-tools python3-h5py)";
  }
  return "this is an Exodus file in HDF5's container, or another HDF5 file, which is not read; convert it with "
         "netCDF's nccopy (apt install netcdf-bin): 'nccopy -k cdf5 part.e part-classic.e', or with meshio (apt "
         "install "
         "meshio-tools python3-netcdf4), which keeps no names of blocks: 'meshio convert part.e part.vtk'";
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

/// The format's name if the file is known to hold a surface only.
std::string_view surface_format(std::string_view bytes) {
  constexpr std::size_t kBegin = 1000;
  const bool has_facet = bytes.substr(0, kBegin).find("facet normal") != std::string_view::npos;
  if (is_binary_stl(bytes) || (bytes.starts_with("solid") && has_facet)) return "an STL file";
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n")) return "a PLY file";
  if (bytes.starts_with("OFF\n") || bytes.starts_with("OFF\r\n")) return "an OFF file";
  return {};
}

std::string what_surfaces_need() {
  return "which holds a surface only; " + kNeedsVolumeCells + " (docs/from-cad.md); 'meshio convert' makes none";
}

std::string name_obj(std::string_view bytes) {
  const std::vector<std::string_view> lines = first_lines(bytes, "#", 1);
  const bool obj = !lines.empty() && (begins_with_words(lines[0], "mtllib") || begins_with_words(lines[0], "v"));
  return obj ? "this is an OBJ file, " + what_surfaces_need() : "";
}

std::string name_surface(std::string_view bytes) {
  const std::string surface = what_surfaces_need();
  if (const std::string_view format = surface_format(bytes); !format.empty()) {
    return "this is " + std::string(format) + ", " + surface;
  }
  if (bytes.starts_with("PK\x03\x04")) return "this is a ZIP archive; unpack it first, unless it is a .3mf, " + surface;
  return {};
}

/// Files that begin with numbers: Universal files, AVS UCD, TetGen's.
std::string name_numbers(std::string_view bytes) {
  const std::vector<std::string_view> lines = first_lines(bytes, "#", 2);
  if (lines.size() < 2) return {};
  TextScanner first(lines[0]);
  const std::vector<std::uint64_t> numbers = whole_numbers(lines[0]);
  if (first.peek() == "-1" && whole_numbers(lines[1]).size() == 1) {
    return "this is an I-DEAS Universal file (.unv), which is not read; `gmsh part.unv -save -o part.msh` converts it";
  }
  const std::size_t next = whole_numbers(lines[1]).size();
  if (numbers.size() == 5 && numbers[0] > 0 && numbers[1] > 0) {
    return std::string(kUcd);
  }
  const bool nodes = numbers.size() == 4 && numbers[1] == 3 && numbers[3] <= 1;
  const bool elements = numbers.size() == 3 && (numbers[1] == 4 || numbers[1] == 10) && next > numbers[1];
  if (nodes || elements) {
    return "this is a file of TetGen's (.node, .ele), which is not read; 'meshio convert part.ele part.vtk' (apt "
           "install "
           "meshio-tools) takes both, or run `tetgen -k`, which writes .vtk";
  }
  return {};
}

std::string name_solver_input(std::string_view bytes) {
  const std::vector<std::string_view> lines = first_lines(bytes, "$!#", 200);
  if (lines.empty()) return {};
  const auto any = [&](std::string_view words) {
    return std::ranges::any_of(lines, [&](std::string_view line) { return begins_with_words(line, words); });
  };
  if (lines[0].starts_with('*') && is_ls_dyna(bytes)) return std::string(kLsDyna);
  if (begins_with_words(lines[0], "/COM") || any("NBLOCK") || any("/PREP7")) return std::string(kAnsys);
  for (const char* words : {"BEGIN BULK", "BEGIN", "GRID", "CEND", "SOL", "CHEXA", "CTETRA", "NASTRAN"}) {
    if (begins_with_words(lines[0], words) && (any("GRID") || any("CEND") || any("BEGIN BULK"))) {
      return std::string(kNastran);
    }
  }
  for (const char* words : {"TITLE", "VARIABLES", "ZONE"}) {
    if (begins_with_words(lines[0], words) && any("ZONE")) return std::string(kTecplot);
  }
  if (any("FoamFile")) {
    return "this is a file of OpenFOAM's, whose meshes are not read; `foamToVTK` in the folder of the case writes .vtu";
  }
  if (lines[0].starts_with("(0 ") || lines[0].starts_with("(1 ") || lines[0].starts_with("(2 ")) {
    return "this is a Fluent mesh, which is not read; open it in ParaView and save it as .vtu";
  }
  return {};
}

}  // namespace

bool is_ls_dyna(std::string_view bytes) {
  const std::vector<std::string_view> lines = first_lines(bytes, "", ~std::size_t{0});
  // Abaqus has no other lines that begin with any character.
  const bool has_heading =
      std::ranges::any_of(lines, [](std::string_view line) { return begins_with_words(line, "*HEADING"); });
  return std::ranges::any_of(lines, [has_heading](std::string_view line) {
    if ((line.starts_with('$') && !has_heading) || begins_with_words(line, "*KEYWORD")) return true;
    constexpr std::string_view kBeginnings[] = {"*ELEMENT_", "*SECTION_", "*MAT_", "*SET_", "*PART_", "*CONTROL_"};
    return std::ranges::any_of(
        kBeginnings, [&](std::string_view begin) { return equals_ignoring_case(line.substr(0, begin.size()), begin); });
  });
}

std::string name_unread_format(std::string_view bytes) {
  for (const Magic& magic : kMagics) {
    if (bytes.starts_with(magic.bytes)) return std::string(magic.text);
  }
  for (const auto name : {name_hdf5, name_surface}) {
    if (std::string text = name(bytes); !text.empty()) return text;
  }
  if (bytes.substr(0, kLookedAt).find('\0') != std::string_view::npos) return {};  // No text.
  for (const auto name : {name_obj, name_numbers, name_solver_input}) {
    if (std::string text = name(bytes); !text.empty()) return text;
  }
  return {};
}

std::string name_unread_xml(std::string_view element) {
  if (element == "Xdmf") {
    return "this is an XDMF file, which is not read; 'meshio convert part.xdmf part.vtk' (apt install meshio-tools "
           "python3-h5py), or save it as .vtu in ParaView";
  }
  if (element == "dolfin") {
    return "this is a mesh of DOLFIN's in XML, which is not read; 'meshio convert part.xml part.vtk' (apt install "
           "meshio-tools)";
  }
  return "this is XML, but no file of VTK's (no VTKFile element)";
}

}  // namespace ccslice
