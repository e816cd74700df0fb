// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/vtu_file.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/base/xml.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh_import/mid_nodes.h"

namespace ccslice::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "byte_order says so");

template <typename T>
constexpr std::string_view kTypeName = "";
template <>
constexpr std::string_view kTypeName<double> = "Float64";
template <>
constexpr std::string_view kTypeName<float> = "Float32";
template <>
constexpr std::string_view kTypeName<std::int64_t> = "Int64";
template <>
constexpr std::string_view kTypeName<std::uint32_t> = "UInt32";
template <>
constexpr std::string_view kTypeName<std::uint8_t> = "UInt8";

/// RFC 4648, with padding.
std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      group = group << 8 | (at + i < bytes.size() ? static_cast<unsigned char>(bytes[at + i]) : 0);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      text += at + i <= bytes.size() ? kDigits[group >> (18 - 6 * i) & 63] : '=';
    }
  }
  return text;
}

/// The header, which counts bytes, and the data are one text.
template <typename T>
std::string encoded(const std::vector<T>& items) {
  const std::uint64_t size = items.size() * sizeof(T);
  std::string bytes(sizeof(size) + size, '\0');
  std::memcpy(bytes.data(), &size, sizeof(size));
  if (size > 0) std::memcpy(bytes.data() + sizeof(size), items.data(), size);
  return base64(bytes);
}

template <typename T>
void add_array(XmlWriter& xml, std::string_view name, const std::vector<T>& items, int components = 1) {
  xml.begin("DataArray").attribute("type", kTypeName<T>).attribute("Name", name);
  xml.attribute("NumberOfComponents", components).attribute("format", "binary").text(encoded(items)).end();
}

void add_points(XmlWriter& xml, const std::vector<Vec3>& points) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vec3& point : points) coordinates.insert(coordinates.end(), point.begin(), point.end());
  xml.begin("Points");
  add_array(xml, "Points", coordinates, 3);
  xml.end();
}

/// `sizes`: of each cell's points.
template <typename Sizes>
void add_cells(XmlWriter& xml, const std::vector<std::int64_t>& points, const Sizes& sizes,
               const std::vector<std::uint8_t>& types) {
  std::vector<std::int64_t> offsets;
  std::int64_t end = 0;
  for (const auto size : sizes) offsets.push_back(end += static_cast<std::int64_t>(size));
  xml.begin("Cells");
  add_array(xml, "connectivity", points);
  add_array(xml, "offsets", offsets);
  add_array(xml, "types", types);
  xml.end();
}

/// The nodes of a cell's edges, in VTK's order, as points: they follow after the vertices. Edges without one are left
/// out.
std::vector<std::int64_t> edge_nodes(const ControlMesh& mesh, CellKind kind, std::span<const std::uint32_t> corners) {
  std::vector<std::int64_t> points;
  for (const auto& [a, b] : mid_edges(kind)) {
    const std::optional<std::size_t> node = edge_node(mesh.mid_nodes, {corners[a], corners[b]});
    if (node) points.push_back(static_cast<std::int64_t>(mesh.vertex_count() + *node));
  }
  return points;
}

template <typename Visit>
void for_each_control_cell(const ControlMesh& mesh, Visit visit) {
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    const auto corners = static_cast<std::size_t>(corner_count(kind));
    visit(kind, std::span(mesh.cell_vertices).subspan(begin, corners));
    begin += corners;
  }
}

std::uint8_t vtk_type_of(CellKind kind, bool second_order) {
  if (!second_order) return static_cast<std::uint8_t>(kCellKinds[static_cast<std::size_t>(kind)].vtk_type);
  constexpr std::uint8_t kQuadraticTetra = 24, kQuadraticHexahedron = 25, kQuadraticWedge = 26;
  if (kind == CellKind::kHex) return kQuadraticHexahedron;
  return kind == CellKind::kTet ? kQuadraticTetra : kQuadraticWedge;
}

void add_control_cells(XmlWriter& xml, const ControlMesh& mesh, bool with_nodes) {
  std::vector<std::int64_t> points;
  std::vector<std::uint8_t> types;
  std::vector<std::size_t> sizes;
  for_each_control_cell(mesh, [&](CellKind kind, std::span<const std::uint32_t> corners) {
    points.insert(points.end(), corners.begin(), corners.end());
    const auto nodes = with_nodes ? edge_nodes(mesh, kind, corners) : std::vector<std::int64_t>();
    points.insert(points.end(), nodes.begin(), nodes.end());
    sizes.push_back(corners.size() + nodes.size());
    types.push_back(vtk_type_of(kind, !nodes.empty()));
  });
  add_cells(xml, points, sizes, types);
}

