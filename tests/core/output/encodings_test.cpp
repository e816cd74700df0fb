// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/encodings.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "core/base/choice_text.h"

namespace ccslice {
namespace {

constexpr SampleType kTypes[] = {SampleType::kBit,     SampleType::kUint8, SampleType::kUint16,
                                 SampleType::kFloat32, SampleType::kUint2, SampleType::kUint4};

TEST(Encodings, HaveNamesAndNumbersOfTheirOwn) {
  std::set<std::string_view> names;
  for (const EncodingTraits& traits : encodings()) {
    EXPECT_TRUE(names.insert(traits.name).second) << traits.name;
    EXPECT_EQ(find_encoding(traits.encoding), &traits) << traits.name;
  }
  EXPECT_EQ(find_encoding(static_cast<Encoding>(50)), nullptr);
  EXPECT_EQ(choice_text(encodings()), "RAW, RAW_ZSTD, PNG, PNG_RGBA, TIFF, EXR, PNG_ALPHA, TIFF_ALPHA or RUNS_ZSTD");
}

TEST(Encodings, EncodeWhatTheyTakeAndSayWhatToAskForInsteadOfTheRest) {
  for (const EncodingTraits& traits : encodings()) {
    for (const SampleType type : kTypes) {
      const bool encodes = traits.encode_samples != nullptr;
      EXPECT_TRUE(traits.takes(type) ? encodes : !traits.type_remedy.empty()) << traits.name;
    }
    EXPECT_EQ(traits.takes(SampleType::kBit), traits.encode_mask != nullptr) << traits.name;
    EXPECT_EQ(traits.materials.most > 0, traits.encode_indices != nullptr) << traits.name;
    for (const EncodingLimit& limit : {traits.channels, traits.materials}) {
      EXPECT_EQ(limit.most < EncodingLimit().most, !limit.remedy.empty()) << traits.name;
    }
  }
}

}  // namespace
}  // namespace ccslice
