// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtk_cell_types.h"

#include <array>

namespace ccslice {
namespace {

constexpr int kTypes = 256;

constexpr std::array<VtkCellType, kTypes> make_vtk_cell_types() {
  std::array<VtkCellType, kTypes> types{};
  for (const int flat : {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  21, 22, 23, 28, 30, 34,
                         35, 36, 51, 52, 53, 54, 60, 61, 62, 63, 68, 69, 70, 75, 76, 77}) {
    types[static_cast<std::size_t>(flat)].family = VtkFamily::kFlat;
  }
  using enum VtkFamily;
  types[10] = {kFixed, CellKind::kTet, false, 4};
  types[kVtkVoxel] = {kFixed, CellKind::kHex, false, 8};
  types[12] = {kFixed, CellKind::kHex, false, 8};
  types[13] = {kFixed, CellKind::kWedge, false, 6};
  types[14] = {kFixed, CellKind::kHex, true, 5};
  types[24] = {kFixed, CellKind::kTet, false, 10};
  types[25] = {kFixed, CellKind::kHex, false, 20};
  types[26] = {kFixed, CellKind::kWedge, false, 15};
  types[27] = {kFixed, CellKind::kHex, true, 13};
  types[29] = {kFixed, CellKind::kHex, false, 27};
  types[31] = {kFixed, CellKind::kWedge, false, 12};
  types[32] = {kFixed, CellKind::kWedge, false, 18};
  types[33] = {kFixed, CellKind::kHex, false, 24};
  types[37] = {kFixed, CellKind::kHex, true, 19};
  types[kVtkPolyhedron] = {kPolyhedron};
  types[71] = {kLagrange, CellKind::kTet};
  types[72] = {kLagrange, CellKind::kHex};
  types[73] = {kLagrange, CellKind::kWedge};
  types[74] = {kLagrange, CellKind::kHex, true};
  types[78] = {kBezier, CellKind::kTet};
  types[79] = {kBezier, CellKind::kHex};
  types[80] = {kBezier, CellKind::kWedge};
  types[81] = {kBezier, CellKind::kHex, true};
  return types;
}

constexpr std::array<VtkCellType, kTypes> kVtkCellTypes = make_vtk_cell_types();

/// Whether a product of two numbers beyond 1 gives it.
bool is_composite(std::uint64_t number) {
  for (std::uint64_t a = 2; a * a <= number; ++a) {
    if (number % a == 0) return true;
  }
  return false;
}

bool fits_hexahedron(std::uint64_t points) {
  for (std::uint64_t a = 2; a * a * a <= points; ++a) {
    if (points % a == 0 && is_composite(points / a)) return true;
  }
  return false;
}

/// Triangles of points, at least two.
bool fits_wedge(std::uint64_t points) {
  for (std::uint64_t side = 2; side * (side + 1) <= points; ++side) {
    const std::uint64_t triangle = side * (side + 1) / 2;
    if (points % triangle == 0) return true;
  }
  return false;
}

/// Whether sums of what `layer` gives for 1, 2, 3, ... come to it.
template <typename Layer>
bool is_sum_of_layers(std::uint64_t points, Layer layer) {
  std::uint64_t sum = 0;
  for (std::uint64_t side = 1; sum < points; ++side) sum += layer(side);
  return sum == points;
}

bool fits_degrees(const VtkCellType& type, std::uint64_t points) {
  if (type.pyramid) return is_sum_of_layers(points, [](std::uint64_t side) { return side * side; });
  switch (type.kind) {
    case CellKind::kHex: return fits_hexahedron(points);
    case CellKind::kWedge: return fits_wedge(points);
    case CellKind::kTet: break;
  }
  return is_sum_of_layers(points, [](std::uint64_t side) { return side * (side + 1) / 2; });
}

/// With the middles of triangles and of the cell too, tetrahedra have 15 points and wedges 21.
bool has_second_degree(const VtkCellType& type, std::uint64_t points) {
  if (type.pyramid) return false;  // VTK keeps the type's number only.
  switch (type.kind) {
    case CellKind::kHex: return points == 27;
    case CellKind::kWedge: return points == 18 || points == 21;
    case CellKind::kTet: break;
  }
  return points == 10 || points == 15;
}

}  // namespace

const VtkCellType& vtk_cell_type(std::uint16_t type) {
  static constexpr VtkCellType kUnknown{};
  return type < kTypes ? kVtkCellTypes[type] : kUnknown;
}

std::optional<int> vtk_degree(const VtkCellType& type, std::uint64_t points) {
  if (points == type.corners()) return 1;
  if (type.family == VtkFamily::kFixed) return points == type.points ? std::optional(2) : std::nullopt;
  if (points < type.corners()) return std::nullopt;
  if (has_second_degree(type, points)) return 2;
  return fits_degrees(type, points) ? std::optional(3) : std::nullopt;
}

}  // namespace ccslice
