// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_medit.h"
#include <algorithm>
#include <charconv>
#include <iterator>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>
#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/medit_high_order.h"
#include "core/mesh_files/medit_sections.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/renumber_text.h"
#include "core/mesh_import/text_scanner.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

class MeditReader {
 public:
  MeditReader(std::string_view text, const MeshLimits& limits) : scanner_(text), limits_(limits) {}

  MeshFile read() {
    read_header();
    while (!scanner_.at_end() && !equals_ignoring_case(scanner_.peek(), "End")) read_section();
    if (file_.mesh.positions.empty())
      throw Error(ErrorCode::kMeshEmpty, "the file has no Vertices; save the mesh anew");
    if (file_.mesh.cell_kinds.empty()) {
      throw Error(ErrorCode::kMeshEmpty, "the file has no Hexahedra, Tetrahedra or Prisms; " + kNeedsVolumeCells);
    }
    high_order_.finish(file_);
    check_cell_vertices(file_);
    file_.numbers.vertices.resize(file_.mesh.vertex_count());
    std::iota(file_.numbers.vertices.begin(), file_.numbers.vertices.end(), std::uint64_t{1});
    leave_out_unused_vertices(unfit_, scanner_, file_);
    if (are_integers_) file_.cell_numbers.push_back(std::move(references_));
    return std::move(file_);
  }

 private:
  void read_header() {
    const std::string_view magic = scanner_.next("'MeshVersionFormatted'");
    if (!equals_ignoring_case(magic, "MeshVersionFormatted")) scanner_.fail("'MeshVersionFormatted'", magic);
    const std::uint64_t version = scanner_.count("a format version");
    if (version < 1 || version > 4) {
      scanner_.fail_with(ErrorCode::kFileUnsupported,
                         "MEDIT version " + std::to_string(version) + " is not known; save it as 2 or 3");
    }
  }

  void read_section() {
    const std::string keyword(scanner_.next("a keyword"));
    if (equals_ignoring_case(keyword, "Dimension")) {
      read_dimension();
    } else if (equals_ignoring_case(keyword, "Vertices")) {
      read_vertices();
    } else if (const MeditCells* const cells = find_section(kMeditCells, keyword)) {
      cells->order > 1 ? read_high_order(*cells) : read_cells(cells->kind);
    } else if (equals_ignoring_case(keyword, "Pyramids")) {
      read_pyramids();
    } else if (const MeditRefused* const refused = find_section(kMeditRefused, keyword)) {
      refuse(*refused);
    } else if (!high_order_.read_ordering(keyword, scanner_)) {
      skip_section(keyword);
    }
  }

  /// Null if none of them is called so.
  template <typename Section, std::size_t count>
  static const Section* find_section(const Section (&sections)[count], std::string_view keyword) {
    const auto* const found = std::ranges::find_if(
        sections, [&](const Section& section) { return equals_ignoring_case(keyword, section.keyword); });
    return found == std::end(sections) ? nullptr : found;
  }

  void read_dimension() {
    const std::uint64_t dimension = scanner_.count("the dimension, 3");
    if (dimension != 3) {
      scanner_.fail_with(ErrorCode::kFileUnsupported, "dimension " + std::to_string(dimension) +
                                                          "; a solid needs three: save the mesh of the volume");
    }
  }

  void read_vertices() {
    if (!file_.mesh.positions.empty()) scanner_.fail("only one Vertices section", "Vertices");
    const std::uint64_t count = scanner_.count_up_to("the number of vertices", limits_.max_vertices);
    for (std::uint64_t i = 0; i < count; ++i) {
      file_.mesh.positions.push_back(unfit_.position(scanner_, i, scanner_));
      scanner_.skip(1, "a vertex reference");
    }
  }

  std::uint64_t cell_count() {
    const std::uint64_t most = limits_.max_cells - std::min(limits_.max_cells, file_.mesh.cell_count());
    return scanner_.count_up_to("the number of cells", most);
  }

  /// Numbers count the cells of a section.
  void number_cells(std::uint64_t count) {
    file_.numbers.cells.resize(file_.mesh.cell_count());
    std::iota(file_.numbers.cells.end() - static_cast<std::ptrdiff_t>(count), file_.numbers.cells.end(),
              std::uint64_t{1});
  }

