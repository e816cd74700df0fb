// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_encodings.h"

#include <gtest/gtest.h>

namespace ccslice::client {
namespace {

TEST(PlaneEncodings, AreAllThoseOfTheContract) {
  const google::protobuf::EnumDescriptor& type = *v1::PlaneEncoding_descriptor();
  for (int i = 0; i < type.value_count(); ++i) {
    const auto value = static_cast<v1::PlaneEncoding>(type.value(i)->number());
    EXPECT_EQ(find_encoding(value) != nullptr, value != v1::PLANE_ENCODING_UNSPECIFIED) << type.value(i)->name();
  }
}

TEST(PlaneEncodings, AreDecodedOrChecked) {
  for (const PlaneEncoding& encoding : plane_encodings()) {
    EXPECT_NE(encoding.decode == nullptr, encoding.check == nullptr) << encoding.name;
    EXPECT_TRUE(encoding.extension.starts_with('.')) << encoding.name;
  }
}

}  // namespace
}  // namespace ccslice::client
