// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/parsed_size.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace ccslice::server {

using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

namespace {

/// An array of n elements of 8 bytes has room for 2 n - 1 at most, after a header of 8 bytes. Smaller ones begin with 8
/// bytes' worth, and have room for 2 n and a bit.
constexpr std::size_t kFirstElementBytes = 16;

/// An entry in a vector that doubles, and the first time the set itself.
constexpr std::size_t kUnknownFieldBytes = 64;

std::size_t string_bytes(std::size_t length) {
  constexpr std::size_t kWithin = 15;
  return sizeof(std::string) + (length > kWithin ? std::max(length, 2 * kWithin) + 1 : 0);
}

std::size_t scalar_bytes(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL: return sizeof(bool);
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64: return 8;
    default: return 4;
  }
}

}  // namespace

/// One pass over one message. What reads returns whether the scan goes on.
class SizeScan {
 public:
  SizeScan(google::protobuf::io::ZeroCopyInputStream& bytes, std::size_t length, std::size_t most_bytes)
      : in_(&bytes), most_bytes_(most_bytes) {
    in_.PushLimit(static_cast<int>(length));
  }

  /// Up to its end.
  bool read_message(const ParsedSize::Shape& shape) {
    if (!count(shape.object_bytes)) return false;
    while (const std::uint32_t tag = in_.ReadTag()) {
      if (!read_field(shape, tag)) return false;
    }
    return in_.ConsumedEntireMessage();
  }

  bool is_beyond() const { return bytes_ > most_bytes_; }
  std::size_t bytes() const { return bytes_; }

 private:
  using Field = ParsedSize::Field;
  using Kind = ParsedSize::Kind;

  bool count(std::size_t bytes) {
    bytes_ += bytes;
    return !is_beyond();
  }

  bool read_field(const ParsedSize::Shape& shape, std::uint32_t tag) {
    const auto number = static_cast<std::uint32_t>(WireFormatLite::GetTagFieldNumber(tag));
    const std::uint32_t wire_type = WireFormatLite::GetTagWireType(tag);
    const auto field = std::lower_bound(shape.fields.begin(), shape.fields.end(), number,
                                        [](const Field& each, std::uint32_t of) { return each.number < of; });
    if (field == shape.fields.end() || field->number != number) return read_unknown(tag);
    if (wire_type == field->wire_type) return read_known(*field);
    const bool is_packed =
        field->is_repeated && field->kind == Kind::kScalar && wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
    return is_packed ? read_packed(*field) : read_unknown(tag);
  }

  bool read_known(const Field& field) {
    if (field.is_repeated && !count(kFirstElementBytes)) return false;
    switch (field.kind) {
      case Kind::kScalar: return skip_scalar(field.wire_type);
      case Kind::kString: return read_string();
      case Kind::kMessage: break;
    }
    std::uint32_t length = 0;
    if (!read_length(length)) return false;
    const std::pair<CodedInputStream::Limit, int> limit =
        in_.IncrementRecursionDepthAndPushLimit(static_cast<int>(length));
    return limit.second >= 0 && read_message(*field.message) && in_.DecrementRecursionDepthAndPopLimit(limit.first);
  }

  bool read_packed(const Field& field) {
    std::uint32_t length = 0;
    if (!read_length(length)) return false;
    std::size_t elements = 0;
    if (field.wire_type == WireFormatLite::WIRETYPE_VARINT) {
      const CodedInputStream::Limit limit = in_.PushLimit(static_cast<int>(length));
      for (; in_.BytesUntilLimit() > 0; ++elements) {
        if (!skip_scalar(field.wire_type)) return false;
      }
      in_.PopLimit(limit);
    } else {
      elements = length / field.element_bytes;
      if (length % field.element_bytes != 0 || !in_.Skip(static_cast<int>(length))) return false;
    }
    return elements == 0 || count(kFirstElementBytes + 2 * field.element_bytes * (elements - 1));
  }

  bool read_unknown(std::uint32_t tag) {
    const int number = WireFormatLite::GetTagFieldNumber(tag);
    const std::uint32_t wire_type = WireFormatLite::GetTagWireType(tag);
    if (number == 0 || !count(kUnknownFieldBytes)) return false;
    if (wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED) return read_string();
    return wire_type == WireFormatLite::WIRETYPE_START_GROUP ? read_group(number) : skip_scalar(wire_type);
  }

  bool read_group(int number) {
    if (!count(sizeof(google::protobuf::UnknownFieldSet)) || !in_.IncrementRecursionDepth()) return false;
    while (const std::uint32_t tag = in_.ReadTag()) {
      if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_END_GROUP) {
        in_.DecrementRecursionDepth();
        return WireFormatLite::GetTagFieldNumber(tag) == number;
      }
      if (!read_unknown(tag)) return false;
    }
    return false;
  }

  bool read_string() {
    std::uint32_t length = 0;
    return read_length(length) && count(string_bytes(length)) && in_.Skip(static_cast<int>(length));
  }

  /// Of what follows, all of which is there.
  bool read_length(std::uint32_t& length) {
    return in_.ReadVarint32(&length) && length <= static_cast<std::uint32_t>(in_.BytesUntilLimit());
  }

  bool skip_scalar(std::uint32_t wire_type) {
    std::uint64_t value = 0;
    switch (wire_type) {
      case WireFormatLite::WIRETYPE_VARINT: return in_.ReadVarint64(&value);
      case WireFormatLite::WIRETYPE_FIXED32: return in_.Skip(4);
      case WireFormatLite::WIRETYPE_FIXED64: return in_.Skip(8);
      default: return false;
    }
  }

  CodedInputStream in_;
  const std::size_t most_bytes_;
  std::size_t bytes_ = 0;
};

ParsedSize::ParsedSize(const google::protobuf::Descriptor& type) : root_(shape_of(type)) {}

const ParsedSize::Shape* ParsedSize::shape_of(const google::protobuf::Descriptor& type) {
  const auto [at, is_new] = shapes_.try_emplace(&type);
  Shape& shape = at->second;  // Stays where it is.
  if (!is_new) return &shape;
  shape.object_bytes = google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->SpaceUsedLong();
  for (int i = 0; i < type.field_count(); ++i) shape.fields.push_back(to_field(*type.field(i)));
  std::sort(shape.fields.begin(), shape.fields.end(),
            [](const Field& a, const Field& b) { return a.number < b.number; });
  return &shape;
}

ParsedSize::Field ParsedSize::to_field(const FieldDescriptor& field) {
  if (field.is_map()) throw std::logic_error("what the map " + field.full_name() + " takes isn't counted");
  Field result{.number = static_cast<std::uint32_t>(field.number()), .is_repeated = field.is_repeated()};
  result.wire_type =
      WireFormatLite::WireTypeForFieldType(static_cast<WireFormatLite::FieldType>(static_cast<int>(field.type())));
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      result.kind = Kind::kMessage;
      result.message = shape_of(*field.message_type());
      break;
    case FieldDescriptor::CPPTYPE_STRING: result.kind = Kind::kString; break;
    default: result.element_bytes = scalar_bytes(field);
  }
  return result;
}

std::optional<std::size_t> ParsedSize::at_most(const grpc::ByteBuffer& bytes, std::size_t most_bytes) const {
  grpc::ByteBuffer same(bytes);  // The reader wants one that it may change.
  grpc::ProtoBufferReader reader(&same);
  if (!reader.status().ok()) return std::nullopt;
  SizeScan scan(reader, bytes.Length(), most_bytes);
  if (!scan.read_message(*root_) && !scan.is_beyond()) return std::nullopt;
  return scan.bytes();
}

}  // namespace ccslice::server
