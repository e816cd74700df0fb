// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/netcdf_file.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/mesh_import/byte_order.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kDimensions = 10, kVariables = 11, kAttributes = 12;  // Tags of lists.
constexpr std::uint64_t kTooMany = std::numeric_limits<std::uint64_t>::max();

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? kTooMany : product;
}

std::uint64_t plus(std::uint64_t a, std::uint64_t b) {
  std::uint64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? kTooMany : sum;
}

/// Up to the next multiple of four.
std::uint64_t padded(std::uint64_t size) { return plus(size, (4 - size % 4) % 4); }

}  // namespace

std::uint64_t size_bytes(NetcdfType type) {
  switch (type) {
    case NetcdfType::kByte:
    case NetcdfType::kChar:
    case NetcdfType::kUnsignedByte: return 1;
    case NetcdfType::kShort:
    case NetcdfType::kUnsignedShort: return 2;
    case NetcdfType::kInt:
    case NetcdfType::kFloat:
    case NetcdfType::kUnsignedInt: return 4;
    case NetcdfType::kDouble:
    case NetcdfType::kInt64:
    case NetcdfType::kUnsignedInt64: break;
  }
  return 8;
}

double NetcdfNumbers::operator[](std::uint64_t i) const {
  const std::uint64_t size = size_bytes(type_);
  const std::uint64_t word = big_endian(bytes_.substr(i * size, size));
  switch (type_) {
    case NetcdfType::kByte: return static_cast<std::int8_t>(word);
    case NetcdfType::kShort: return static_cast<std::int16_t>(word);
    case NetcdfType::kInt: return static_cast<std::int32_t>(word);
    case NetcdfType::kInt64: return static_cast<double>(static_cast<std::int64_t>(word));
    case NetcdfType::kFloat: return std::bit_cast<float>(static_cast<std::uint32_t>(word));
    case NetcdfType::kDouble: return std::bit_cast<double>(word);
    case NetcdfType::kChar:
    case NetcdfType::kUnsignedByte:
    case NetcdfType::kUnsignedShort:
    case NetcdfType::kUnsignedInt:
    case NetcdfType::kUnsignedInt64: break;
  }
  return static_cast<double>(word);
}

NetcdfFile::NetcdfFile(std::string_view bytes) : bytes_(bytes), header_(bytes, TextScanner::Comments::kNone) {
  header_.name_byte_offsets();
  const std::string_view magic = header_.bytes(4, "'CDF' and a version");
  const char version = magic[3];
  if (!magic.starts_with("CDF") || (version != 1 && version != 2 && version != 5)) {
    header_.fail("'CDF' and a version, 1, 2 or 5", printable(magic));
  }
  if (version != 1) offset_bytes_ = 8;
  if (version == 5) count_bytes_ = 8;
  const std::uint64_t records = word(count_bytes_, "the number of records");
  read_dimensions();
  (void)read_attributes();
  read_variables();
  count_records(records);
}

std::uint64_t NetcdfFile::word(std::uint64_t size, std::string_view expected) {
  return big_endian(header_.bytes(size, expected));
}

std::uint64_t NetcdfFile::size_or_id(std::string_view expected) { return word(count_bytes_, expected); }

std::string_view NetcdfFile::padded_bytes(std::uint64_t size, std::string_view expected) {
  const std::string_view bytes = header_.bytes(size, expected);
  (void)header_.bytes(padded(size) - size, expected);
  return bytes;
}

std::string_view NetcdfFile::name(std::string_view expected) { return padded_bytes(size_or_id(expected), expected); }

/// How many items a list with that tag has: none if it is absent.
std::uint64_t NetcdfFile::list_size(std::uint64_t tag, std::string_view expected) {
  const std::uint64_t found = word(4, expected);
  if (found != tag && found != 0) header_.fail(expected, "tag " + std::to_string(found));
  const std::uint64_t size = size_or_id(expected);
  if (found == 0 && size != 0) header_.fail("an empty list", std::to_string(size) + " items");
  return size;
}

NetcdfType NetcdfFile::type() {
  const std::uint64_t number = word(4, "a type");
  if (number < 1 || number > static_cast<std::uint64_t>(NetcdfType::kUnsignedInt64)) {
    header_.fail("a type from 1 to 11", std::to_string(number));
  }
  return static_cast<NetcdfType>(number);
}

void NetcdfFile::read_dimensions() {
  const std::uint64_t count = list_size(kDimensions, "a list of dimensions");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string_view dimension_name = name("a dimension's name");
    const std::uint64_t size = size_or_id("a dimension's size");
    dimensions_.push_back({size, size == 0});
    dimension_sizes_.try_emplace(dimension_name, size);
  }
}

