// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/contract_value.h"

#include <gtest/gtest.h>

#include "ccslice/v1/material.pb.h"
#include "ccslice/v1/mesh.pb.h"
#include "ccslice/v1/slice.pb.h"
#include "core/mesh/cell_kind.h"
#include "core/output/encodings.h"
#include "core/printing/printing.h"

namespace ccslice::server {
namespace {

/// The values of the contract that no row stands for.
template <typename Value, typename Rows>
std::string left_out(const Rows& rows, std::string_view prefix) {
  const google::protobuf::EnumDescriptor& type = *google::protobuf::GetEnumDescriptor<Value>();
  std::string names;
  for (int i = 0; i < type.value_count(); ++i) {
    const google::protobuf::EnumValueDescriptor& value = *type.value(i);
    if (find_contract_row(rows, prefix, static_cast<Value>(value.number())) == nullptr) names += value.name() + " ";
  }
  return names;
}

TEST(ContractValues, AreAllEncodings) {
  EXPECT_EQ(left_out<v1::PlaneEncoding>(encodings(), "PLANE_ENCODING_"), "PLANE_ENCODING_UNSPECIFIED ");
}

TEST(ContractValues, AreAllHalftoneMethods) {
  EXPECT_EQ(left_out<v1::HalftoneMethod>(kHalftoneMethods, "HALFTONE_METHOD_"), "HALFTONE_METHOD_UNSPECIFIED ");
}

TEST(ContractValues, AreAllCellKindsButPyramids) {
  EXPECT_EQ(left_out<v1::CellKind>(kCellKinds, "CELL_KIND_"), "CELL_KIND_UNSPECIFIED CELL_KIND_PYRAMID ");
}

TEST(ContractValues, OfUnknownNamesAreUnspecified) {
  EXPECT_EQ(contract_value<v1::PlaneEncoding>("PLANE_ENCODING_", "WAX"), v1::PLANE_ENCODING_UNSPECIFIED);
}

}  // namespace
}  // namespace ccslice::server
