// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtu_document.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh_files/unread_formats.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {
namespace {

constexpr unsigned kParsed = pugi::parse_cdata | pugi::parse_escapes | pugi::parse_declaration;
constexpr std::string_view kAppended = "<AppendedData";

TextScanner naming_bytes(std::string_view bytes) {
  TextScanner scanner(bytes);
  scanner.name_byte_offsets();
  return scanner;
}

/// What to do about a data set of that type.
std::string remedy_for(std::string_view type) {
  if (type == "Collection" || type == "vtkMultiBlockDataSet" || type.starts_with("vtkPartitionedDataSet")) {
    return "it names other files: give the .vtu that is meant, or merge them into one .vtu in ParaView (Merge Blocks)";
  }
  if (type == "PolyData") return "it holds a surface only; " + kNeedsVolumeCells;
  if (type.starts_with('P')) {
    return "merge its pieces into one .vtu, as ParaView does when it saves a data set";
  }
  return "save the mesh as UnstructuredGrid (.vtu)";
}

VtuCompressor compressor_called(std::string_view name) {
  if (name.empty()) return VtuCompressor::kNone;
  if (name == "vtkZLibDataCompressor") return VtuCompressor::kZlib;
  if (name == "vtkLZ4DataCompressor") return VtuCompressor::kLz4;
  return name == "vtkLZMADataCompressor" ? VtuCompressor::kLzma : VtuCompressor::kUnknown;
}

/// Fortran programs write "+11047".
std::string_view without_plus(std::string_view number) { return number.starts_with('+') ? number.substr(1) : number; }

/// The array's text: there may be other elements beside it.
pugi::xml_node text_of(pugi::xml_node array) {
  for (const pugi::xml_node child : array.children()) {
    const bool text = child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata;
    if (text && std::string_view(child.value()).find_first_not_of(" \t\r\n") != std::string_view::npos) return child;
  }
  return {};
}

}  // namespace

VtuNumbers::VtuNumbers(std::string_view text, std::uint64_t at) : scanner_(text) {
  scanner_.text().name_byte_offsets(at);
}

VtuNumbers::VtuNumbers(std::string bytes, std::uint64_t at, std::string_view type, bool big_endian)
    : bytes_(std::move(bytes)), scanner_(bytes_) {
  scanner_.text().name_one_byte(at);
  scanner_.open_block(type, big_endian);
}

void VtuNumbers::require_end() {
  if (!values().binary() && !text().at_end()) text().fail("the end of the array", text().peek());
}

VtuDocument::VtuDocument(std::string_view bytes) : bytes_(bytes), place_(naming_bytes(bytes)) {
  cut_appended_data();
  const pugi::xml_parse_result result =
      document_.load_buffer_inplace(xml_.data(), xml_.size(), kParsed, pugi::encoding_utf8);
  if (!result) {
    place_.fail_at(static_cast<std::uint64_t>(result.offset), ErrorCode::kFileSyntax,
                   std::string("the file isn't whole XML (") + result.description() + "); write it anew");
  }
  const pugi::xml_node declaration = document_.first_child();
  const std::string_view encoding = declaration.attribute("encoding").value();
  if (declaration.type() == pugi::node_declaration && !encoding.empty() && !equals_ignoring_case(encoding, "UTF-8") &&
      !equals_ignoring_case(encoding, "US-ASCII")) {
    fail(declaration, ErrorCode::kFileUnsupported,
         "encoding " + in_quotes(printable(encoding)) + " is not read; save it as UTF-8");
  }
  read_coding(document_.child("VTKFile"));
}

void VtuDocument::cut_appended_data() {
  const std::size_t begin = bytes_.find(kAppended);
  xml_ = bytes_.substr(0, begin);
  if (begin == std::string_view::npos) return;
  xml_ += "</VTKFile>";
  has_appended_ = true;
  const std::size_t tag_end = bytes_.find('>', begin);
  const std::size_t data = bytes_.find('_', tag_end);
  if (data == std::string_view::npos) {
    place_.fail_at(begin, ErrorCode::kFileSyntax, "no '_' begins the appended data; write the file anew");
  }
  std::string tag(bytes_.substr(begin, tag_end - begin));
  tag += "/>";
  pugi::xml_document element;
  element.load_buffer(tag.data(), tag.size(), kParsed, pugi::encoding_utf8);
  const std::string_view encoding = element.first_child().attribute("encoding").value();
  if (encoding != "raw" && encoding != "base64") {
    place_.fail_at(begin, ErrorCode::kFileUnsupported,
                   "appended data in encoding " + in_quotes(printable(encoding)) + "; raw and base64 are read");
  }
  appended_ = bytes_.substr(data + 1);
  appended_base64_ = encoding == "base64";
  if (appended_base64_) appended_ = appended_.substr(0, appended_.find('<'));
}