/// Returns the text of "elem_type".
std::string_view NetcdfFile::read_attributes() {
  std::string_view elem_type;
  const std::uint64_t count = list_size(kAttributes, "a list of attributes");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string_view attribute = name("an attribute's name");
    const std::uint64_t item_bytes = size_bytes(type());
    const std::uint64_t items = size_or_id("the size of an attribute");
    const std::string_view value = padded_bytes(times(items, item_bytes), "an attribute's value");
    if (attribute == "elem_type") elem_type = value.substr(0, value.find('\0'));
  }
  return elem_type;
}

void NetcdfFile::read_variables() {
  const std::uint64_t count = list_size(kVariables, "a list of variables");
  for (std::uint64_t i = 0; i < count; ++i) read_variable();
  std::uint64_t with_records = 0;
  for (const NetcdfVariable& variable : variables_) {
    if (!variable.has_records) continue;
    ++with_records;
    record_bytes_ = plus(record_bytes_, padded(variable.slab_bytes));
  }
  if (with_records != 1) return;
  for (const NetcdfVariable& variable : variables_) {
    if (variable.has_records) record_bytes_ = variable.slab_bytes;  // The only one isn't padded.
  }
}

void NetcdfFile::read_variable() {
  NetcdfVariable variable;
  variable.name = name("a variable's name");
  const std::uint64_t ranks = size_or_id("the number of a variable's dimensions");
  for (std::uint64_t rank = 0; rank < ranks; ++rank) {
    const std::uint64_t id = size_or_id("a dimension's number");
    if (id >= dimensions_.size()) header_.fail("the number of a dimension", std::to_string(id));
    if (!dimensions_[id].counts_records) {
      variable.shape.push_back(dimensions_[id].size);
    } else if (rank == 0) {
      variable.has_records = true;
    } else {
      header_.fail("a dimension that has a size", std::to_string(id));
    }
  }
  variable.elem_type = read_attributes();
  variable.type = type();
  (void)size_or_id("the size of a variable");  // Follows from the shape, and 32 bits may be too few for it.
  variable.begin = word(offset_bytes_, "where a variable begins");
  variable.slab_bytes = size_bytes(variable.type);
  for (const std::uint64_t size : variable.shape) variable.slab_bytes = times(variable.slab_bytes, size);
  variable_ids_.try_emplace(variable.name, variables_.size());
  variables_.push_back(std::move(variable));
}

/// Takes the header's number of records, or derives it from the size of a file that was
/// written as a stream.
void NetcdfFile::count_records(std::uint64_t claimed) {
  const std::uint64_t streaming = kTooMany >> (64 - 8 * count_bytes_);
  record_count_ = claimed;
  if (claimed != streaming) return;
  std::uint64_t begin = bytes_.size();
  for (const NetcdfVariable& variable : variables_) {
    if (variable.has_records) begin = std::min(begin, variable.begin);
  }
  record_count_ = record_bytes_ == 0 ? 0 : (bytes_.size() - begin) / record_bytes_;
}

std::optional<std::uint64_t> NetcdfFile::dimension(std::string_view name) const {
  const auto found = dimension_sizes_.find(name);
  if (found == dimension_sizes_.end()) return std::nullopt;
  return found->second;
}

const NetcdfVariable* NetcdfFile::variable(std::string_view name) const {
  const auto found = variable_ids_.find(name);
  return found == variable_ids_.end() ? nullptr : &variables_[found->second];
}

NetcdfNumbers NetcdfFile::numbers(const NetcdfVariable& variable) {
  const std::uint64_t record = variable.has_records && record_count_ > 0 ? record_count_ - 1 : 0;
  const std::uint64_t first = plus(variable.begin, times(record, record_bytes_));
  const std::uint64_t size = variable.has_records && record_count_ == 0 ? 0 : variable.slab_bytes;
  const std::string what = "variable '" + printable(variable.name) + "' ";
  if (first > bytes_.size() || size > bytes_.size() - first) {
    header_.fail_at(std::min<std::uint64_t>(first, bytes_.size()), ErrorCode::kFileSyntax,
                    what + "goes beyond the end of the file, which has " + std::to_string(bytes_.size()) + " bytes");
  }
  read_bytes_ += size;
  if (read_bytes_ > bytes_.size()) {
    header_.fail_at(first, ErrorCode::kFileSyntax, what + "shares bytes with others");
  }
  return {bytes_.substr(first, size), variable.type, first};
}

std::vector<std::string> NetcdfFile::texts(const NetcdfVariable& variable) {
  const std::string_view all = numbers(variable).bytes();
  if (variable.type != NetcdfType::kChar || variable.shape.size() != 2) {
    header_.fail_at(variable.begin, ErrorCode::kFileSyntax,
                    "variable '" + printable(variable.name) + "' has no rows of characters");
  }
  std::vector<std::string> rows;
  const std::uint64_t width = variable.shape[1];
  for (std::uint64_t row = 0; width > 0 && row < variable.shape[0]; ++row) {
    std::string_view text = all.substr(row * width, width);
    text = text.substr(0, text.find('\0'));
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    rows.emplace_back(text);
  }
  return rows;
}

}  // namespace ccslice
