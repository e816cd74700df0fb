// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The elements and arrays of one of VTK's XML files. Appended data needn't be XML, so they are cut off before pugixml
// reads the rest.

#pragma once

#include <cstdint>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "core/mesh_files/vtk_scanner.h"
#include "core/mesh_files/vtu_array.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

/// The numbers of an array, decoded, in their order.
class VtuNumbers {
 public:
  /// Text that stands at that byte of the file, which must outlive this.
  VtuNumbers(std::string_view text, std::uint64_t at);
  /// Bytes of values of that type, encoded at that byte of the file.
  VtuNumbers(std::string bytes, std::uint64_t at, std::string_view type, bool big_endian);
  VtuNumbers(const VtuNumbers&) = delete;
  VtuNumbers& operator=(const VtuNumbers&) = delete;

  VtkScanner& values() { return scanner_; }
  TextScanner& text() { return scanner_.text(); }
  /// Fails if there are more. Binary arrays have been compared with what they claim.
  void require_end();

 private:
  const std::string bytes_;
  VtkScanner scanner_;
};

class VtuDocument {
 public:
  /// `bytes` must outlive the document. Throws Error{kFileSyntax, kFileUnsupported} for what is no XML, or no grid.
  explicit VtuDocument(std::string_view bytes);

  /// The element UnstructuredGrid, or PUnstructuredGrid.
  pugi::xml_node grid() const { return grid_; }
  /// Whether the file only names others that hold its pieces (.pvtu).
  bool is_partition() const { return is_partition_; }
  /// For failures: names bytes of the file.
  const TextScanner& place() const { return place_; }
  [[noreturn]] void fail(pugi::xml_node at, ErrorCode code, const std::string& message) const;
  /// The attribute as a whole number of at most `most`; `absent` if it isn't there and that is allowed.
  std::uint64_t count(pugi::xml_node node, const char* attribute, std::uint64_t most,
                      std::optional<std::uint64_t> absent = {}) const;
  /// The child of that name, or the DataArray that is called so. Fails if there is none.
  pugi::xml_node require(pugi::xml_node parent, const char* element, const char* name = nullptr) const;
  /// Whether the file's version is older than that: its writer's, or none.
  bool is_older_than(int major, int minor) const { return version_ < std::pair(major, minor); }
  /// Opens a DataArray that has to hold so many values.
  VtuNumbers open(pugi::xml_node array, std::uint64_t values) const;

 private:
  void cut_appended_data();
  void read_coding(pugi::xml_node root);
  std::uint64_t byte_of(pugi::xml_node node) const;

  std::string_view bytes_;
  TextScanner place_;
  std::string xml_;
  pugi::xml_document document_;
  pugi::xml_node grid_;
  VtuCoding coding_;
  std::pair<int, int> version_;
  std::string_view appended_;  // From the byte behind the underscore on.
  bool has_appended_ = false, appended_base64_ = false, is_partition_ = false;
};

}  // namespace ccslice
