// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/parsed_size.h"

#include <google/protobuf/message.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/type.pb.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "ccslice/v1/service.pb.h"
#include "server/service/base/limits.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

using namespace std::string_view_literals;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kNoLimit = 1u << 30;
constexpr std::size_t kStringBytes = 32;

/// In slices of so many bytes, as they may come.
grpc::ByteBuffer to_buffer(std::string_view bytes, std::size_t slice_bytes = kNoLimit) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < bytes.size(); at += slice_bytes) {
    const std::string_view part = bytes.substr(at, slice_bytes);
    slices.emplace_back(part.data(), part.size());
  }
  return {slices.data(), slices.size()};
}

/// What such a message really takes; none if the parser refuses the bytes.
std::optional<std::size_t> space_of(const Message& prototype, const grpc::ByteBuffer& bytes) {
  grpc::ByteBuffer same(bytes);
  grpc::ProtoBufferReader reader(&same);
  const std::unique_ptr<Message> message(prototype.New());
  if (!message->ParseFromZeroCopyStream(&reader)) return std::nullopt;
  return message->SpaceUsedLong();
}

template <class Type>
std::optional<std::size_t> bound_of(std::string_view bytes, std::size_t most_bytes = kNoLimit) {
  return ParsedSize(*Type::descriptor()).at_most(to_buffer(bytes), most_bytes);
}

/// Expects this bound beyond the message's object, and that it is one.
template <class Type>
void expect(std::string_view bytes, std::size_t beyond_object) {
  SCOPED_TRACE(testing::PrintToString(std::string(bytes.substr(0, 40))));
  EXPECT_EQ(bound_of<Type>(bytes), sizeof(Type) + beyond_object);
  const std::optional<std::size_t> space = space_of(Type(), to_buffer(bytes));
  ASSERT_TRUE(space);
  EXPECT_LE(*space, sizeof(Type) + beyond_object);
}

template <class Type>
void expect_refused(std::string_view bytes) {
  SCOPED_TRACE(testing::PrintToString(std::string(bytes.substr(0, 40))));
  EXPECT_FALSE(space_of(Type(), to_buffer(bytes)));
  EXPECT_FALSE(bound_of<Type>(bytes));
}

TEST(ParsedSize, CountsSubMessages) {
  using Job = v1::SliceJob;
  expect<Job>("", 0);
  expect<Job>("\x2a\0"sv, 16 + sizeof(v1::PlaneSpec));
  expect<Job>(repeated("\x2a\0"sv, 1000), 1000 * (16 + sizeof(v1::PlaneSpec)));
  expect<Job>("\x2a\x02\x0a\0"sv, 16 + sizeof(v1::PlaneSpec) + sizeof(v1::OccupancyContent));
  expect<Job>("\x12\x02\x0a\0"sv, sizeof(v1::GridSpec) + sizeof(v1::VoxelPitch));
  expect<v1::SliceRangeRequest>("\x0a\x02\x2a\0"sv, sizeof(Job) + 16 + sizeof(v1::PlaneSpec));
  Job job;
  job.mutable_printing()->add_cell_region_maps()->mutable_map()->mutable_calibration()->add_points()->set_property(1);
  expect<Job>(job.SerializeAsString(), sizeof(v1::Printing) + 16 + sizeof(v1::CellRegionMap) + sizeof(v1::MaterialMap) +
                                           sizeof(v1::CalibrationMap) + 16 + sizeof(v1::CalibrationPoint));
}

TEST(ParsedSize, CountsStrings) {
  using Request = v1::FindMissingMeshesRequest;
  expect<v1::GetMeshRequest>("\x0a\0"sv, kStringBytes);
  expect<v1::GetMeshRequest>("\x0a\x0f" + std::string(15, 'a'), kStringBytes);
  expect<v1::GetMeshRequest>("\x0a\x10" + std::string(16, 'a'), kStringBytes + 31);
  expect<v1::GetMeshRequest>("\x0a\x64" + std::string(100, 'a'), kStringBytes + 101);
  expect<v1::UploadMeshRequest>("\x12\x64" + std::string(100, '\xff'), kStringBytes + 101);
  expect<Request>(repeated("\x0a\0"sv, 1000), 1000 * (16 + kStringBytes));
}

