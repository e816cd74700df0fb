// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/vtu_file.h"

#include <bit>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

#include "client/cli/xml.h"
#include "core/mesh/cell_kind.h"

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

void add_points(XmlWriter& xml, const ControlMesh& mesh) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.vertex_count());
  for (const Vec3& position : mesh.positions) coordinates.insert(coordinates.end(), position.begin(), position.end());
  xml.begin("Points");
  add_array(xml, "Points", coordinates, 3);
  xml.end();
}

void add_cells(XmlWriter& xml, const ControlMesh& mesh) {
  std::vector<std::int64_t> offsets;
  std::vector<std::uint8_t> types;
  std::int64_t end = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    offsets.push_back(end += corner_count(kind));
    types.push_back(static_cast<std::uint8_t>(kCellKinds[static_cast<std::size_t>(kind)].vtk_type));
  }
  xml.begin("Cells");
  add_array(xml, "connectivity", std::vector<std::int64_t>(mesh.cell_vertices.begin(), mesh.cell_vertices.end()));
  add_array(xml, "offsets", offsets);
  add_array(xml, "types", types);
  xml.end();
}

void add_channels(XmlWriter& xml, const ControlMesh& mesh) {
  xml.begin("PointData");
  std::vector<float> values(mesh.vertex_count());
  for (std::size_t c = 0; c < mesh.channel_count(); ++c) {
    for (std::size_t v = 0; v < values.size(); ++v) values[v] = mesh.channel_values[v * mesh.channel_count() + c];
    add_array(xml, mesh.channel_names[c], values);
  }
  xml.end();
}

}  // namespace

std::string to_vtu(const ControlMesh& mesh, std::span<const std::uint32_t> control_cells) {
  XmlWriter xml;
  xml.begin("VTKFile").attribute("type", "UnstructuredGrid").attribute("version", "1.0");
  xml.attribute("byte_order", "LittleEndian").attribute("header_type", "UInt64").begin("UnstructuredGrid");
  xml.begin("Piece").attribute("NumberOfPoints", mesh.vertex_count()).attribute("NumberOfCells", mesh.cell_count());
  add_points(xml, mesh);
  add_cells(xml, mesh);
  add_channels(xml, mesh);
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

}  // namespace ccslice::cli
