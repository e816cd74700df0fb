// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/channel/channel_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/support/channel_functions.h"

namespace ccslice {
namespace {

const std::vector<ChannelRange> kOfSolid = {{"stiffness", 0, 2}, {"colour", -1, 1}};

std::shared_ptr<const ChannelSource> made_of(const std::string& name, const std::vector<std::string>& inputs) {
  return std::make_shared<ChannelFunction>(ChannelRange{name, 0, 1}, inputs,
                                           [](const Vec3&, const Vec3&, std::span<const float>) { return 0.0F; });
}

TEST(ChannelTable, FindsChannelsOfTheSolidAndOfSources) {
  const ChannelSources sources = {made_of("lattice", {})};
  const ChannelTable table(kOfSolid, sources);
  EXPECT_EQ(table.at("colour").of_solid, 1u);
  EXPECT_EQ(table.at("colour").range.min, -1);
  EXPECT_EQ(table.at("colour").source, nullptr);
  EXPECT_EQ(table.at("lattice").of_solid, std::nullopt);
  EXPECT_EQ(table.at("lattice").source, sources[0].get());
  EXPECT_FALSE(table.find("Colour"));
}

TEST(ChannelTable, NamesWhatThereIsAndWhatMayBeMeant) {
  const ChannelSources sources = {made_of("lattice", {})};
  const auto refusal = [&](const std::string& name) {
    try {
      ChannelTable(kOfSolid, sources).require(name, "planes[0].channel.name");
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kChannelUnknown);
      EXPECT_EQ(error.field(), "planes[0].channel.name");
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal("lattice"), "");
  const std::string known = R"("; it has "stiffness", "colour", "lattice")";
  EXPECT_EQ(refusal("weight"), R"(planes[0].channel.name: the mesh has no channel "weight)" + known);
  EXPECT_THAT(refusal("Colour"), testing::EndsWith(R"(; did you mean "colour"?)"));
  EXPECT_THAT(refusal("stifness"), testing::EndsWith(R"(; did you mean "stiffness"?)"));
}

TEST(ChannelTable, RefusesSourcesOfTheSameNameAndThoseThatReadWhatComesLater) {
  const auto refusal = [&](const ChannelSources& sources) {
    try {
      ChannelTable(kOfSolid, sources).validate_sources();
    } catch (const Error& error) {
      return std::string(reason(error.code())) + " " + error.field();
    }
    return std::string();
  };
  EXPECT_EQ(refusal({made_of("a", {"colour"}), made_of("b", {"a", "stiffness"})}), "");
  EXPECT_EQ(refusal({made_of("a", {"b"}), made_of("b", {})}), "CHANNEL_UNKNOWN fields[0]");
  EXPECT_EQ(refusal({made_of("a", {"a"})}), "CHANNEL_UNKNOWN fields[0]");
  EXPECT_EQ(refusal({made_of("a", {}), made_of("colour", {})}), "CHANNEL_REPEATED fields[1]");
}

}  // namespace
}  // namespace ccslice
