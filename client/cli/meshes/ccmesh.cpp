// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/ccmesh.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <set>

#include "client/cli/base/json.h"
#include "client/cli/base/json_scanner.h"
#include "core/base/error.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::RepeatedField;

/// More than any mesh has; protobuf counts in ints.
constexpr int kMostItems = 1 << 30;

template <typename Number, typename Read>
void read_numbers(JsonScanner& scanner, RepeatedField<Number>& numbers, Read&& read) {
  for_each_item(scanner, [&] {
    if (numbers.size() == kMostItems) scanner.fail_with(ErrorCode::kMeshTooLarge, "too many numbers");
    numbers.Add(static_cast<Number>(read()));
  });
}

void read_ids(JsonScanner& scanner, RepeatedField<std::uint32_t>& ids) {
  constexpr auto kLargest = std::numeric_limits<std::uint32_t>::max();
  read_numbers(scanner, ids, [&] { return scanner.integer("a vertex id (from 0)", 0, kLargest); });
}

void read_regions(JsonScanner& scanner, RepeatedField<std::uint32_t>& regions) {
  read_numbers(scanner, regions, [&] { return scanner.integer("a cell region's index (from 0)", 0, kMostItems); });
}

void read_cells(JsonScanner& scanner, RepeatedField<std::uint32_t>& cells) {
  constexpr auto kLargest = std::numeric_limits<std::uint32_t>::max();
  read_numbers(scanner, cells, [&] { return scanner.integer("a cell's number (from 0)", 0, kLargest); });
}

void read_coordinates(JsonScanner& scanner, RepeatedField<double>& coordinates) {
  read_numbers(scanner, coordinates, [&] { return scanner.real("a coordinate"); });
}

void read_values(JsonScanner& scanner, std::string_view expected, RepeatedField<float>& values) {
  read_numbers(scanner, values, [&] { return scanner.real_float(expected); });
}

bool read_flag(JsonScanner& scanner) { return scanner.boolean("true or false"); }

int read_kind(JsonScanner& scanner) {
  constexpr std::string_view kExpected = "a cell's kind, such as \"CELL_KIND_HEX\"";
  if (!scanner.at_string()) return static_cast<int>(scanner.integer(kExpected, 0, std::numeric_limits<int>::max()));
  v1::CellKind kind{};
  if (!v1::CellKind_Parse(scanner.string(kExpected), &kind)) scanner.fail(kExpected);
  return kind;
}

void read_field(JsonScanner& scanner, int field, v1::ControlMesh& mesh) {
  switch (field) {
    case v1::ControlMesh::kPositionsMmFieldNumber: return read_coordinates(scanner, *mesh.mutable_positions_mm());
    case v1::ControlMesh::kChannelNamesFieldNumber:
      return for_each_item(scanner, [&] { mesh.add_channel_names(scanner.string("a channel's name")); });
    case v1::ControlMesh::kChannelValuesFieldNumber:
      return read_values(scanner, "a channel's value", *mesh.mutable_channel_values());
    case v1::ControlMesh::kCellKindsFieldNumber:
      return read_numbers(scanner, *mesh.mutable_cell_kinds(), [&] { return read_kind(scanner); });
    case v1::ControlMesh::kCellVerticesFieldNumber: return read_ids(scanner, *mesh.mutable_cell_vertices());
    case v1::ControlMesh::kSharpEdgesFieldNumber: return read_ids(scanner, *mesh.mutable_sharp_edges());
    case v1::ControlMesh::kSharpVerticesFieldNumber: return read_ids(scanner, *mesh.mutable_sharp_vertices());
    case v1::ControlMesh::kCellRegionNamesFieldNumber:
      return for_each_item(scanner, [&] { mesh.add_cell_region_names(scanner.string("a cell region's name")); });
    case v1::ControlMesh::kCellRegionsFieldNumber: return read_regions(scanner, *mesh.mutable_cell_regions());
    case v1::ControlMesh::kRegionValueVerticesFieldNumber:
      return read_ids(scanner, *mesh.mutable_region_value_vertices());
    case v1::ControlMesh::kRegionValueRegionsFieldNumber:
      return read_regions(scanner, *mesh.mutable_region_value_regions());
    case v1::ControlMesh::kRegionValuesFieldNumber:
      return read_values(scanner, "a channel's value in a region", *mesh.mutable_region_values());
    case v1::ControlMesh::kAllowFoldsFieldNumber: return mesh.set_allow_folds(read_flag(scanner));
    case v1::ControlMesh::kInterpolatingFieldNumber: return mesh.set_interpolating(read_flag(scanner));
    case v1::ControlMesh::kMissedVerticesFieldNumber: return read_ids(scanner, *mesh.mutable_missed_vertices());
    case v1::ControlMesh::kMissedPositionsMmFieldNumber:
      return read_coordinates(scanner, *mesh.mutable_missed_positions_mm());
    case v1::ControlMesh::kAsMeshedFieldNumber: return mesh.set_as_meshed(read_flag(scanner));
    case v1::ControlMesh::kEdgeNodeVerticesFieldNumber: return read_ids(scanner, *mesh.mutable_edge_node_vertices());
    case v1::ControlMesh::kFaceNodeVerticesFieldNumber: return read_ids(scanner, *mesh.mutable_face_node_vertices());
    case v1::ControlMesh::kCellNodeCellsFieldNumber: return read_cells(scanner, *mesh.mutable_cell_node_cells());
    case v1::ControlMesh::kNodePositionsMmFieldNumber:
      return read_coordinates(scanner, *mesh.mutable_node_positions_mm());
    case v1::ControlMesh::kNodeValuesFieldNumber:
      return read_values(scanner, "a channel's value", *mesh.mutable_node_values());
    default: throw Error(ErrorCode::kInternal, "a field of ControlMesh that the JSON reader lacks");
  }
}

