// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_vtk.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/vtk_cells.h"
#include "core/mesh_files/vtk_point_data.h"
#include "core/mesh_files/vtk_scanner.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/renumber_text.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

class VtkReader {
 public:
  VtkReader(std::string_view text, const MeshLimits& limits) : values_(text), limits_(limits) {}

  MeshFile read() {
    read_header();
    while (!scanner_.at_end()) read_section();
    if (cells_.types.empty()) types_place_ = scanner_.mark();
    finish_cells();
    append_file_channels(std::move(channels_), limits_, file_);
    appender_.finish_bezier_cells(weights_);
    appender_.warn();
    leave_out_unused_vertices(unfit_, scanner_, file_);
    return std::move(file_);
  }

 private:
  /// A number among the cells' points that is no point: where it stands there, and in the file.
  struct Count {
    std::size_t place;
    std::uint64_t mark;
  };
  static constexpr std::uint64_t kMostCounts = 64;  // The faces of a polyhedron, and their sides, are fewer.

  void read_header() {
    constexpr std::string_view kMagic = "# vtk DataFile Version ";
    const std::string_view first = scanner_.rest_of_line();
    if (!equals_ignoring_case(first.substr(0, kMagic.size()), kMagic)) {
      scanner_.fail("'# vtk DataFile Version ...'", first);
    }
    const std::string_view version = first.substr(kMagic.size());
    offsets_style_ = version >= "5";
    cells_.old_hexahedra = version < "5.1";
    scanner_.rest_of_line();  // The title.
    const std::string_view coding = scanner_.next("'ASCII' or 'BINARY'");
    if (equals_ignoring_case(coding, "BINARY")) {
      values_.set_binary();
    } else if (!equals_ignoring_case(coding, "ASCII")) {
      scanner_.fail("'ASCII' or 'BINARY'", coding);
    }
    expect("DATASET");
    const std::string_view dataset = scanner_.next("'UNSTRUCTURED_GRID'");
    if (!equals_ignoring_case(dataset, "UNSTRUCTURED_GRID")) {
      const bool surface = equals_ignoring_case(dataset, "POLYDATA");
      scanner_.fail_with(ErrorCode::kFileUnsupported,
                         "data set '" + printable(dataset) + "' " +
                             (surface ? "holds a surface only; " + kNeedsVolumeCells
                                      : "is not read; save the mesh as UNSTRUCTURED_GRID"));
    }
  }

  void read_section() {
    const std::string keyword(scanner_.next("a keyword"));
    if (equals_ignoring_case(keyword, "POINTS")) {
      read_points();
    } else if (equals_ignoring_case(keyword, "CELLS")) {
      read_cells();
    } else if (equals_ignoring_case(keyword, "CELL_TYPES")) {
      read_types();
    } else if (equals_ignoring_case(keyword, "POINT_DATA")) {
      read_attributes(true);
    } else if (equals_ignoring_case(keyword, "CELL_DATA")) {
      read_attributes(false);
    } else if (equals_ignoring_case(keyword, "FIELD")) {
      skip_field(values_);
    } else if (equals_ignoring_case(keyword, "METADATA")) {
      scanner_.skip_paragraph();
    } else {
      scanner_.fail("POINTS, CELLS, CELL_TYPES, POINT_DATA, CELL_DATA, FIELD or METADATA", keyword);
    }
  }

  void read_points() {
    if (!file_.mesh.positions.empty()) scanner_.fail("only one POINTS section", "POINTS");
    const std::uint64_t count = scanner_.count_up_to("the number of points", limits_.max_vertices);
    values_.open_array(scanner_.next("a data type"));
    for (std::uint64_t i = 0; i < count; ++i) {
      file_.mesh.positions.push_back(unfit_.position(values_, i, scanner_));
      file_.numbers.vertices.push_back(i);
    }
  }

  void read_cells() {
    if (!cells_.offsets.empty()) scanner_.fail("only one CELLS section", "CELLS");
    const std::uint64_t first = scanner_.count_up_to("the number of cells", limits_.max_cells + 1);
    const std::uint64_t second = scanner_.count("the size of the cell list");
    cells_.offsets.push_back(0);
    if (offsets_style_ || (!values_.binary() && equals_ignoring_case(scanner_.peek(), "OFFSETS"))) {
      read_offsets_and_connectivity(first, second);
    } else {
      read_counted_cells(first, second);
    }
  }

