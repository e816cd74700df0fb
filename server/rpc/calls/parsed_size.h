// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What protobuf's parser would make of a message, known before anything is made: an empty sub-message takes two bytes
// to send and up to a hundred once it is an object. One scan of the bytes, along the message's descriptor, adds up
//
//     an object for each sub-message, as large as its class is (x86-64, protobuf 3.21)
//     32 bytes for each string, and its characters where there are more than 15
//     16 bytes for each element of a repeated field, or twice the size of those that come packed: arrays double
//     64 bytes for each unknown field, beside what it holds
//
// That is an upper bound of Message::SpaceUsedLong(), and of what is really asked of the allocator, but for the copying
// of an array that doubles. The allocator adds up to half for its own use. Of messages that clients of the contract
// send the bound is less than twice what they take: it differs in arrays that aren't full, and counts fields that are
// there more than once each time.

#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace ccslice::server {

/// For messages of one type. Immutable.
class ParsedSize {
 public:
  /// REQUIRES: a generated type of proto3. Throws std::logic_error if it can hold a map, which isn't counted.
  explicit ParsedSize(const google::protobuf::Descriptor& type);
  ParsedSize(const ParsedSize&) = delete;
  ParsedSize& operator=(const ParsedSize&) = delete;

  /// The bound, in bytes. The scan ends where it passes `most_bytes`: then the least that is known, which is more. None
  /// if the parser wouldn't take the message either; it also minds what isn't looked at here, such as UTF-8.
  std::optional<std::size_t> at_most(const grpc::ByteBuffer& bytes, std::size_t most_bytes) const;

 private:
  friend class SizeScan;
  struct Shape;
  enum class Kind { kScalar, kString, kMessage };
  struct Field {
    std::uint32_t number = 0;
    Kind kind = Kind::kScalar;
    bool is_repeated = false;
    std::uint32_t wire_type = 0;    // Unpacked.
    std::size_t element_bytes = 0;  // Of a scalar, in memory.
    const Shape* message = nullptr;
  };
  struct Shape {
    std::size_t object_bytes = 0;
    std::vector<Field> fields;  // By ascending numbers.
  };

  const Shape* shape_of(const google::protobuf::Descriptor& type);
  Field to_field(const google::protobuf::FieldDescriptor& field);

  std::map<const google::protobuf::Descriptor*, Shape> shapes_;  // Of the type and of all that it can hold.
  const Shape* root_;
};

}  // namespace ccslice::server
