// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtk_point_data.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh_import/cell_numbers.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostComponents = 1024;

/// Attributes that never make channels: keyword, then a name, a data type and so many numbers a tuple.
struct FixedAttribute {
  std::string_view keyword;
  std::uint64_t components;
};
constexpr FixedAttribute kFixed[] = {
    {"NORMALS", 3}, {"TENSORS", 9}, {"TENSORS6", 6}, {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}};

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
  /// With `unfit` it reads point data. Without it reads cell data, or passes over a field.
  AttributeReader(VtkScanner& values, std::uint64_t count, std::size_t max_channels, UnfitNumbers* unfit)
      : values_(values), scanner_(values.text()), count_(count), max_channels_(max_channels), unfit_(unfit) {}

  VtkCellData read_cell_data() {
    while (!scanner_.at_end() && read_attribute()) {
    }
    return {std::move(numbers_), std::move(found_.left_out)};
  }

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
      leave_out(fixed->components);
    } else if (equals_ignoring_case(keyword, "SCALARS")) {
      read_scalars();
    } else if (equals_ignoring_case(keyword, "VECTORS")) {
      read_vectors();
    } else if (equals_ignoring_case(keyword, "FIELD")) {
      scanner_.skip(1, "a keyword");
      read_field();
    } else if (equals_ignoring_case(keyword, "LOOKUP_TABLE")) {
      skip_lookup_table();
    } else if (equals_ignoring_case(keyword, "COLOR_SCALARS")) {
      skip_colours();
    } else if (equals_ignoring_case(keyword, "TEXTURE_COORDINATES")) {
      skip_texture_coordinates();
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

  /// An array whose keyword has been taken: name, data type, values.
  void leave_out(std::uint64_t components) {
    found_.left_out.push_back(decoded(scanner_.next("an array name")));
    values_.open_array(scanner_.next("a data type"));
    values_.skip(count_ * components, "a value of the array");
  }

  void skip_colours() {
    scanner_.skip(1, "a keyword");
    found_.left_out.push_back(decoded(scanner_.next("an array name")));
    const std::uint64_t components = component_count("the number of colour components");
    values_.open_array("unsigned_char");
    values_.skip(count_ * components, "a value of the array");
  }

  void skip_texture_coordinates() {
    scanner_.skip(1, "a keyword");
    found_.left_out.push_back(decoded(scanner_.next("an array name")));
    const std::uint64_t components = component_count("the number of texture components");
    values_.open_array(scanner_.next("a data type"));
    values_.skip(count_ * components, "a value of the array");
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
    constexpr std::uint64_t kColourComponents = 4;
    values_.open_array("unsigned_char");
    values_.skip(entries * kColourComponents, "a colour");
  }

  /// SCALARS name type [components], then LOOKUP_TABLE name (which old ASCII files leave out).
  void read_scalars() {
    scanner_.skip(1, "a keyword");
    const std::string name = decoded(scanner_.next("an array name"));
    const std::string type(scanner_.next("a data type"));
    const std::string_view components_text = scanner_.rest_of_line();
    std::uint64_t components = 1;
    if (!components_text.empty()) {
      TextScanner line(components_text);
      if (!line.at_end()) components = parse_components(line);
    }
    if (equals_ignoring_case(scanner_.peek(), "LOOKUP_TABLE")) {
      scanner_.skip(2, "a table name");
    } else if (values_.binary()) {
      scanner_.fail("'LOOKUP_TABLE'", scanner_.peek());
    }
    values_.open_array(type);
    read_values(name, components, count_);
  }

  void read_vectors() {
    scanner_.skip(1, "a keyword");
    const std::string name = decoded(scanner_.next("an array name"));
    values_.open_array(scanner_.next("a data type"));
    constexpr std::uint64_t kDimensions = 3;
    read_values(name, kDimensions, count_);
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
    if (equals_ignoring_case(type, "string") || equals_ignoring_case(type, "utf8_string")) {
      return skip_strings(name, components, tuples);
    }
    values_.open_array(type);
    read_values(name, components, tuples);
  }

  /// In ASCII files strings stand one to a line, spaces and all.
  void skip_strings(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    found_.left_out.push_back(name);
    if (values_.binary()) return values_.skip_binary_strings(tuples * components);
    scanner_.rest_of_line();
    for (std::uint64_t tuple = 0; tuple < tuples; ++tuple) {
      if (scanner_.at_end()) scanner_.fail("a string", {});
      for (std::uint64_t i = 0; i < components; ++i) scanner_.rest_of_line();
    }
  }

  void read_values(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    if (unfit_ == nullptr) return read_numbers(name, components, tuples);
    if (found_.channels.size() + components > max_channels_) {
      scanner_.fail_with(ErrorCode::kMeshTooLarge, "point data '" + printable(name) + "' makes more than " +
                                                       std::to_string(max_channels_) + " channels; save fewer arrays");
    }
    std::vector<NamedChannel> channels = open_channels(name, components);
    for (std::uint64_t tuple = 0; tuple < tuples; ++tuple) {
      for (NamedChannel& channel : channels) {
        channel.values.push_back(unfit_->value(values_.any_real("a value"), tuple, "a value", scanner_));
      }
    }
    std::move(channels.begin(), channels.end(), std::back_inserter(found_.channels));
  }

  void read_numbers(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    const std::size_t first = numbers_.size();
    if (components == 0 || components > kMostCellNumbers - first || tuples != count_) {
      values_.skip(tuples * components, "a value");
      found_.left_out.push_back(name);
      return;
    }
    for (std::size_t i = 0; i < components; ++i) numbers_.push_back({component_name(name, components, i), {}});
    for (std::uint64_t cell = 0; cell < tuples; ++cell) {
      for (std::size_t i = 0; i < components; ++i) {
        numbers_[first + i].of_cells.push_back(values_.any_real("a value"));
      }
    }
  }

  VtkScanner& values_;
  TextScanner& scanner_;
  const std::uint64_t count_;
  const std::size_t max_channels_;
  UnfitNumbers* unfit_;
  VtkAttributes found_;
  std::vector<CellNumbers> numbers_;
};

}  // namespace

VtkAttributes read_vtk_attributes(VtkScanner& scanner, std::uint64_t count, std::size_t max_channels,
                                  UnfitNumbers& unfit) {
  return AttributeReader(scanner, count, max_channels, &unfit).read();
}

VtkCellData read_vtk_cell_data(VtkScanner& scanner, std::uint64_t count) {
  return AttributeReader(scanner, count, 0, nullptr).read_cell_data();
}

/// Reads it as cell data of so many cells that no array fits, so that nothing is kept.
void skip_field(VtkScanner& scanner) { AttributeReader(scanner, ~std::uint64_t{0}, 0, nullptr).read_field(); }

}  // namespace ccslice
