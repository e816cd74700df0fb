// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Lists of sharp features, and grades as they are written, from arbitrary bytes: what they say or an Error.

#include "core/mesh_authoring/sharpen.h"

#include <cstdint>
#include <string_view>

#include "core/base/error.h"
#include "core/mesh_authoring/grade.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    ccslice::read_sharp_features(text);
  } catch (const ccslice::Error&) {
  }
  try {
    ccslice::parse_grade(text);
  } catch (const ccslice::Error&) {
  }
  return 0;
}
