// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/model_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

TEST(ModelSettings, ReadsNamesPartsAndPlatesOfBambuStudio) {
  const ModelSettings settings = parse_model_settings(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<config>
  <object id="2">
    <metadata key="name" value="ring &quot;a&quot;"/>
    <metadata key="extruder" value="1"/>
    <part id="1" subtype="normal_part"><metadata key="name" value="ring"/></part>
    <part id="5" subtype="modifier_part"><metadata key="name" value="Generic-Cube"/></part>
  </object>
  <plate>
    <metadata key="plater_id" value="1"/><metadata key="plater_name" value=""/>
    <model_instance><metadata key="object_id" value="2"/><metadata key="instance_id" value="0"/></model_instance>
  </plate>
  <plate>
    <metadata key="plater_id" value="2"/><metadata key="plater_name" value="second"/>
    <model_instance><metadata key="object_id" value="2"/><metadata key="instance_id" value="1"/></model_instance>
    <model_instance><metadata key="object_id" value="4"/><metadata key="instance_id" value="0"/></model_instance>
  </plate>
  <assemble><assemble_item object_id="2" instance_id="0" transform="1 0 0 0 1 0 0 0 1 0 0 0" offset="0 0 0"/></assemble>
</config>)",
      "x");
  EXPECT_EQ(settings.names.at(2), "ring \"a\"");
  EXPECT_EQ(settings.parts.at({2, 5}).subtype, "modifier_part");
  EXPECT_EQ(settings.parts.at({2, 1}).name, "ring");
  ASSERT_EQ(settings.plates.size(), 2u);
  EXPECT_EQ(settings.plates[1].plate.number, 2u);
  EXPECT_EQ(settings.plates[1].plate.name, "second");
  EXPECT_TRUE(settings.plates[1].instances.contains({4, 0}));
  EXPECT_EQ(settings.plates[0].instances.size(), 1u);
}

TEST(ModelSettings, ReadsNamesOfPrusaSlicer) {
  const ModelSettings settings = parse_model_settings(
      R"(<config><object id="1" instances_count="2"><metadata type="object" key="name" value="ring"/>)"
      R"(<volume firstid="0" lastid="9"><metadata type="volume" key="name" value="part"/></volume></object></config>)",
      "x");
  EXPECT_EQ(settings.names.at(1), "ring");
  ASSERT_EQ(settings.volumes.at(1).size(), 1u);
  EXPECT_EQ(settings.volumes.at(1)[0].name, "part");
  EXPECT_EQ(settings.volumes.at(1)[0].last_triangle, 9u);
  EXPECT_TRUE(settings.plates.empty());
}

TEST(ModelSettings, NamesWhatIsNoNumber) {
  const auto error_of = [](const std::string& xml) {
    try {
      parse_model_settings(xml, "plate.3mf: settings");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error_of("<config><object/></config>"), HasSubstr("plate.3mf: settings: an object's id"));
  EXPECT_THAT(error_of("<config><object id=\"1\"><part id=\"a\"/></object></config>"), HasSubstr("a part's id"));
  EXPECT_THAT(error_of("<config><object id=\"1\"><volume firstid=\"0\"/></object></config>"), HasSubstr("lastid"));
  EXPECT_THAT(error_of("<config><plate/></config>"), HasSubstr("plater_id"));
  EXPECT_THAT(error_of("<config><plate><metadata key=\"plater_id\" value=\"1\"/><model_instance/></plate></config>"),
              HasSubstr("model_instance"));
  EXPECT_THAT(error_of("<config>"), HasSubstr("no XML"));
  EXPECT_EQ(error_of("<other/>"), "no error");
}

}  // namespace
}  // namespace ccslice::cli