  void read_cells(CellKind kind) {
    const std::uint64_t count = cell_count();
    for (std::uint64_t i = 0; i < count; ++i) {
      for (int corner = 0; corner < corner_count(kind); ++corner) file_.mesh.cell_vertices.push_back(read_vertex_id());
      read_reference();
      file_.mesh.cell_kinds.push_back(kind);
    }
    number_cells(count);
  }

  void read_pyramids() {
    const std::uint64_t count = cell_count();
    std::vector<std::uint32_t>& vertices = file_.mesh.cell_vertices;
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::uint64_t corner = 0; corner < kPyramidCorners; ++corner) vertices.push_back(read_vertex_id());
      vertices.insert(vertices.end(), 3, vertices.back());
      read_reference();
      file_.mesh.cell_kinds.push_back(CellKind::kHex);
    }
    number_cells(count);
  }

  void read_high_order(const MeditCells& section) {
    const std::uint64_t count = cell_count();
    const auto first_cell = static_cast<std::uint32_t>(file_.mesh.cell_count());
    std::vector<std::uint32_t> nodes;
    for (std::uint64_t i = 0; i < count; ++i) {
      for (std::uint8_t node = 0; node < section.nodes; ++node) nodes.push_back(read_vertex_id());
      file_.mesh.cell_vertices.insert(file_.mesh.cell_vertices.end(), nodes.end() - section.nodes,
                                      nodes.end() - section.nodes + corner_count(section.kind));
      read_reference();
      file_.mesh.cell_kinds.push_back(section.kind);
    }
    number_cells(count);
    high_order_.add(section, first_cell, std::move(nodes));
  }

  /// Whatever it is: it only counts if regions are to be made of it.
  void read_reference() {
    const std::string_view token = scanner_.next("a cell reference");
    std::int64_t reference = 0;
    const auto end = std::from_chars(token.data(), token.data() + token.size(), reference).ptr;
    are_integers_ = are_integers_ && end == token.data() + token.size();
    references_.of_cells.push_back(static_cast<double>(reference));
  }

  std::uint32_t read_vertex_id() {
    const std::uint64_t id = scanner_.count("a vertex id");
    if (id < 1 || id > std::numeric_limits<std::uint32_t>::max()) {
      scanner_.fail_with(ErrorCode::kMeshIndexOutOfRange, "vertex id " + std::to_string(id) + "; ids count from 1");
    }
    const std::size_t vertices = file_.mesh.vertex_count();  // 0 as long as they haven't come.
    if (vertices > 0 && id > vertices) {
      scanner_.fail_with(ErrorCode::kMeshIndexOutOfRange, "vertex id " + std::to_string(id) + "; the file has " +
                                                              std::to_string(vertices) + " vertices");
    }
    return static_cast<std::uint32_t>(id - 1);
  }

  void refuse(const MeditRefused& section) {
    const std::uint64_t count = scanner_.count("the number of " + std::string(section.keyword));
    if (count == 0) return;
    scanner_.fail_with(ErrorCode::kMeshUnsupportedCell,
                       std::to_string(count) + " " + std::string(section.plural) + " (1 to " + std::to_string(count) +
                           " of the section) aren't read; " + std::string(section.remedy));
  }

  void skip_section(const std::string& keyword) {
    if (!is_letter(keyword.front())) scanner_.fail("a keyword", keyword);
    if (const MeditSkipped* const section = find_section(kMeditSkipped, keyword)) {
      const std::uint64_t count = scanner_.count("the number of entries of " + keyword);
      for (std::uint64_t i = 0; i < count; ++i) {
        scanner_.skip(static_cast<std::uint64_t>(section->tokens_per_entry), "an entry of " + keyword);
      }
      if (count > 0) file_.warnings.push_back(std::to_string(count) + " " + keyword + " left out");
      return;
    }
    while (!scanner_.at_end() && !is_letter(scanner_.peek().front())) scanner_.skip(1, "a value");
    file_.warnings.push_back("section " + printable(keyword) + " is not known: left out");
  }

  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

  TextScanner scanner_;
  const MeshLimits& limits_;
  UnfitNumbers unfit_;
  MeditHighOrder high_order_;
  MeshFile file_;
  CellNumbers references_{"reference", {}};
  bool are_integers_ = true;  // All references are.
};

}  // namespace

MeshFile read_medit(std::string_view text, const MeshLimits& limits) { return MeditReader(text, limits).read(); }

}  // namespace ccslice