/// Where VTK has point (i, j, k) of a hexahedron of degree 3: corners, then the points of edges, faces, the inside
/// [vtkHigherOrderHexahedron::PointIndexFromIJK, VTK 9].
std::size_t vtk_bezier_point(std::size_t i, std::size_t j, std::size_t k) {
  constexpr std::size_t kInner = 2;  // Of an edge.
  const auto at_end = [](std::size_t at) { return at == 0 || at == 3; };
  const std::size_t around = i != 0 ? (j != 0 ? 2 : 1) : (j != 0 ? 3 : 0);  // Of four along k.
  const int ends = at_end(i) + at_end(j) + at_end(k);
  if (ends == 3) return around + (k != 0 ? 4 : 0);
  constexpr std::size_t kEdges = 8, kFaces = kEdges + 12 * kInner, kInside = kFaces + 6 * kInner * kInner;
  if (ends == 2) {
    const std::size_t layer = k != 0 ? 4 : 0;
    if (!at_end(i)) return kEdges + kInner * (layer + (j != 0 ? 2 : 0)) + i - 1;
    if (!at_end(j)) return kEdges + kInner * (layer + (i != 0 ? 1 : 3)) + j - 1;
    return kEdges + kInner * (8 + around) + k - 1;
  }
  const auto in_face = [](std::size_t a, std::size_t b) { return a - 1 + kInner * (b - 1); };
  if (at_end(i)) return kFaces + (i != 0 ? 4 : 0) + in_face(j, k);
  if (at_end(j)) return kFaces + (j != 0 ? 12 : 8) + in_face(i, k);
  if (at_end(k)) return kFaces + (k != 0 ? 20 : 16) + in_face(i, j);
  return kInside + in_face(i, j) + kInner * kInner * (k - 1);
}

void add_bezier_cells(XmlWriter& xml, const BezierCells& cells) {
  constexpr std::uint8_t kBezierHexahedron = 79, kHexahedron = 12;
  std::vector<std::int64_t> points(cells.cell_points.size());
  std::vector<int> sizes;
  std::vector<std::uint8_t> types;
  std::size_t begin = 0;
  for (const std::uint8_t order : cells.cell_orders) {
    const std::size_t side = order + 1u;
    const std::size_t size = side * side * side;
    for (std::size_t p = 0; p < size; ++p) {
      const std::size_t place =
          order == 1 ? vtk_to_bits(static_cast<std::uint8_t>(p)) : vtk_bezier_point(p % 4, p / 4 % 4, p / 16);
      points[begin + place] = cells.cell_points[begin + p];
    }
    sizes.push_back(static_cast<int>(size));
    types.push_back(order == 1 ? kHexahedron : kBezierHexahedron);
    begin += size;
  }
  add_cells(xml, points, sizes, types);
}

/// What names are called in a document, each another way: those that XML can't hold get a number where the characters
/// that stand for theirs make them alike.
std::vector<std::string> names_in_xml(const std::vector<std::string>& names) {
  std::vector<std::string> written;
  std::set<std::string> taken;
  for (const std::string& name : names) {
    written.push_back(xml_characters(name));
    if (written.back() == name) taken.insert(name);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (written[i] == names[i]) continue;
    const std::string plain = written[i];
    for (int number = 2; !taken.insert(written[i]).second; ++number) {
      written[i] = plain;
      written[i] += '_' + std::to_string(number);
    }
  }
  return written;
}

void add_channels(XmlWriter& xml, const std::vector<std::string>& channel_names, const std::vector<float>& rows,
                  std::size_t points) {
  const std::vector<std::string> names = names_in_xml(channel_names);
  xml.begin("PointData");
  std::vector<float> values(points);
  for (std::size_t c = 0; c < names.size(); ++c) {
    for (std::size_t v = 0; v < values.size(); ++v) values[v] = rows[v * names.size() + c];
    add_array(xml, names[c], values);
  }
  xml.end();
}

