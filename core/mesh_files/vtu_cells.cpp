// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtu_cells.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/validate.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostCellPoints = 1331;  // On average: those of a hexahedron of order 10.

class VtuCellReader {
 public:
  VtuCellReader(const VtuDocument& document, pugi::xml_node piece, std::uint64_t cells, std::uint64_t points,
                const MeshLimits& limits)
      : document_(document),
        arrays_(document.require(piece, "Cells")),
        data_(piece.child("CellData")),
        count_(cells),
        points_(points),
        most_entries_(kMostCellPoints * limits.max_cells) {}

  VtkCells read() {
    read_ends("offsets", count_, cells_.offsets);
    cells_.offsets.insert(cells_.offsets.begin(), 0);
    read_types();
    read_connectivity();
    read_ghosts();
    if (std::ranges::find(cells_.types, kVtkPolyhedron) != cells_.types.end()) read_faces();
    cells_.old_hexahedra = document_.is_older_than(2, 1);
    return std::move(cells_);
  }

 private:
  /// Where each of so many lists ends in an array that has them one after the other.
  void read_ends(const char* name, std::uint64_t count, std::vector<std::uint64_t>& ends) const {
    VtuNumbers numbers = document_.open(document_.require(arrays_, "DataArray", name), count);
    std::uint64_t before = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t end = numbers.values().count("an offset");
      if (end < before || end > most_entries_) numbers.text().fail("offsets that never fall", std::to_string(end));
      ends.push_back(before = end);
    }
    numbers.require_end();
  }

  void read_types() {
    VtuNumbers types = document_.open(document_.require(arrays_, "DataArray", "types"), count_);
    for (std::uint64_t i = 0; i < count_; ++i) {
      const std::uint64_t type = types.values().count("a cell type");
      constexpr std::uint64_t kLargestType = 255;
      if (type > kLargestType) types.text().fail("a VTK cell type", std::to_string(type));
      cells_.types.push_back(static_cast<std::uint16_t>(type));
      cells_.type_places.push_back(types.text().mark());
    }
    types.require_end();
  }

  void read_connectivity() {
    VtuNumbers points = document_.open(document_.require(arrays_, "DataArray", "connectivity"), cells_.offsets.back());
    for (std::uint64_t cell = 0; cell < count_; ++cell) {
      while (cells_.connectivity.size() < cells_.offsets[cell + 1]) {
        cells_.connectivity.push_back(read_point_id(points));
      }
      cells_.places.push_back(points.text().mark());
    }
    points.require_end();
  }

  std::uint32_t read_point_id(VtuNumbers& numbers) const {
    const std::uint64_t id = numbers.values().count("a point id");
    if (id >= points_) {
      numbers.text().fail_with(
          ErrorCode::kMeshIndexOutOfRange,
          "point id " + std::to_string(id) + "; the piece has " + std::to_string(points_) + " points, counted from 0");
    }
    return static_cast<std::uint32_t>(id);
  }

  /// Bit 0 marks a cell that another piece has too.
  void read_ghosts() {
    const pugi::xml_node array = data_.find_child_by_attribute("DataArray", "Name", kVtkGhosts);
    if (!array) return;
    VtuNumbers numbers = document_.open(array, count_);
    for (std::uint64_t cell = 0; cell < count_; ++cell) {
      cells_.ghosts.push_back(numbers.values().count("a ghost type") % 2 != 0);
    }
    numbers.require_end();
  }

  void read_faces() {
    cells_.faces.emplace();
    const bool old = arrays_.find_child_by_attribute("DataArray", "Name", "faceoffsets");
    old ? read_face_stream(*cells_.faces) : read_face_arrays(*cells_.faces);
  }

  void read_face_stream(VtkFaces& faces) const {
    std::vector<std::uint64_t> ends;  // Of the cells that have faces; the others end where the last one did.
    VtuNumbers offsets = document_.open(document_.require(arrays_, "DataArray", "faceoffsets"), count_);
    std::uint64_t before = 0;
    for (std::uint64_t cell = 0; cell < count_; ++cell) {
      const double end = offsets.values().any_real("an offset, or -1");
      if (end >= 0) {
        const bool fits = end >= static_cast<double>(before) && end <= static_cast<double>(most_entries_);
        if (!fits) offsets.text().fail("offsets that never fall", std::to_string(end));
        before = static_cast<std::uint64_t>(end);
      }
      ends.push_back(before);
    }
    offsets.require_end();
    VtuNumbers stream = document_.open(document_.require(arrays_, "DataArray", "faces"), before);
    std::uint64_t taken = 0;
    const auto take_count = [&](std::uint64_t end) {
      const std::uint64_t count = taken < end ? stream.values().count("a number of faces or points") : 0;
      if (taken++ >= end || count > end - taken) stream.text().fail("faces as long as faceoffsets tell", "more");
      return count;
    };
    for (const std::uint64_t end : ends) {
      const std::uint64_t face_count = taken < end ? take_count(end) : 0;
      for (std::uint64_t face = 0; face < face_count; ++face) {
        const std::uint64_t sides = take_count(end);
        for (std::uint64_t i = 0; i < sides; ++i) faces.points.push_back(read_point_id(stream));
        taken += sides;
        faces.faces.push_back(static_cast<std::uint32_t>(faces.face_ends.size()));
        faces.face_ends.push_back(faces.points.size());
      }
      if (taken != end) stream.text().fail("faces as long as faceoffsets tell", "fewer");
      faces.cell_ends.push_back(faces.faces.size());
    }
    stream.require_end();
  }

  void read_face_arrays(VtkFaces& faces) const {
    read_ends("polyhedron_offsets", count_, faces.cell_ends);
    VtuNumbers ids =
        document_.open(document_.require(arrays_, "DataArray", "polyhedron_to_faces"), faces.cell_ends.back());
    std::uint64_t face_count = 0;
    for (std::uint64_t i = 0; i < faces.cell_ends.back(); ++i) {
      const std::uint64_t id = ids.values().count("a face's number");
      if (id >= most_entries_ || id > ~std::uint32_t{0}) ids.text().fail("a face's number", std::to_string(id));
      face_count = std::max(face_count, id + 1);
      faces.faces.push_back(static_cast<std::uint32_t>(id));
    }
    ids.require_end();
    read_ends("face_offsets", face_count, faces.face_ends);
    const std::uint64_t entries = face_count == 0 ? 0 : faces.face_ends.back();
    VtuNumbers points = document_.open(document_.require(arrays_, "DataArray", "face_connectivity"), entries);
    for (std::uint64_t i = 0; i < entries; ++i) faces.points.push_back(read_point_id(points));
    points.require_end();
  }

  const VtuDocument& document_;
  const pugi::xml_node arrays_, data_;
  const std::uint64_t count_, points_, most_entries_;
  VtkCells cells_;
};

}  // namespace

VtkCells read_vtu_cells(const VtuDocument& document, pugi::xml_node piece, std::uint64_t cells, std::uint64_t points,
                        const MeshLimits& limits) {
  return VtuCellReader(document, piece, cells, points, limits).read();
}

}  // namespace ccslice
