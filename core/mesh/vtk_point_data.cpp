// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/vtk_point_data.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/base/error.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostComponents = 1024;

/// Attributes that never make channels: keyword, then a name, a data type and so many numbers a tuple.
struct FixedAttribute {
  std::string_view keyword;
  std::uint64_t components;
};
constexpr FixedAttribute kFixed[] = {{"VECTORS", 3},  {"NORMALS", 3},    {"TENSORS", 9},
                                     {"TENSORS6", 6}, {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}};

/// VTK writes array names with bytes other than letters and digits as %XX.
std::string decoded(std::string_view name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    unsigned value = 0;
    const bool escape = name[i] == '%' && i + 2 < name.size() &&
                        std::from_chars(name.data() + i + 1, name.data() + i + 3, value, 16).ptr == name.data() + i + 3;
    text += escape ? static_cast<char>(value) : name[i];
    if (escape) i += 2;
  }
  return text;
}

class AttributeReader {
 public:
  AttributeReader(TextScanner& scanner, std::uint64_t count, std::size_t max_channels)
      : scanner_(scanner), count_(count), max_channels_(max_channels) {}

  VtkAttributes read() {
    while (!scanner_.at_end() && read_attribute()) {
    }
    return std::move(found_);
  }

  void read_field() {
    scanner_.next("the field's name");
    const std::uint64_t arrays = scanner_.count("the number of arrays");
    for (std::uint64_t i = 0; i < arrays; ++i) read_field_array();
  }

 private:
  /// False at a token that opens another section of the file.
  bool read_attribute() {
    const std::string_view keyword = scanner_.peek();
    if (const FixedAttribute* fixed = find_fixed(keyword)) {
      scanner_.skip(1, "a keyword");
      leave_out(fixed->components, 1);
    } else if (equals_ignoring_case(keyword, "SCALARS")) {
      read_scalars();
    } else if (equals_ignoring_case(keyword, "FIELD")) {
      scanner_.skip(1, "a keyword");
      read_field();
    } else if (equals_ignoring_case(keyword, "LOOKUP_TABLE")) {
      skip_lookup_table();
    } else if (equals_ignoring_case(keyword, "COLOR_SCALARS")) {
      skip_sized_attribute("the number of colour components", 0);
    } else if (equals_ignoring_case(keyword, "TEXTURE_COORDINATES")) {
      skip_sized_attribute("the number of texture components", 1);
    } else if (equals_ignoring_case(keyword, "METADATA")) {
      scanner_.skip_paragraph();
    } else {
      return false;
    }
    return true;
  }

  static const FixedAttribute* find_fixed(std::string_view keyword) {
    const auto* found = std::find_if(std::begin(kFixed), std::end(kFixed), [&](const FixedAttribute& attribute) {
      return equals_ignoring_case(keyword, attribute.keyword);
    });
    return found == std::end(kFixed) ? nullptr : found;
  }

  void leave_out(std::uint64_t components, std::uint64_t type_tokens) {
    found_.left_out.push_back(decoded(scanner_.next("an array name")));
    scanner_.skip(type_tokens, "a data type");
    for (std::uint64_t i = 0; i < count_; ++i) scanner_.skip(components, "a value of the array");
  }

  void skip_sized_attribute(std::string_view what, std::uint64_t type_tokens) {
    scanner_.skip(1, "a keyword");
    found_.left_out.push_back(decoded(scanner_.next("an array name")));
    const std::uint64_t components = component_count(what);
    scanner_.skip(type_tokens, "a data type");
    for (std::uint64_t i = 0; i < count_; ++i) scanner_.skip(components, "a value of the array");
  }

  /// At least one: a claim of many tuples of nothing would keep us busy without a token behind it.
  std::uint64_t component_count(std::string_view what) {
    const std::uint64_t components = scanner_.count_up_to(what, kMostComponents);
    if (components == 0) scanner_.fail(what, "0");
    return components;
  }