/// A field by its name in JSON or in the contract.
const FieldDescriptor& read_name(JsonScanner& scanner) {
  const auto& fields = *v1::ControlMesh::descriptor();
  constexpr std::string_view kExpected = "the name of a field of ccslice.v1.ControlMesh, such as \"positionsMm\"";
  const std::string name = scanner.string(kExpected);
  const FieldDescriptor* field = fields.FindFieldByCamelcaseName(name);
  if (!field) field = fields.FindFieldByName(name);
  if (!field) scanner.fail(kExpected);
  return *field;
}

v1::ControlMesh parse_json(std::string_view text) {
  JsonScanner scanner(text);
  v1::ControlMesh mesh;
  std::set<int> seen;
  scanner.require('{', "'{'");
  if (!scanner.take('}')) {
    do {
      const FieldDescriptor& field = read_name(scanner);
      if (!seen.insert(field.number()).second) {
        scanner.fail_with(ErrorCode::kFileSyntax, "a second '" + field.json_name() + "'");
      }
      scanner.require(':', "':'");
      if (!scanner.take_null()) read_field(scanner, field.number(), mesh);
    } while (scanner.take(','));
    scanner.require('}', "',' or '}'");
  }
  scanner.require_end();
  if (mesh.cell_kinds().empty()) throw Error(ErrorCode::kMeshEmpty, "the JSON has no cellKinds", "cell_kinds");
  return mesh;
}

/// The shortest decimal that reads back as the same number. Readers take "-0" for an integer, which has no sign.
template <typename Number>
std::string lossless(Number number) {
  return number == 0 && std::signbit(number) ? "-0.0" : shortest(number);
}

template <typename Items, typename Write>
void write_list(JsonWriter& json, const char* name, const Items& items, Write&& write) {
  if (items.empty()) return;
  json.key(name).begin_array();
  for (const auto& item : items) write(item);
  json.end_array();
}

}  // namespace

bool is_json(std::string_view bytes) {
  bytes = without_utf8_mark(bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && bytes[first] == '{';
}

v1::ControlMesh parse_ccmesh(const std::string& bytes) {
  v1::ControlMesh mesh;
  if (bytes.empty()) throw Error(ErrorCode::kFileUnsupported, "the file is empty");
  if (is_json(bytes)) return parse_json(without_utf8_mark(bytes));
  if (const UnreadFile unread = describe_unread(bytes); unread.known) {
    throw Error(ErrorCode::kFileUnsupported, unread.text);
  }
  if (!mesh.ParseFromString(bytes) || mesh.cell_kinds().empty()) {
    throw Error(ErrorCode::kFileUnsupported, describe_unread(bytes).text +
                                                 ", nor a ccslice.v1.ControlMesh, be it serialized (.ccmesh) or JSON; "
                                                 "for other formats try 'meshio convert FILE part.vtk' first");
  }
  return mesh;
}

std::string to_json(const v1::ControlMesh& mesh) {
  JsonWriter json;
  const auto write_real = [&](auto number) { json.raw(lossless(number)); };
  const auto write_plain = [&](const auto& item) { json.value(item); };
  json.begin_object();
  write_list(json, "positionsMm", mesh.positions_mm(), write_real);
  write_list(json, "channelNames", mesh.channel_names(), write_plain);
  write_list(json, "channelValues", mesh.channel_values(), write_real);
  write_list(json, "cellKinds", mesh.cell_kinds(),
             [&](int kind) { json.value(v1::CellKind_Name(static_cast<v1::CellKind>(kind))); });
  write_list(json, "cellVertices", mesh.cell_vertices(), write_plain);
  write_list(json, "sharpEdges", mesh.sharp_edges(), write_plain);
  write_list(json, "sharpVertices", mesh.sharp_vertices(), write_plain);
  write_list(json, "cellRegionNames", mesh.cell_region_names(), write_plain);
  write_list(json, "cellRegions", mesh.cell_regions(), write_plain);
  write_list(json, "regionValueVertices", mesh.region_value_vertices(), write_plain);
  write_list(json, "regionValueRegions", mesh.region_value_regions(), write_plain);
  write_list(json, "regionValues", mesh.region_values(), write_real);
  if (mesh.allow_folds()) json.member("allowFolds", true);
  if (mesh.interpolating()) json.member("interpolating", true);
  write_list(json, "missedVertices", mesh.missed_vertices(), write_plain);
  write_list(json, "missedPositionsMm", mesh.missed_positions_mm(), write_real);
  if (mesh.as_meshed()) json.member("asMeshed", true);
  write_list(json, "edgeNodeVertices", mesh.edge_node_vertices(), write_plain);
  write_list(json, "faceNodeVertices", mesh.face_node_vertices(), write_plain);
  write_list(json, "cellNodeCells", mesh.cell_node_cells(), write_plain);
  write_list(json, "nodePositionsMm", mesh.node_positions_mm(), write_real);
  write_list(json, "nodeValues", mesh.node_values(), write_real);
  return json.end_object().text();
}

}  // namespace ccslice::cli
