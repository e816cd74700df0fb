// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "proto/job_fields.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ccslice {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

/// Sets a field to other than its default: the first of them, if it is a message.
void fill(Message& message, const FieldDescriptor& field) {
  const Reflection& reflection = *message.GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    Message& part =
        field.is_repeated() ? *reflection.AddMessage(&message, &field) : *reflection.MutableMessage(&message, &field);
    if (part.GetDescriptor()->field_count() > 0) fill(part, *part.GetDescriptor()->field(0));
    return;
  }
  if (field.is_repeated()) {
    ASSERT_EQ(field.cpp_type(), FieldDescriptor::CPPTYPE_DOUBLE) << field.full_name() << ": teach the test this type";
    return reflection.AddDouble(&message, &field, 0.5);
  }
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING: return reflection.SetString(&message, &field, "text");
    case FieldDescriptor::CPPTYPE_DOUBLE: return reflection.SetDouble(&message, &field, 0.5);
    case FieldDescriptor::CPPTYPE_UINT32: return reflection.SetUInt32(&message, &field, 5);
    case FieldDescriptor::CPPTYPE_BOOL: return reflection.SetBool(&message, &field, true);
    case FieldDescriptor::CPPTYPE_ENUM: return reflection.SetEnumValue(&message, &field, 1);
    default: FAIL() << field.full_name() << ": teach the test this type";
  }
}

TEST(JobFields, AreCopiedFromPlansToSlicesWithoutLeavingAnyOut) {
  const Descriptor& plan_type = *v1::PlanSlicesRequest::descriptor();
  std::vector<std::string> shared;
  for (int i = 0; i < plan_type.field_count(); ++i) {
    const FieldDescriptor& field = *plan_type.field(i);
    const FieldDescriptor* twin = v1::SliceRangeRequest::descriptor()->FindFieldByName(field.name());
    if (twin == nullptr) continue;
    shared.push_back(field.name());
    v1::PlanSlicesRequest plan;
    v1::SliceRangeRequest copied, expected;
    fill(plan, field);
    fill(expected, *twin);
    copy_job_fields(plan, copied);
    EXPECT_GT(expected.ByteSizeLong(), 0u) << field.name();
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(copied, expected)) << field.name();
  }
  EXPECT_GE(shared.size(), 10u);
}

TEST(JobFields, OfAPlanAreAllThoseOfSlices) {
  // A field that only slices have is of a range of layers or of how it is sent: no plan depends on it.
  const std::vector<std::string> own = {"first_layer", "layer_count", "contours", "contours_by_region",
                                        "max_chunk_bytes"};
  const Descriptor& slices_type = *v1::SliceRangeRequest::descriptor();
  std::vector<std::string> found;
  for (int i = 0; i < slices_type.field_count(); ++i) {
    const std::string& name = slices_type.field(i)->name();
    if (v1::PlanSlicesRequest::descriptor()->FindFieldByName(name) == nullptr) found.push_back(name);
  }
  EXPECT_EQ(found, own);
}

}  // namespace
}  // namespace ccslice