TEST(ParsedSize, CountsScalarsWhereTheyAreRepeated) {
  expect<v1::Tolerances>("\x18\x01\x09" + std::string(8, 'a'), 0);
  using Request = v1::EvaluatePointsRequest;
  const std::string eight(8, '\0');
  expect<Request>("\x19" + eight, 64);  // limit_cells aren't of 64 bits: an unknown field.
  expect<Request>("\x18\x01\x18\x80\x01", 2 * 16);
  expect<Request>("\x21" + eight, 16);
  expect<Request>("\x1a\0"sv, 0);
  expect<Request>("\x1a\x03\x01\x80\x01", 16 + 2 * 4);
  expect<Request>("\x22\x10" + eight + eight, 16 + 2 * 8);
  v1::ControlMesh mesh;
  for (int i = 0; i < 1000; ++i) mesh.add_cell_kinds(v1::CELL_KIND_HEX);
  for (int i = 0; i < 1000; ++i) mesh.add_channel_values(1);
  expect<v1::ControlMesh>(mesh.SerializeAsString(), 2 * (16 + 999 * 2 * 4));
}

TEST(ParsedSize, CountsUnknownFields) {
  using Request = v1::GetServerInfoRequest;
  constexpr std::size_t kSet = sizeof(google::protobuf::UnknownFieldSet);
  expect<Request>("\x78\x01", 64);
  expect<Request>("\x7d" + std::string(4, 'a'), 64);
  expect<Request>("\x79" + std::string(8, 'a'), 64);
  expect<Request>("\x7a\x64" + std::string(100, 'a'), 64 + kStringBytes + 101);
  expect<Request>("\x7b\x78\x01\x7b\x7c\x7c", 64 + kSet + 64 + 64 + kSet);
  expect<Request>(repeated("\x78\x01", 1000), 1000 * 64);
  expect<v1::SliceJob>("\x28\x01", 64);  // planes aren't numbers.
}

TEST(ParsedSize, HasNoneForWhatTheParserRefuses) {
  for (const std::string_view bad :
       {"\x0a"sv, "\x0a\x7f"sv, "\x0a\xff\xff\xff\xff\x0f"sv, "\x0f"sv, "\x0e"sv, "\x0c"sv, "\x08"sv, "\x08\xff"sv,
        "\x0d\0\0\0"sv, "\x09\0\0\0\0\0\0\0"sv, "\0"sv, "\x02\0"sv, "\x7b"sv, "\x7b\x74"sv, "\x7b\x0a\x05\x7c"sv,
        "\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"sv}) {
    expect_refused<v1::SliceJob>(bad);
  }
  for (const std::string_view bad : {"\x2a\x05\x0a\0"sv, "\x2a\x02\x0a\x01\0"sv, "\x2a\x01\x7b\x7c"sv}) {
    expect_refused<v1::SliceJob>(bad);
  }
  for (const std::string_view bad : {"\x1a\x02\x01\x80\x01"sv, "\x22\x07\0\0\0\0\0\0\0"sv, "\x1a\x05\x01"sv}) {
    expect_refused<v1::EvaluatePointsRequest>(bad);
  }
}