  void skip_lookup_table() {
    scanner_.skip(2, "a table name");
    const std::uint64_t entries = scanner_.count("the size of the lookup table");
    for (std::uint64_t i = 0; i < entries; ++i) scanner_.skip(4, "a colour");
  }

  /// SCALARS name type [components], then LOOKUP_TABLE name (which old files leave out).
  void read_scalars() {
    scanner_.skip(1, "a keyword");
    const std::string name = decoded(scanner_.next("an array name"));
    scanner_.next("a data type");
    const std::string_view components_text = scanner_.rest_of_line();
    std::uint64_t components = 1;
    if (!components_text.empty()) {
      TextScanner line(components_text);
      if (!line.at_end()) components = parse_components(line);
    }
    if (equals_ignoring_case(scanner_.peek(), "LOOKUP_TABLE")) scanner_.skip(2, "a table name");
    read_values(name, components, count_);
  }

  std::uint64_t parse_components(TextScanner& line) {
    const std::string_view token = line.peek();
    std::uint64_t components = 0;
    const auto end = std::from_chars(token.data(), token.data() + token.size(), components).ptr;
    constexpr std::uint64_t kMostScalarComponents = 4;
    if (end != token.data() + token.size() || components < 1 || components > kMostScalarComponents) {
      scanner_.fail("1 to 4 components", token);
    }
    return components;
  }

  /// name components tuples type, then the values.
  void read_field_array() {
    if (equals_ignoring_case(scanner_.peek(), "METADATA")) scanner_.skip_paragraph();
    const std::string name = decoded(scanner_.next("an array name"));
    const std::uint64_t components = component_count("the number of components");
    const std::uint64_t tuples = scanner_.count("the number of tuples");
    const std::string_view type = scanner_.next("a data type");
    if (equals_ignoring_case(type, "string")) {
      skip_strings(name, components, tuples);
    } else {
      read_values(name, components, tuples);
    }
  }

  /// Strings stand one to a line, spaces and all.
  void skip_strings(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    scanner_.rest_of_line();
    for (std::uint64_t tuple = 0; tuple < tuples; ++tuple) {
      if (scanner_.at_end()) scanner_.fail("a string", {});
      for (std::uint64_t i = 0; i < components; ++i) scanner_.rest_of_line();
    }
    found_.left_out.push_back(name);
  }

  void read_values(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    const bool wanted = max_channels_ > 0;
    if (wanted && found_.channels.size() + components > max_channels_) {
      scanner_.fail_with(ErrorCode::kMeshTooLarge, "point data '" + printable(name) + "' makes more than " +
                                                       std::to_string(max_channels_) + " channels");
    }
    std::vector<VtkChannel> channels(wanted ? components : 0);
    for (std::size_t i = 0; i < channels.size(); ++i) {
      channels[i].name = components == 1 ? name : name + "." + std::to_string(i);
    }
    for (std::uint64_t tuple = 0; tuple < tuples; ++tuple) read_tuple(channels, components);
    if (!wanted) found_.left_out.push_back(name);
    std::move(channels.begin(), channels.end(), std::back_inserter(found_.channels));
  }

  void read_tuple(std::vector<VtkChannel>& channels, std::uint64_t components) {
    for (std::uint64_t i = 0; i < components; ++i) {
      if (channels.empty()) {
        scanner_.skip(1, "a value");
        continue;
      }
      const auto value = static_cast<float>(scanner_.real("a value"));
      if (!std::isfinite(value)) scanner_.fail_with(ErrorCode::kMeshNonFinite, "the value is too large for a float");
      channels[i].values.push_back(value);
    }
  }

  TextScanner& scanner_;
  const std::uint64_t count_;
  const std::size_t max_channels_;
  VtkAttributes found_;
};

}  // namespace

VtkAttributes read_vtk_attributes(TextScanner& scanner, std::uint64_t count, std::size_t max_channels) {
  return AttributeReader(scanner, count, max_channels).read();
}

void skip_field(TextScanner& scanner) { AttributeReader(scanner, 0, 0).read_field(); }

}  // namespace ccslice
