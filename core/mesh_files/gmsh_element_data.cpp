// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_element_data.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostTags = 64;
constexpr std::uint64_t kMostFieldComponents = 9;
constexpr std::size_t kMostNumbers = kMostCellNumbers - 1;  // Volumes of the geometry are numbers of cells, too.

std::vector<std::string> read_strings(TextScanner& text) {
  const std::uint64_t count = text.count_up_to("the number of tags", kMostTags);
  text.end_line();
  std::vector<std::string> strings;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string_view line = text.rest_of_line();
    line = between_quotes(line).value_or(line);
    while (!line.empty() && (line.back() == '\r' || line.back() == '\n')) line.remove_suffix(1);
    strings.emplace_back(line);
  }
  return strings;
}

}  // namespace

/// String tags (the first is the name), real tags (the first is the time), integer tags: time step, components, nodes
/// or elements, partition (0 or none: the whole mesh).
GmshFieldHeader read_field_header(GmshScanner& scanner, std::uint64_t most) {
  TextScanner& text = scanner.text();
  GmshFieldHeader header;
  const std::vector<std::string> names = read_strings(text);
  if (!names.empty() && !names[0].empty()) header.name = names[0];
  (void)read_strings(text);
  const std::uint64_t integer_tags = text.count_up_to("the number of integer tags", kMostTags);
  if (integer_tags < 3) text.fail("at least 3 integer tags", std::to_string(integer_tags));
  header.step = text.next("a time step");
  header.components = text.count_up_to("the number of components", kMostFieldComponents);
  header.count = text.count_up_to("the number of values", most);
  if (integer_tags > 3) header.partition = text.count("a partition");
  text.skip(integer_tags - std::min<std::uint64_t>(integer_tags, 4), "an integer tag");
  if (scanner.binary()) text.end_line();
  return header;
}

/// Null if the field is to be passed over.
GmshElementData::Field* GmshElementData::to_take(const GmshFieldHeader& header) {
  const std::string field = "field '" + printable(header.name) + "' at elements";
  const auto known = std::ranges::find(fields_, header.name, &Field::name);
  if (known != fields_.end()) {
    if (header.partition > 0 && known->step == header.step && known->components == header.components) return &*known;
    warnings_.push_back(field + " comes again for another time: left out");
    return nullptr;
  }
  std::uint64_t numbers = header.components;
  for (const Field& other : fields_) numbers += other.components;
  if (header.components == 0 || numbers > kMostNumbers) {
    warnings_.push_back(field + " left out: at most " + std::to_string(kMostNumbers) + " numbers of a cell are read");
    return nullptr;
  }
  fields_.push_back({header.name, header.step, header.components, {}, {}});
  return &fields_.back();
}

void GmshElementData::read(GmshScanner& scanner) {
  const GmshFieldHeader header = read_field_header(scanner, std::numeric_limits<std::uint64_t>::max());
  Field* const field = to_take(header);
  for (std::uint64_t i = 0; i < header.count; ++i) {
    const std::uint64_t element = scanner.integer("an element's number");
    for (std::uint64_t c = 0; c < header.components; ++c) {
      const double value = scanner.any_real("a value");
      if (field != nullptr) field->values.push_back(value);
    }
    if (field != nullptr) field->elements.push_back(element);
  }
}

void GmshElementData::finish(MeshFile& file) const {
  file.warnings.insert(file.warnings.end(), warnings_.begin(), warnings_.end());
  if (fields_.empty()) return;
  NodeNumbers elements;
  for (const std::uint64_t number : file.numbers.cells) elements.add(number, 0);
  if (const auto twin = elements.sort()) {
    file.warnings.push_back("fields at elements left out: element " + std::to_string(twin->number) + " comes twice");
    return;
  }
  for (const Field& field : fields_) hand_over(field, elements, file);
}

void GmshElementData::hand_over(const Field& field, const NodeNumbers& elements, MeshFile& file) {
  constexpr std::size_t kNoRow = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> row_of(elements.size(), kNoRow);
  for (std::size_t row = 0; row < field.elements.size(); ++row) {
    if (const std::optional<std::uint32_t> cell = elements.index_of(field.elements[row])) row_of[*cell] = row;
  }
  if (const auto lacking = std::ranges::count(row_of, kNoRow); lacking > 0) {
    file.warnings.push_back("field '" + printable(field.name) + "' at elements left out: " + std::to_string(lacking) +
                            " cells have no value in it");
    return;
  }
  for (std::uint64_t i = 0; i < field.components; ++i) {
    CellNumbers numbers{component_name(field.name, field.components, i), {}};
    for (const std::size_t row : row_of) numbers.of_cells.push_back(field.values[row * field.components + i]);
    file.cell_numbers.push_back(std::move(numbers));
  }
}

}  // namespace ccslice
