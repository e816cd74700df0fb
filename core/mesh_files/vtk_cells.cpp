// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtk_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh_files/bezier_nodes.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/second_order_cells.h"

namespace ccslice {
namespace {

/// A voxel counts its corners along x, then y, then z; a hexahedron goes round each face.
constexpr std::array<int, 8> kVoxelToHex = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::uint8_t kNoPlace = 255;
constexpr std::uint64_t kMostPolyhedronSides = 64;  // Of a polyhedron, and of its faces, that is looked at.

/// Where a cell's points of second order stand that SecondOrderCells lists, in its order.
std::vector<std::uint8_t> node_places(const VtkCellType& type, std::uint64_t points) {
  const auto consecutive = [](std::uint8_t first, std::size_t count) {
    std::vector<std::uint8_t> places;
    for (std::size_t i = 0; i < count; ++i) places.push_back(static_cast<std::uint8_t>(first + i));
    return places;
  };
  if (type.pyramid) {
    std::vector<std::uint8_t> places = {5, 6, 7, 8, kNoPlace, kNoPlace, kNoPlace, kNoPlace, 9, 10, 11, 12};
    if (points == 19) places.insert(places.end(), {kNoPlace, kNoPlace, kNoPlace, kNoPlace, 13, kNoPlace, kNoPlace});
    return places;
  }
  if (type.kind == CellKind::kTet) return consecutive(4, 6);
  if (type.kind == CellKind::kHex) {
    std::vector<std::uint8_t> places = consecutive(8, points - 8);
    if (points == 24) places.resize(19, kNoPlace);
    return places;
  }
  if (points == 21) return {6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19};
  std::vector<std::uint8_t> places = consecutive(6, points - 6);
  if (points == 12) places.resize(9, kNoPlace);  // The edges between the triangles have none.
  return places;
}

std::string_view name_of(std::uint16_t type) {
  constexpr std::uint16_t kPentagonalPrism = 15, kHexagonalPrism = 16;
  if (type == kPentagonalPrism) return ", pentagonal prisms";
  return type == kHexagonalPrism ? ", hexagonal prisms" : "";
}

std::string_view remedy_for(std::uint16_t type) {
  constexpr std::uint16_t kConvexPointSet = 41;
  return type == kConvexPointSet
             ? "convex sets of points tell no faces; save them as tetrahedra"
             : "only hexahedra, voxels, tetrahedra, wedges and pyramids are read, of any order, and polyhedra that are "
               "such cells: remesh the part with them";
}

}  // namespace

VtkCellAppender::VtkCellAppender(MeshFile& file) : file_(file) {
  file_.numbers.vertex_noun = "point";
  file_.numbers.cell_noun = "cell";
}

void VtkCellAppender::Tally::add(std::uint64_t number) {
  constexpr std::size_t kMostNamed = 5;
  if (count++ < kMostNamed) first_ids.push_back(static_cast<std::int64_t>(number));
}

std::string VtkCellAppender::Tally::ids() const {
  std::string text;
  for (const std::int64_t id : first_ids) text += (text.empty() ? "" : ", ") + std::to_string(id);
  return count > first_ids.size() ? text + ", ..." : text;
}

std::vector<std::uint32_t> VtkCellAppender::append(const VtkCells& cells, const TextScanner& scanner) {
  std::vector<std::uint32_t> appended;
  std::map<std::uint16_t, Tally> unknown;
  for (std::size_t cell = 0; cell < cells.types.size(); ++cell) {
    if (!cells.ghosts.empty() && cells.ghosts[cell]) continue;
    const VtkCellType& type = vtk_cell_type(cells.types[cell]);
    if (type.family == VtkFamily::kUnknown) {
      unknown[cells.types[cell]].add(cells.first_number + cell);
      continue;
    }
    if (type.family == VtkFamily::kFlat) {
      flat_.add(cells.first_number + cell);
      continue;
    }
    if (type.family == VtkFamily::kPolyhedron) {
      append_polyhedron(cells, cell, scanner);
    } else {
      append_cell(cells, cell, type, scanner);
    }
    appended.push_back(static_cast<std::uint32_t>(cell));
    file_.numbers.cells.push_back(cells.first_number + cell);
  }
  if (unknown.empty()) return appended;
  const auto& [type, tally] = *unknown.begin();
  const std::string s = tally.count == 1 ? "" : "s";
  const auto first = static_cast<std::size_t>(tally.first_ids.front()) - cells.first_number;
  scanner.fail_at(cells.type_places[first], ErrorCode::kMeshUnsupportedCell,
                  std::to_string(tally.count) + " cell" + s + " of VTK type " + std::to_string(type) +
                      std::string(name_of(type)) + " (cell" + s + " " + tally.ids() + ", counted from 0); " +
                      std::string(remedy_for(type)),
                  "cells", tally.first_ids);
}

void VtkCellAppender::append_cell(const VtkCells& cells, std::size_t cell, const VtkCellType& type,
                                  const TextScanner& scanner) {
  const std::uint64_t begin = cells.offsets[cell], points = cells.offsets[cell + 1] - begin;
  const bool only_second = type.family == VtkFamily::kFixed && points != type.points;
  const std::optional<int> degree = only_second ? std::nullopt : vtk_degree(type, points);
  if (!degree) {
    const bool fixed = type.family == VtkFamily::kFixed;
    const std::string what = fixed && type.points == type.corners() ? " corners" : " points";
    scanner.fail_at(
        cells.places[cell], ErrorCode::kFileSyntax,
        "cell " + std::to_string(cells.first_number + cell) + " (from 0) is of VTK type " +
            std::to_string(cells.types[cell]) +
            (fixed ? ", which has " + std::to_string(type.points) + what + ", but lists "
                   : ", which no degree gives as many points as it lists: ") +
            std::to_string(points) +
            (only_second && points > type.points ? "; quadratic cells have types of their own: 24, 25, 26, 29 or 32"
                                                 : ""),
        "cells", {static_cast<std::int64_t>(cells.first_number + cell)});
  }
  ControlMesh& mesh = file_.mesh;
  const bool voxel = cells.types[cell] == kVtkVoxel;
  for (std::uint64_t i = 0; i < type.corners(); ++i) {
    const std::uint64_t corner = voxel ? static_cast<std::uint64_t>(kVoxelToHex[i]) : i;
    mesh.cell_vertices.push_back(cells.connectivity[begin + corner]);
  }
  if (type.pyramid) mesh.cell_vertices.insert(mesh.cell_vertices.end(), 3, mesh.cell_vertices.back());
  mesh.cell_kinds.push_back(type.kind);
  if (type.family == VtkFamily::kBezier) {
    const auto first = cells.connectivity.begin() + static_cast<std::ptrdiff_t>(begin);
    bezier_points_.insert(bezier_points_.end(), first, first + static_cast<std::ptrdiff_t>(points));
    bezier_cells_.push_back({cells.first_number + cell, bezier_points_.size()});
  }
  if (*degree == 2) keep_nodes(cells, cell, type, scanner);
  higher_order_ += *degree == 3;
  if (*degree == 3) leave_out_nodes(cells, cell, type, scanner);
}

void VtkCellAppender::refuse_point(const VtkCells& cells, std::size_t cell, std::uint32_t point,
                                   const TextScanner& scanner) const {
  scanner.fail_at(cells.places[cell], ErrorCode::kMeshIndexOutOfRange,
                  "point id " + std::to_string(point) + "; the file has " + std::to_string(file_.mesh.vertex_count()) +
                      " points, counted from 0");
}

/// Notes the nodes beside the corners, so that none of them counts as a vertex that no cell uses.
void VtkCellAppender::leave_out_nodes(const VtkCells& cells, std::size_t cell, const VtkCellType& type,
                                      const TextScanner& scanner) {
  for (std::uint64_t i = cells.offsets[cell] + type.corners(); i < cells.offsets[cell + 1]; ++i) {
    const std::uint32_t node = cells.connectivity[i];
    if (node >= file_.mesh.vertex_count()) refuse_point(cells, cell, node, scanner);
    file_.left_out_nodes.push_back(node);
  }
}

void VtkCellAppender::keep_nodes(const VtkCells& cells, std::size_t cell, const VtkCellType& type,
                                 const TextScanner& scanner) {
  const std::uint64_t begin = cells.offsets[cell], points = cells.offsets[cell + 1] - begin;
  std::vector<std::uint8_t> places = node_places(type, points);
  const bool old = cells.old_hexahedra && type.family != VtkFamily::kFixed && type.kind == CellKind::kHex;
  if (old) std::swap(places[10], places[11]);
  SecondOrderCells& curved = file_.second_order;
  if (type.family == VtkFamily::kBezier) bezier_.push_back(curved.cells.size());
  curved.cells.push_back(static_cast<std::uint32_t>(file_.mesh.cell_count() - 1));
  curved.first_nodes.push_back(curved.nodes.size());
  for (const std::uint8_t place : places) {
    const std::uint32_t node = place == kNoPlace ? kNone : cells.connectivity[begin + place];
    if (node != kNone && node >= file_.mesh.vertex_count()) refuse_point(cells, cell, node, scanner);
    curved.nodes.push_back(node);
  }
  const bool has_others = points == 19 || points == 21 || (points == 15 && type.kind == CellKind::kTet);
  with_other_nodes_ += has_others;
  if (has_others) leave_out_nodes(cells, cell, type, scanner);
}

void VtkCellAppender::refuse_polyhedron(const VtkCells& cells, std::size_t cell, const std::string& what,
                                        const TextScanner& scanner) const {
  const std::uint64_t number = cells.first_number + cell;
  scanner.fail_at(cells.places[cell], ErrorCode::kMeshUnsupportedCell,
                  "cell " + std::to_string(number) + " (from 0), a polyhedron (VTK type 42), is " + what +
                      "; remesh the part with hexahedra, tetrahedra, wedges or pyramids",
                  "cells", {static_cast<std::int64_t>(number)});
}

/// The faces of a polyhedron, which are few.
std::vector<FaceRing> VtkCellAppender::rings_of(const VtkCells& cells, std::size_t cell,
                                                const TextScanner& scanner) const {
  std::vector<FaceRing> rings;
  const auto refuse_large = [&](std::uint64_t faces) {
    refuse_polyhedron(cells, cell, "one of " + std::to_string(faces) + " faces, which no cell has that is read",
                      scanner);
  };
  if (cells.faces) {
    const VtkFaces& all = *cells.faces;
    const std::uint64_t begin = cell == 0 ? 0 : all.cell_ends[cell - 1], end = all.cell_ends[cell];
    if (end - begin > kMostPolyhedronSides) refuse_large(end - begin);
    for (std::uint64_t i = begin; i < end; ++i) {
      const std::uint32_t face = all.faces[i];
      const std::uint64_t first = face == 0 ? 0 : all.face_ends[face - 1], last = all.face_ends[face];
      if (last - first > kMostPolyhedronSides) refuse_large(end - begin);
      const auto points = all.points.begin();
      rings.emplace_back(points + static_cast<std::ptrdiff_t>(first), points + static_cast<std::ptrdiff_t>(last));
    }
    return rings;
  }
  const std::uint64_t begin = cells.offsets[cell];
  std::span<const std::uint32_t> stream = std::span(cells.connectivity).subspan(begin, cells.offsets[cell + 1] - begin);
  const auto take = [&](std::uint64_t count) {
    if (count > stream.size()) {
      scanner.fail_at(cells.places[cell], ErrorCode::kFileSyntax,
                      "cell " + std::to_string(cells.first_number + cell) +
                          " (from 0), a polyhedron (VTK type 42), ends within its faces; write the file anew");
    }
    const auto taken = stream.first(count);
    stream = stream.subspan(count);
    return taken;
  };
  const std::uint32_t faces = take(1)[0];
  if (faces > kMostPolyhedronSides) refuse_large(faces);
  for (std::uint32_t face = 0; face < faces; ++face) {
    const std::uint32_t sides = take(1)[0];
    if (sides > kMostPolyhedronSides) refuse_large(faces);
    const auto points = take(sides);
    for (const std::uint32_t point : points) {
      if (point >= file_.mesh.vertex_count()) refuse_point(cells, cell, point, scanner);
    }
    rings.emplace_back(points.begin(), points.end());
  }
  return rings;
}

void VtkCellAppender::append_polyhedron(const VtkCells& cells, std::size_t cell, const TextScanner& scanner) {
  const std::vector<FaceRing> rings = rings_of(cells, cell, scanner);
  const std::optional<CornersOfPolyhedron> found = corners_of_polyhedron(rings);
  if (!found) refuse_polyhedron(cells, cell, describe_polyhedron(rings), scanner);
  ControlMesh& mesh = file_.mesh;
  mesh.cell_kinds.push_back(found->kind);
  mesh.cell_vertices.insert(mesh.cell_vertices.end(), found->corners.begin(), found->corners.end());
}

void VtkCellAppender::refuse_rational_cells(std::span<const float> weights) const {
  constexpr float kSame = 1e-6f;
  Tally rational;
  std::pair<float, float> of_first;
  std::size_t begin = 0;
  for (const BezierCell& cell : bezier_cells_) {
    float least = weights[bezier_points_[begin]], most = least;
    bool same = true;
    for (; begin < cell.end_point; ++begin) {
      const float weight = weights[bezier_points_[begin]];
      least = std::min(least, weight);
      most = std::max(most, weight);
      same = same && most - least <= kSame * std::abs(most);  // Not if one is NaN.
    }
    if (same) continue;
    if (rational.count == 0) of_first = {least, most};
    rational.add(cell.number);
  }
  if (rational.count == 0) return;
  constexpr int kDigits = 6;
  throw Error(ErrorCode::kMeshUnsupportedCell,
              std::to_string(rational.count) + " rational Bezier cell" + (rational.count == 1 ? "" : "s") + " (cell" +
                  (rational.count == 1 ? " " : "s ") + rational.ids() + ", counted from 0; " + kRationalWeights +
                  " of the first from " + number_text(of_first.first, kDigits) + " to " +
                  number_text(of_first.second, kDigits) +
                  "), of which only those with equal weights are read; save the part with Lagrange cells of second "
                  "order, or with straight ones that are small enough",
              "cells", rational.first_ids);
}

void VtkCellAppender::finish_bezier_cells(std::span<const float> weights) {
  if (!weights.empty()) refuse_rational_cells(weights);
  make_nodes_of_control_points(bezier_, file_);
}

void VtkCellAppender::warn() {
  const auto note = [&](std::size_t count, const std::string& text) {
    if (count > 0) file_.warnings.push_back(std::to_string(count) + " " + text);
  };
  note_higher_order(higher_order_, "in second order", file_);
  note(with_other_nodes_, "cells have nodes in the middle of triangles or of themselves, which are left out");
  note(flat_.count, "points, lines or faces among the cells left out (cells " + flat_.ids() + ")");
}

}  // namespace ccslice