void VtuDocument::read_coding(pugi::xml_node root) {
  if (!root) place_.fail_at(0, ErrorCode::kFileUnsupported, name_unread_xml(document_.document_element().name()));
  const std::string_view type = root.attribute("type").value();
  is_partition_ = type == "PUnstructuredGrid";
  if (type != "UnstructuredGrid" && !is_partition_) {
    fail(root, ErrorCode::kFileUnsupported,
         "data set " + in_quotes(printable(type)) + " is not read; " + remedy_for(type));
  }
  const std::string version = root.attribute("version").value();
  std::sscanf(version.c_str(), "%d.%d", &version_.first, &version_.second);
  const std::string_view order = root.attribute("byte_order").value();
  if (order != "LittleEndian" && order != "BigEndian" && !order.empty()) {
    fail(root, ErrorCode::kFileSyntax,
         "expected byte_order 'LittleEndian' or 'BigEndian', found " + in_quotes(printable(order)));
  }
  coding_.big_endian = order == "BigEndian";
  const std::string_view header = root.attribute("header_type").value();
  if (header != "UInt32" && header != "UInt64" && !header.empty()) {
    fail(root, ErrorCode::kFileSyntax,
         "expected header_type 'UInt32' or 'UInt64', found " + in_quotes(printable(header)));
  }
  coding_.header_word_bytes = header == "UInt64" ? 8 : 4;
  const std::string_view compressor = root.attribute("compressor").value();
  coding_.compressor = compressor_called(compressor);
  grid_ = root.child(std::string(type).c_str());
  if (!grid_) {
    fail(root, ErrorCode::kFileSyntax, "the file has no " + std::string(type) + " element; write it anew");
  }
}

pugi::xml_node VtuDocument::require(pugi::xml_node parent, const char* element, const char* name) const {
  const pugi::xml_node found =
      name == nullptr ? parent.child(element) : parent.find_child_by_attribute(element, "Name", name);
  if (!found) {
    fail(parent, ErrorCode::kFileSyntax,
         std::string("expected ") + element +
             (name == nullptr ? std::string() : std::string(1, ' ').append(in_quotes(name))) + " in " + parent.name() +
             ", found none; write the file anew");
  }
  return found;
}

std::uint64_t VtuDocument::byte_of(pugi::xml_node node) const {
  return static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0));
}

void VtuDocument::fail(pugi::xml_node at, ErrorCode code, const std::string& message) const {
  place_.fail_at(byte_of(at), code, message);
}

std::uint64_t VtuDocument::count(pugi::xml_node node, const char* attribute, std::uint64_t most,
                                 std::optional<std::uint64_t> absent) const {
  const pugi::xml_attribute found = node.attribute(attribute);
  if (!found && absent) return *absent;
  const std::optional<std::uint64_t> value = parse_count(without_plus(found.value()));
  if (!value) {
    fail(node, ErrorCode::kFileSyntax,
         std::string("expected a whole number as ") + attribute + ", found " + in_quotes(printable(found.value())));
  }
  if (*value > most) {
    fail(node, ErrorCode::kMeshTooLarge,
         std::string(attribute) + " is " + std::to_string(*value) + ", at most " + std::to_string(most) +
             " are allowed");
  }
  return *value;
}

VtuNumbers VtuDocument::open(pugi::xml_node array, std::uint64_t values) const {
  const std::string_view format = array.attribute("format").value(), type = array.attribute("type").value();
  const std::size_t value_bytes = VtkScanner::block_value_bytes(type);
  const std::string name = in_quotes(printable(array.attribute("Name").value()));
  if (value_bytes == 0) {
    fail(array, ErrorCode::kFileUnsupported,
         "array " + name + " is of type " + in_quotes(printable(type)) +
             "; Int8 to UInt64, Float32 and Float64 are read");
  }
  const pugi::xml_node text = text_of(array);
  const std::uint64_t at = text ? byte_of(text) : byte_of(array);
  if (format.empty() || format == "ascii") return VtuNumbers(text.value(), at);
  TextScanner place(bytes_);
  std::string_view encoded = text.value();
  place.name_one_byte(at);
  if (format == "appended") {
    const std::uint64_t offset = count(array, "offset", std::numeric_limits<std::uint64_t>::max());
    if (!has_appended_ || offset > appended_.size()) {
      fail(array, ErrorCode::kFileSyntax,
           "array " + name + " has offset " + std::to_string(offset) + ", but the appended data have " +
               std::to_string(appended_.size()) + " bytes; write the file anew");
    }
    encoded = appended_.substr(offset);
    place.name_one_byte(static_cast<std::uint64_t>(encoded.data() - bytes_.data()));
  } else if (format != "binary") {
    fail(array, ErrorCode::kFileUnsupported,
         "array " + name + " has format " + in_quotes(printable(format)) + "; ascii, binary and appended are read");
  }
  if (coding_.compressor == VtuCompressor::kUnknown) {
    const pugi::xml_node root = document_.child("VTKFile");
    fail(root, ErrorCode::kFileUnsupported,
         "compressor " + in_quotes(printable(root.attribute("compressor").value())) +
             " is not known; save it with zlib, LZ4, LZMA or without compression");
  }
  const bool base64 = format == "binary" || appended_base64_;
  return VtuNumbers(decode_vtu_array(encoded, base64, coding_, values * value_bytes, place), place.mark(), type,
                    coding_.big_endian);
}

}  // namespace ccslice