/// Field data are of the whole file, and say of themselves how many tuples they are.
void add_region_names(XmlWriter& xml, const std::vector<std::string>& region_names) {
  if (region_names.empty()) return;
  const std::vector<std::string> names = names_in_xml(region_names);
  xml.begin("FieldData");
  for (std::size_t region = 0; region < names.size(); ++region) {
    xml.begin("DataArray").attribute("type", kTypeName<std::uint8_t>).attribute("Name", "cell_region:" + names[region]);
    xml.attribute("NumberOfTuples", 1).attribute("format", "ascii").text(std::to_string(region)).end();
  }
  xml.end();
}

/// `version`: from 2.1 on hexahedra of higher degree are in VTK 9's order.
void begin_piece(XmlWriter& xml, std::string_view version, std::size_t points, std::size_t cells,
                 const std::vector<std::string>& region_names) {
  xml.begin("VTKFile").attribute("type", "UnstructuredGrid").attribute("version", version);
  xml.attribute("byte_order", "LittleEndian").attribute("header_type", "UInt64").begin("UnstructuredGrid");
  add_region_names(xml, region_names);
  xml.begin("Piece").attribute("NumberOfPoints", points).attribute("NumberOfCells", cells);
}

/// The items and then more of them, all in `room`; without more the items where they are, which may be many.
template <typename T>
const std::vector<T>& concatenated(const std::vector<T>& items, const std::vector<T>& more, std::vector<T>& room) {
  if (more.empty()) return items;
  room = items;
  room.insert(room.end(), more.begin(), more.end());
  return room;
}

}  // namespace

bool vtu_keeps_mid_nodes(const ControlMesh& mesh) {
  const MidNodes& nodes = mesh.mid_nodes;
  if (nodes.empty()) return true;
  bool keeps = nodes.faces.empty() && nodes.cells.empty() && mesh.region_value_vertices.empty();
  for_each_control_cell(mesh, [&](CellKind kind, std::span<const std::uint32_t> corners) {
    if (!keeps) return;
    const std::size_t count = edge_nodes(mesh, kind, corners).size();
    keeps = count == 0 || count == mid_edges(kind).size();
  });
  return keeps;
}

std::string to_vtu(const ControlMesh& mesh, std::span<const std::uint32_t> control_cells) {
  const bool with_nodes = !mesh.mid_nodes.empty() && vtu_keeps_mid_nodes(mesh);
  const MidNodes nodes = with_nodes ? mesh.mid_nodes : MidNodes();
  std::vector<Vec3> point_room;
  std::vector<float> value_room;
  const std::vector<Vec3>& points = concatenated(mesh.positions, nodes.positions, point_room);
  XmlWriter xml;
  begin_piece(xml, "1.0", points.size(), mesh.cell_count(), mesh.cell_region_names);
  add_points(xml, points);
  add_control_cells(xml, mesh, with_nodes);
  add_channels(xml, mesh.channel_names, concatenated(mesh.channel_values, nodes.values, value_room), points.size());
  if (!control_cells.empty() || !mesh.cell_regions.empty()) {
    xml.begin("CellData");
    if (!control_cells.empty()) {
      add_array(xml, "control_cell", std::vector<std::uint32_t>(control_cells.begin(), control_cells.end()));
    }
    if (!mesh.cell_regions.empty()) add_array(xml, "cell_region", mesh.cell_regions);
    xml.end();
  }
  return xml.end().end().end().text() + "\n";
}

std::string to_vtu(const BezierCells& cells, const std::vector<std::string>& channel_names,
                   const std::vector<std::string>& region_names) {
  XmlWriter xml;
  begin_piece(xml, "2.1", cells.points.size(), cells.cell_orders.size(), region_names);
  add_points(xml, cells.points);
  add_bezier_cells(xml, cells);
  add_channels(xml, channel_names, cells.channel_values, cells.points.size());
  std::vector<std::uint8_t> degrees;
  for (const std::uint8_t order : cells.cell_orders) degrees.insert(degrees.end(), 3, order);
  xml.begin("CellData").attribute("HigherOrderDegrees", "HigherOrderDegrees");
  add_array(xml, "HigherOrderDegrees", degrees, 3);
  add_array(xml, "control_cell", cells.control_cells);
  if (!cells.cell_regions.empty()) add_array(xml, "cell_region", cells.cell_regions);
  xml.end();
  return xml.end().end().end().text() + "\n";
}

}  // namespace ccslice::cli