TEST(ParsedSize, FollowsGroupsAsDeepAsTheParser) {
  expect<v1::GetMeshRequest>(repeated("\x7b", 100) + repeated("\x7c", 100), 100 * (64 + 24));
  expect_refused<v1::GetMeshRequest>(repeated("\x7b", 101) + repeated("\x7c", 101));
  expect_refused<v1::GetMeshRequest>(repeated("\x7b", 200'000));
}

TEST(ParsedSize, EndsWhereItPassesTheMost) {
  const std::string bytes = repeated("\x2a\0"sv, 500'000);
  constexpr std::size_t kEach = 16 + sizeof(v1::PlaneSpec);
  const std::optional<std::size_t> bound = bound_of<v1::SliceJob>(bytes, kMaxParsedBytes);
  ASSERT_TRUE(bound);
  EXPECT_GT(*bound, kMaxParsedBytes);
  EXPECT_LE(*bound, kMaxParsedBytes + kEach);
  EXPECT_EQ(bound_of<v1::SliceJob>(bytes), sizeof(v1::SliceJob) + 500'000 * kEach);
  EXPECT_FALSE(bound_of<v1::SliceJob>(repeated("\x2a\0"sv, 1000) + "\x0f", kMaxParsedBytes));
  EXPECT_TRUE(bound_of<v1::SliceJob>(bytes + "\x0f", kMaxParsedBytes)) << "what comes then isn't looked at";
}

TEST(ParsedSize, IsNotSaidOfMaps) {
  EXPECT_THROW(ParsedSize{*google::protobuf::Struct::descriptor()}, std::logic_error);
}

/// Messages of any type with all that it can hold.
class RandomMessages {
 public:
  RandomMessages(std::uint32_t seed, bool with_unknown_fields) : random_(seed), unknown_(with_unknown_fields) {}

  std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }

  void fill(Message& message, int depth = 0) {
    for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor& field = *message.GetDescriptor()->field(i);
      if (below(3) == 0) continue;
      const std::size_t most = depth == 0 && field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE ? 200 : 8;
      const std::size_t count = field.is_repeated() ? below(most) : 1;
      for (std::size_t k = 0; k < count; ++k) fill(message, field, depth);
    }
    if (!unknown_ || below(10) != 0) return;
    auto& unknown = *message.GetReflection()->MutableUnknownFields(&message);
    unknown.AddVarint(1000, random_());
    unknown.AddGroup(1001)->AddLengthDelimited(1, text());
  }

  /// Some bytes other ones, inserted, dropped or there twice.
  std::string changed(std::string bytes) {
    for (std::size_t changes = 1 + below(3); changes > 0 && !bytes.empty(); --changes) {
      const std::size_t at = below(bytes.size());
      const std::size_t length = std::min(bytes.size() - at, 1 + below(20));
      switch (below(4)) {
        case 0: bytes[at] = static_cast<char>(below(256)); break;
        case 1: bytes.insert(at, 1, static_cast<char>(below(256))); break;
        case 2: bytes.erase(at, length); break;
        default: bytes.insert(at, bytes.substr(at, length));
      }
    }
    return bytes;
  }

 private:
  std::string text() { return std::string(below(below(5) == 0 ? 200 : 40), 'a'); }

  void fill(Message& message, const FieldDescriptor& field, int depth) {
    const auto& reflection = *message.GetReflection();
    const bool repeated = field.is_repeated();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return fill(repeated ? *reflection.AddMessage(&message, &field) : *reflection.MutableMessage(&message, &field),
                    depth + 1);
      case FieldDescriptor::CPPTYPE_STRING:
        return repeated ? reflection.AddString(&message, &field, text())
                        : reflection.SetString(&message, &field, text());
      case FieldDescriptor::CPPTYPE_ENUM:
        return repeated ? reflection.AddEnumValue(&message, &field, 1) : reflection.SetEnumValue(&message, &field, 1);
      case FieldDescriptor::CPPTYPE_BOOL:
        return repeated ? reflection.AddBool(&message, &field, true) : reflection.SetBool(&message, &field, true);
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return repeated ? reflection.AddDouble(&message, &field, 1.5) : reflection.SetDouble(&message, &field, 1.5);
      case FieldDescriptor::CPPTYPE_FLOAT:
        return repeated ? reflection.AddFloat(&message, &field, 1.5) : reflection.SetFloat(&message, &field, 1.5);
      case FieldDescriptor::CPPTYPE_UINT32:
        return repeated ? reflection.AddUInt32(&message, &field, random_() >> below(32))
                        : reflection.SetUInt32(&message, &field, random_() >> below(32));
      case FieldDescriptor::CPPTYPE_UINT64:
        return repeated ? reflection.AddUInt64(&message, &field, random_())
                        : reflection.SetUInt64(&message, &field, random_());
      case FieldDescriptor::CPPTYPE_INT32: return reflection.SetInt32(&message, &field, 1);
      case FieldDescriptor::CPPTYPE_INT64: return reflection.SetInt64(&message, &field, 1);
    }
  }

  std::mt19937 random_;
  const bool unknown_;
};

/// All requests, and some messages with what these don't hold.
std::vector<const Message*> prototypes() {
  auto& factory = *google::protobuf::MessageFactory::generated_factory();
  std::vector<const Message*> all = {&v1::ControlMesh::default_instance(), &v1::SliceRangeResponse::default_instance(),
                                     &v1::GetMeshResponse::default_instance(),
                                     &google::protobuf::Type::default_instance()};
  const auto& service =
      *google::protobuf::DescriptorPool::generated_pool()->FindServiceByName("ccslice.v1.SlicerService");
  for (int i = 0; i < service.method_count(); ++i) all.push_back(factory.GetPrototype(service.method(i)->input_type()));
  return all;
}

class RandomParsedSize : public testing::TestWithParam<std::uint32_t> {
 protected:
  ~RandomParsedSize() override { google::protobuf::SetLogHandler(former_); }

 private:
  google::protobuf::LogHandler* const former_ = google::protobuf::SetLogHandler(nullptr);
};

TEST_P(RandomParsedSize, IsBetweenWhatMessagesTakeAndTwiceThat) {
  RandomMessages random(GetParam(), /*with_unknown_fields=*/false);
  for (const Message* const prototype : prototypes()) {
    SCOPED_TRACE(prototype->GetTypeName());
    const ParsedSize size(*prototype->GetDescriptor());
    for (int i = 0; i < 20; ++i) {
      const std::unique_ptr<Message> message(prototype->New());
      random.fill(*message);
      const grpc::ByteBuffer bytes = to_buffer(message->SerializeAsString(), 1 + random.below(1000));
      const std::optional<std::size_t> space = space_of(*prototype, bytes), bound = size.at_most(bytes, kNoLimit);
      ASSERT_TRUE(space && bound);
      EXPECT_GE(*bound, *space);
      EXPECT_LE(*bound, 2 * *space);
    }
  }
}

TEST_P(RandomParsedSize, IsABoundOfWhatComesOfChangedMessages) {
  RandomMessages random(GetParam(), /*with_unknown_fields=*/true);
  int parsed = 0, refused = 0;
  for (const Message* const prototype : prototypes()) {
    SCOPED_TRACE(prototype->GetTypeName());
    const ParsedSize size(*prototype->GetDescriptor());
    const std::unique_ptr<Message> message(prototype->New());
    random.fill(*message);
    for (int i = 0; i < 400; ++i) {
      const std::string changed = random.changed(message->SerializeAsString());
      const grpc::ByteBuffer bytes = to_buffer(changed);
      const std::optional<std::size_t> space = space_of(*prototype, bytes), bound = size.at_most(bytes, kNoLimit);
      ++(space ? parsed : refused);
      if (!space) continue;
      EXPECT_GE(bound.value_or(0), *space) << testing::PrintToString(changed);
    }
  }
  EXPECT_GT(parsed, 1000);
  EXPECT_GT(refused, 1000);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomParsedSize, testing::Range(1u, 5u));

}  // namespace
}  // namespace ccslice::server