  /// Before 5.0: each cell as its number of points, then the points.
  void read_counted_cells(std::uint64_t cell_count, std::uint64_t size) {
    values_.open_array("int");
    std::uint64_t used = 0;
    for (std::uint64_t cell = 0; cell < cell_count; ++cell) {
      const std::uint64_t corners = values_.count("the number of points of a cell");
      cells_.places.push_back(scanner_.mark());
      used += corners + 1;
      if (corners >= size || used > size) {
        scanner_.fail_with(ErrorCode::kFileSyntax, "the cells are longer than the " + std::to_string(size) +
                                                       " numbers that the CELLS line announces");
      }
      for (std::uint64_t i = 0; i < corners; ++i) cells_.connectivity.push_back(read_point_id());
      cells_.offsets.push_back(cells_.connectivity.size());
    }
  }

  /// From 5.0 on: n + 1 offsets, then all points in one list.
  void read_offsets_and_connectivity(std::uint64_t offset_count, std::uint64_t point_count) {
    expect("OFFSETS");
    values_.open_array(scanner_.next("a data type"));
    for (std::uint64_t i = 0; i < offset_count; ++i) {
      const std::uint64_t offset = values_.count("an offset");
      const bool fits = i == 0 ? offset == 0 : offset >= cells_.offsets.back() && offset <= point_count;
      if (!fits) scanner_.fail("offsets that start at 0 and never fall", std::to_string(offset));
      if (i == 0) continue;
      cells_.offsets.push_back(offset);
      cells_.places.push_back(scanner_.mark());
    }
    if (offset_count > 0 && cells_.offsets.back() != point_count) {
      scanner_.fail("a last offset of " + std::to_string(point_count), std::to_string(cells_.offsets.back()));
    }
    expect("CONNECTIVITY");
    values_.open_array(scanner_.next("a data type"));
    for (std::uint64_t i = 0; i < point_count; ++i) cells_.connectivity.push_back(read_point_id());
  }

  std::uint32_t read_point_id() {
    const std::uint64_t id = values_.count("a point id");
    if (id >= std::numeric_limits<std::uint32_t>::max()) {
      scanner_.fail_with(ErrorCode::kMeshIndexOutOfRange, "point id " + std::to_string(id) + " is out of range");
    }
    const std::size_t points = file_.mesh.vertex_count();  // 0 as long as they haven't come.
    if (points > 0 && id >= points) {
      if (id >= kMostCounts) refuse_point(id, scanner_.mark());
      counts_.push_back({cells_.connectivity.size(), scanner_.mark()});
    }
    return static_cast<std::uint32_t>(id);
  }

  [[noreturn]] void refuse_point(std::uint64_t id, std::uint64_t mark) const {
    scanner_.fail_at(mark, ErrorCode::kMeshIndexOutOfRange,
                     "point id " + std::to_string(id) + "; the file has " + std::to_string(file_.mesh.vertex_count()) +
                         " points, counted from 0");
  }

  /// Only polyhedra have numbers there that are no points.
  void check_counts() const {
    for (const Count& count : counts_) {
      const auto end = std::ranges::upper_bound(cells_.offsets, count.place);
      const auto cell = static_cast<std::size_t>(end - cells_.offsets.begin()) - 1;
      if (cells_.types[cell] != kVtkPolyhedron) refuse_point(cells_.connectivity[count.place], count.mark);
    }
  }

