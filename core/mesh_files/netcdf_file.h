// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of netCDF's classic format and of its variants with 64-bit offsets (CDF-2) and 64-bit data (CDF-5) [The NetCDF
// Classic Format Specification]: a header of dimensions, attributes and variables, big-endian, then the variables'
// numbers. Variables over the one dimension without a size have a slab in each record; the records follow all others.
//
// Why no library does it: of 900 damaged Exodus files libexodusii 6.02 over netCDF 4.9.0 aborts on 20 and runs without
// end on 52. Here the header may claim anything: a variable has to lie within the file when it is read, and all that
// are read together hold no more bytes than the file.

#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh_import/text_scanner.h"

namespace ccslice {

/// Numbered as in files.
enum class NetcdfType : std::uint8_t {
  kByte = 1,
  kChar,
  kShort,
  kInt,
  kFloat,
  kDouble,
  kUnsignedByte,
  kUnsignedShort,
  kUnsignedInt,
  kInt64,
  kUnsignedInt64
};

std::uint64_t size_bytes(NetcdfType type);

struct NetcdfVariable {
  std::string_view name;
  NetcdfType type = NetcdfType::kByte;
  bool has_records = false;          // Its first dimension counts records.
  std::vector<std::uint64_t> shape;  // Without that dimension.
  std::string_view elem_type;        // An attribute of Exodus.
  std::uint64_t begin = 0;           // Byte of the file.
  std::uint64_t slab_bytes = 0;      // Of a record, or of all. The largest number if 64 bits can't count them.
};

/// Numbers of a variable, in the order of the file.
class NetcdfNumbers {
 public:
  NetcdfNumbers(std::string_view bytes, NetcdfType type, std::uint64_t first_byte)
      : bytes_(bytes), type_(type), first_byte_(first_byte) {}

  std::uint64_t size() const { return bytes_.size() / size_bytes(type_); }
  /// REQUIRES: i < size().
  double operator[](std::uint64_t i) const;
  /// Where number i stands in the file.
  std::uint64_t byte(std::uint64_t i) const { return first_byte_ + i * size_bytes(type_); }
  std::string_view bytes() const { return bytes_; }

 private:
  std::string_view bytes_;
  NetcdfType type_;
  std::uint64_t first_byte_;
};

class NetcdfFile {
 public:
  /// Reads the header. `bytes` must outlive the file. Throws Error{kFileSyntax}, which names the byte.
  explicit NetcdfFile(std::string_view bytes);

  std::optional<std::uint64_t> dimension(std::string_view name) const;
  /// Null if there is none.
  const NetcdfVariable* variable(std::string_view name) const;
  std::uint64_t record_count() const { return record_count_; }

  /// All numbers of a variable, those of its last record if it has records. Throws Error{kFileSyntax} if they aren't in
  /// the file, or if what has been read before leaves no bytes for them; kMeshTooLarge is the caller's business.
  NetcdfNumbers numbers(const NetcdfVariable& variable);
  /// The rows of an array of characters, up to their first zero and without blanks at the end.
  std::vector<std::string> texts(const NetcdfVariable& variable);

  /// For failures at a byte of the file.
  const TextScanner& place() const { return header_; }

 private:
  struct Dimension {
    std::uint64_t size;
    bool counts_records;
  };
  std::uint64_t word(std::uint64_t size, std::string_view expected);
  std::uint64_t size_or_id(std::string_view expected);
  std::string_view padded_bytes(std::uint64_t size, std::string_view expected);
  std::string_view name(std::string_view expected);
  std::uint64_t list_size(std::uint64_t tag, std::string_view expected);
  NetcdfType type();
  void read_dimensions();
  std::string_view read_attributes();
  void read_variables();
  void read_variable();
  void count_records(std::uint64_t claimed);

  std::string_view bytes_;
  TextScanner header_;
  std::uint64_t count_bytes_ = 4, offset_bytes_ = 4;  // Of a count and of an offset in the header.
  std::vector<Dimension> dimensions_;
  std::map<std::string_view, std::uint64_t> dimension_sizes_;
  std::vector<NetcdfVariable> variables_;
  std::map<std::string_view, std::size_t> variable_ids_;
  std::uint64_t record_count_ = 0, record_bytes_ = 0, read_bytes_ = 0;
};

}  // namespace ccslice
