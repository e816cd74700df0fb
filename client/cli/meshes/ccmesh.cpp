// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/ccmesh.h"

#include <google/protobuf/reflection.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "client/cli/base/json.h"
#include "client/cli/base/json_scanner.h"
#include "core/base/error.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice::cli {
namespace {

using google::protobuf::FieldDescriptor;

/// More than any mesh has; protobuf counts in ints.
constexpr int kMostItems = 1 << 30;

template <typename Number, typename Read>
void read_numbers(JsonScanner& scanner, const google::protobuf::MutableRepeatedFieldRef<Number>& numbers, Read&& read) {
  for_each_item(scanner, [&] {
    if (numbers.size() == kMostItems) scanner.fail_with(ErrorCode::kMeshTooLarge, "too many numbers");
    numbers.Add(static_cast<Number>(read()));
  });
}

int read_kind(JsonScanner& scanner) {
  constexpr std::string_view kExpected = "a cell's kind, such as \"CELL_KIND_HEX\"";
  if (!scanner.at_string()) return static_cast<int>(scanner.integer(kExpected, 0, std::numeric_limits<int>::max()));
  v1::CellKind kind{};
  if (!v1::CellKind_Parse(scanner.string(kExpected), &kind)) scanner.fail(kExpected);
  return kind;
}

std::int64_t read_number(JsonScanner& scanner, std::string_view field) {
  constexpr auto kLargest = std::numeric_limits<std::uint32_t>::max();
  if (field.ends_with("_regions")) return scanner.integer("a cell region's index (from 0)", 0, kMostItems);
  if (field.ends_with("_cells")) return scanner.integer("a cell's number (from 0)", 0, kLargest);
  return scanner.integer("a vertex id (from 0)", 0, kLargest);
}

void read_field(JsonScanner& scanner, const FieldDescriptor& field, v1::ControlMesh& mesh) {
  const google::protobuf::Reflection& fields = *mesh.GetReflection();
  const bool of_region = field.name().find("region") != std::string::npos;
  if (!field.is_repeated()) return fields.SetBool(&mesh, &field, scanner.boolean("true or false"));
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      return for_each_item(scanner, [&] {
        fields.AddString(&mesh, &field, scanner.string(of_region ? "a cell region's name" : "a channel's name"));
      });
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return read_numbers(scanner, fields.GetMutableRepeatedFieldRef<double>(&mesh, &field),
                          [&] { return scanner.real("a coordinate"); });
    case FieldDescriptor::CPPTYPE_FLOAT:
      return read_numbers(scanner, fields.GetMutableRepeatedFieldRef<float>(&mesh, &field), [&] {
        return scanner.real_float(of_region ? "a channel's value in a region" : "a channel's value");
      });
    case FieldDescriptor::CPPTYPE_ENUM:
      return read_numbers(scanner, fields.GetMutableRepeatedFieldRef<std::int32_t>(&mesh, &field),
                          [&] { return read_kind(scanner); });
    default:
      return read_numbers(scanner, fields.GetMutableRepeatedFieldRef<std::uint32_t>(&mesh, &field),
                          [&] { return read_number(scanner, field.name()); });
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
      if (!scanner.take_null()) read_field(scanner, field, mesh);
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

template <typename Item, typename Write>
void write_items(const v1::ControlMesh& mesh, const FieldDescriptor& field, const Write& write) {
  for (const Item& item : mesh.GetReflection()->GetRepeatedFieldRef<Item>(mesh, &field)) write(item);
}

void write_list(const v1::ControlMesh& mesh, const FieldDescriptor& field, JsonWriter& json) {
  json.key(field.json_name()).begin_array();
  const auto write_real = [&](auto number) { json.raw(lossless(number)); };
  const auto write_plain = [&](const auto& item) { json.value(item); };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING: write_items<std::string>(mesh, field, write_plain); break;
    case FieldDescriptor::CPPTYPE_DOUBLE: write_items<double>(mesh, field, write_real); break;
    case FieldDescriptor::CPPTYPE_FLOAT: write_items<float>(mesh, field, write_real); break;
    case FieldDescriptor::CPPTYPE_ENUM:
      write_items<std::int32_t>(mesh, field,
                                [&](int kind) { json.value(v1::CellKind_Name(static_cast<v1::CellKind>(kind))); });
      break;
    default: write_items<std::uint32_t>(mesh, field, write_plain);
  }
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
  const google::protobuf::Reflection& fields = *mesh.GetReflection();
  std::vector<const FieldDescriptor*> present;
  fields.ListFields(mesh, &present);
  JsonWriter json;
  json.begin_object();
  for (const FieldDescriptor* field : present) {
    field->is_repeated() ? write_list(mesh, *field, json)
                         : static_cast<void>(json.member(field->json_name(), fields.GetBool(mesh, field)));
  }
  return json.end_object().text();
}

}  // namespace ccslice::cli