  void read_types() {
    if (!cells_.types.empty()) scanner_.fail("only one CELL_TYPES section", "CELL_TYPES");
    const std::uint64_t count = scanner_.count_up_to("the number of cell types", limits_.max_cells);
    types_place_ = scanner_.mark();
    values_.open_array("int");
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t type = values_.count("a cell type");
      constexpr std::uint64_t kLargestType = 255;
      if (type > kLargestType) scanner_.fail("a VTK cell type", std::to_string(type));
      cells_.types.push_back(static_cast<std::uint16_t>(type));
      cells_.type_places.push_back(scanner_.mark());
    }
  }

  void read_attributes(bool of_points) {
    const std::uint64_t count = scanner_.count("the number of values");
    const std::size_t points = file_.mesh.positions.size();
    if (of_points && points > 0 && count != points) {
      scanner_.fail_with(ErrorCode::kFileSyntax,
                         "POINT_DATA of " + std::to_string(count) + " points; the file has " + std::to_string(points));
    }
    if (!of_points) return read_cell_data(count);
    VtkAttributes found = read_vtk_attributes(values_, count, limits_.max_channels, unfit_);
    for (const std::string& name : found.left_out) file_.warnings.push_back("point data '" + name + "' left out");
    const auto weights = std::ranges::find(found.channels, kRationalWeights, &NamedChannel::name);
    if (weights != found.channels.end()) weights_ = weights->values;
    if (found.channels.empty()) return;
    if (!channels_.empty()) scanner_.fail("only one POINT_DATA section", "POINT_DATA");
    channels_ = std::move(found.channels);
  }

  void read_cell_data(std::uint64_t count) {
    VtkCellData found = read_vtk_cell_data(values_, count);
    for (const std::string& name : found.left_out) file_.warnings.push_back("cell data '" + name + "' left out");
    for (CellNumbers& numbers : found.numbers) file_.cell_numbers.push_back(std::move(numbers));
  }

  void finish_cells() {
    if (file_.mesh.positions.empty()) throw Error(ErrorCode::kMeshEmpty, "the file has no POINTS; save the mesh anew");
    const std::size_t cell_count = cells_.offsets.empty() ? 0 : cells_.offsets.size() - 1;
    if (cell_count != cells_.types.size()) {
      scanner_.fail_at(types_place_, ErrorCode::kFileSyntax,
                       "the file has " + std::to_string(cell_count) + " cells but " +
                           std::to_string(cells_.types.size()) + " cell types (CELL_TYPES)");
    }
    check_counts();
    const std::vector<std::uint32_t> appended = appender_.append(cells_, scanner_);
    keep_numbers_of(appended, cell_count);
    cells_ = {};
    if (file_.mesh.cell_kinds.empty()) {
      throw Error(ErrorCode::kMeshEmpty, "the file has no hexahedra, tetrahedra or wedges; " + kNeedsVolumeCells);
    }
    check_cell_vertices(file_);
  }

  /// Drops the numbers of cells that were left out, and arrays that don't fit the cells.
  void keep_numbers_of(const std::vector<std::uint32_t>& cells, std::size_t cell_count) {
    std::erase_if(file_.cell_numbers, [&](const CellNumbers& numbers) {
      if (numbers.of_cells.size() == cell_count) return false;
      file_.warnings.push_back("cell data '" + numbers.name + "' left out");
      return true;
    });
    for (CellNumbers& numbers : file_.cell_numbers) {
      std::vector<double> kept;
      kept.reserve(cells.size());
      for (const std::uint32_t cell : cells) kept.push_back(numbers.of_cells[cell]);
      numbers.of_cells = std::move(kept);
    }
  }

  void expect(std::string_view keyword) {
    const std::string_view token = scanner_.next(in_quotes(keyword));
    if (!equals_ignoring_case(token, keyword)) scanner_.fail(in_quotes(keyword), token);
  }

  VtkScanner values_;
  TextScanner& scanner_ = values_.text();
  const MeshLimits& limits_;
  bool offsets_style_ = false;
  std::vector<float> weights_;  // Of rational Bezier cells, by point, or none.
  VtkCells cells_;
  std::vector<Count> counts_;
  std::uint64_t types_place_ = 0;  // Where their number stands; the end, if there are none.
  std::vector<NamedChannel> channels_;
  UnfitNumbers unfit_;
  MeshFile file_;
  VtkCellAppender appender_{file_};
};

}  // namespace

MeshFile read_vtk(std::string_view text, const MeshLimits& limits) { return VtkReader(text, limits).read(); }

}  // namespace ccslice
