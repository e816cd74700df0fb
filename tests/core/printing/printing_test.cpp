// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/printing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/base/error.h"

namespace ccslice {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SolidSummary four_channels() {
  SolidSummary summary;
  summary.channels = {{"stiffness", 0, 100}, {"r", 0, 1}, {"g", 0, 1}, {"b", 0, 1}};
  summary.cell_regions.resize(2);
  summary.cell_regions[0].name = "core";
  summary.cell_regions[1].name = "shell";
  return summary;
}

Printing good_printing() {
  Printing printing;
  printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x00ff00ff}, {"clear", 0x0000ffff}};
  printing.map.kind = BlendMap{"stiffness", {{0, 1}, {50, 3}, {100, 2}}};
  return printing;
}

BlendMap& blend(Printing& printing) { return std::get<BlendMap>(printing.map.kind); }

CalibrationMap& curve(Printing& printing) {
  printing.map.kind = CalibrationMap{"stiffness", 1, 2, {{0, 0}, {10, 0.2}, {50, 1}}};
  return std::get<CalibrationMap>(printing.map.kind);
}

DirectMap& direct(Printing& printing) {
  printing.map.kind = DirectMap{{{"r", 1}, {"g", 2}}, 3};
  return std::get<DirectMap>(printing.map.kind);
}

ColourMap& colour(Printing& printing) {
  printing.map.kind = ColourMap{"r", "g", "b", 1};
  return std::get<ColourMap>(printing.map.kind);
}

// One way to spoil a good request, and what the user is told.
struct Spoiled {
  const char* name;
  std::function<void(Printing&)> spoil;
  ErrorCode code;
  const char* field;
};

class ValidatePrinting : public testing::TestWithParam<Spoiled> {};

TEST_P(ValidatePrinting, NamesTheFieldAndTheReason) {
  Printing printing = good_printing();
  GetParam().spoil(printing);
  try {
    validate_printing(printing, four_channels());
    FAIL() << "passed";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), GetParam().code) << error.what();
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_THAT(error.what(), testing::StartsWith(GetParam().field));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, ValidatePrinting,
    testing::Values(Spoiled{"NoMaterials", [](Printing& p) { p.materials.clear(); }, ErrorCode::kMaterialsMissing,
                            "printing.materials"},
                    Spoiled{"NineMaterials",
                            [](Printing& p) {
                              while (p.materials.size() < 9) {
                                p.materials.push_back({std::to_string(p.materials.size()),
                                                       0x01010101u * static_cast<unsigned>(p.materials.size())});
                              }
                            },
                            ErrorCode::kTooManyMaterials, "printing.materials"},
                    Spoiled{"EmptyName", [](Printing& p) { p.materials[1].name.clear(); },
                            ErrorCode::kMaterialNameInvalid, "printing.materials[1].name"},
                    Spoiled{"LongName", [](Printing& p) { p.materials[2].name.assign(65, 'x'); },
                            ErrorCode::kMaterialNameInvalid, "printing.materials[2].name"},
                    Spoiled{"SameNames", [](Printing& p) { p.materials[2].name = "soft"; },
                            ErrorCode::kMaterialNameRepeated, "printing.materials[2].name"},
                    Spoiled{"SameColours", [](Printing& p) { p.materials[1].rgba = 0xff0000ff; },
                            ErrorCode::kMaterialColourRepeated, "printing.materials[1].rgba"},
                    Spoiled{"ColourOfTheBackground", [](Printing& p) { p.background_rgba = 0x0000ffff; },
                            ErrorCode::kMaterialColourRepeated, "printing.materials[2].rgba"},
                    Spoiled{"NoMap", [](Printing& p) { p.map.kind = std::monostate(); }, ErrorCode::kMaterialMapMissing,
                            "printing.map"},
                    Spoiled{"UnknownChannel", [](Printing& p) { blend(p).channel = "s"; }, ErrorCode::kChannelUnknown,
                            "printing.map.blend.channel"},
                    Spoiled{"UnknownMaterial", [](Printing& p) { blend(p).stops[1].material = 4; },
                            ErrorCode::kMaterialUnknown, "printing.map.blend.stops[1].material"},
                    Spoiled{"OneStop", [](Printing& p) { blend(p).stops.resize(1); }, ErrorCode::kMaterialMapInvalid,
                            "printing.map.blend.stops"},
                    Spoiled{"StopsThatFall", [](Printing& p) { blend(p).stops[2].value = 50; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.blend.stops[2].value"},
                    Spoiled{"NanStop", [](Printing& p) { blend(p).stops[1].value = kNan; },
                            ErrorCode::kMaterialMapNonFinite, "printing.map.blend.stops[1].value"},
                    Spoiled{"CurveOfOneMaterial", [](Printing& p) { curve(p).base = 1; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.calibration.base"},
                    Spoiled{"NanFraction", [](Printing& p) { curve(p).points[1].fraction = kNan; },
                            ErrorCode::kMaterialMapNonFinite, "printing.map.calibration.points[1].fraction"},
                    Spoiled{"FractionAboveOne", [](Printing& p) { curve(p).points[2].fraction = 1.01; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.calibration.points[2].fraction"},
                    Spoiled{"InfiniteProperty", [](Printing& p) { curve(p).points[2].property = 1 / 0.0; },
                            ErrorCode::kMaterialMapNonFinite, "printing.map.calibration.points[2].property"},
                    Spoiled{"NoShares", [](Printing& p) { direct(p).shares.clear(); }, ErrorCode::kMaterialMapInvalid,
                            "printing.map.direct.shares"},
                    Spoiled{"TwoSharesOfOneMaterial", [](Printing& p) { direct(p).shares[1].material = 1; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.direct.shares[1].material"},
                    Spoiled{"RestWithAShare", [](Printing& p) { direct(p).rest_material = 2; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.direct.rest_material"},
                    Spoiled{"DarkColours", [](Printing& p) { colour(p).full_value = -1; },
                            ErrorCode::kMaterialMapInvalid, "printing.map.colour.full_value"},
                    Spoiled{"NanColours", [](Printing& p) { colour(p).full_value = kNan; },
                            ErrorCode::kMaterialMapNonFinite, "printing.map.colour.full_value"},
                    Spoiled{"UnknownColourChannel", [](Printing& p) { colour(p).green = 7; },
                            ErrorCode::kChannelUnknown, "printing.map.colour.green_channel"},
                    Spoiled{"UnknownPureMaterial", [](Printing& p) { p.map.kind = PureMap{4}; },
                            ErrorCode::kMaterialUnknown, "printing.map.material"},
                    Spoiled{"OverrideOfAnUnknownChannel",
                            [](Printing& p) {
                              p.map.overrides = {{"r", 0.5, 1}, {"depth", 0.5, 1}};
                            },
                            ErrorCode::kChannelUnknown, "printing.map.overrides[1].channel"},
                    Spoiled{"OverrideByAnUnknownMaterial",
                            [](Printing& p) {
                              p.map.overrides = {{"r", 0.5, 4}};
                            },
                            ErrorCode::kMaterialUnknown, "printing.map.overrides[0].material"},
                    Spoiled{"OverrideBelowNan",
                            [](Printing& p) {
                              p.map.overrides = {{"r", kNan, 1}};
                            },
                            ErrorCode::kMaterialMapNonFinite, "printing.map.overrides[0].below"},
                    Spoiled{"OverrideInsteadOfAnUnknownMaterial",
                            [](Printing& p) {
                              p.map.overrides = {{"r", 0.5, 1, 4}};
                            },
                            ErrorCode::kMaterialUnknown, "printing.map.overrides[0].instead_of"},
                    Spoiled{"OverrideInsteadOfItself",
                            [](Printing& p) {
                              p.map.overrides = {{"r", 0.5, 1}, {"r", 0.5, 1, 1}};
                            },
                            ErrorCode::kMaterialMapInvalid, "printing.map.overrides[1].material"},
                    Spoiled{"OverrideByWhatIsKeptOut",
                            [](Printing& p) {
                              p.map.overrides = {{"r", 0.5, 1, 2}, {"r", 0.5, 3, 1}};
                            },
                            ErrorCode::kMaterialMapInvalid, "printing.map.overrides[0].material"},
                    Spoiled{"NothingThatIsPrinted",
                            [](Printing& p) {
                              for (PrintMaterial& material : p.materials) material.leaves_empty = true;
                            },
                            ErrorCode::kMaterialsMissing, "printing.materials"},
                    Spoiled{"TooManyOverrides",
                            [](Printing& p) {
                              p.map.overrides.assign(17, {"r", 0.5, 1});
                            },
                            ErrorCode::kMaterialMapInvalid, "printing.map.overrides"},
                    Spoiled{"OverrideInACellRegion",
                            [](Printing& p) {
                              p.cell_region_maps = {{1, {PureMap{1}}}};
                              p.cell_region_maps[0].map.overrides = {{"s", 0.5, 1}};
                            },
                            ErrorCode::kChannelUnknown, "printing.cell_region_maps[0].map.overrides[0].channel"},
                    Spoiled{"UnknownCellRegion",
                            [](Printing& p) {
                              p.cell_region_maps = {{2, {PureMap{1}}}};
                            },
                            ErrorCode::kCellRegionUnknown, "printing.cell_region_maps[0].cell_region"},
                    Spoiled{"TwoMapsOfOneRegion",
                            [](Printing& p) {
                              p.cell_region_maps = {{1, {PureMap{1}}}, {1, {PureMap{2}}}};
                            },
                            ErrorCode::kMaterialMapInvalid, "printing.cell_region_maps[1].cell_region"},
                    Spoiled{"EmptyMapOfARegion",
                            [](Printing& p) {
                              p.cell_region_maps = {{1, {}}};
                            },
                            ErrorCode::kMaterialMapMissing, "printing.cell_region_maps[0].map"},
                    Spoiled{"BadMapOfARegion",
                            [](Printing& p) {
                              p.cell_region_maps = {{0, {PureMap{1}}}, {1, {BlendMap{"stiffness", {{0, 1}, {1, 9}}}}}};
                            },
                            ErrorCode::kMaterialUnknown, "printing.cell_region_maps[1].map.blend.stops[1].material"},
                    Spoiled{"NoMapForTheOtherRegion",
                            [](Printing& p) {
                              p.map = {};
                              p.cell_region_maps = {{1, {PureMap{1}}}};
                            },
                            ErrorCode::kMaterialMapMissing, "printing.map"},
                    Spoiled{"UnknownMethod", [](Printing& p) { p.halftone.method = static_cast<HalftoneMethod>(9); },
                            ErrorCode::kEnumValueUnknown, "printing.halftone.method"}),
    [](const testing::TestParamInfo<Spoiled>& info) { return info.param.name; });

TEST(ValidatePrinting, NamesACellRegionWithoutAMap) {
  Printing printing = good_printing();
  printing.map = {};
  printing.cell_region_maps = {{1, {PureMap{1}}}};
  try {
    validate_printing(printing, four_channels());
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("\"core\" has no map"));
  }
}

TEST(ValidatePrinting, TakesEveryKindOfMap) {
  Printing printing = good_printing();
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  curve(printing);
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  direct(printing);
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  colour(printing);
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  printing.map.kind = PureMap{2};
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  printing.map = {};
  printing.cell_region_maps = {{1, {PureMap{2}}}, {0, {BlendMap{"r", {{0, 1}, {1, 2}}}}}};
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
  printing.cell_region_maps.clear();
  printing.materials.resize(1);
  EXPECT_NO_THROW(validate_printing(printing, four_channels()));
}

TEST(SteepestSpan, IsThatOfTheSteepestSegment) {
  Printing printing = good_printing();
  blend(printing).stops[1].value = 80;
  EXPECT_EQ(steepest_span(printing.map), 20);
  curve(printing);
  EXPECT_NEAR(steepest_span(printing.map), 50, 1e-9);
  direct(printing);
  EXPECT_EQ(steepest_span(printing.map), 1);
}

TEST(SteepestSpan, OfAChannelIsTheLeastOfItsMaps) {
  Printing printing = good_printing();
  printing.cell_region_maps = {
      {0, {PureMap{1}}}, {1, {BlendMap{"stiffness", {{0, 1}, {7, 2}}}}}, {2, {DirectMap{{{"g", 1}}, 2}}}};
  EXPECT_EQ(steepest_span(printing, "stiffness"), 7);
  EXPECT_EQ(steepest_span(printing, "g"), 1);
  EXPECT_EQ(steepest_span(printing, "r"), std::numeric_limits<double>::infinity());
}

TEST(ChannelsOf, NamesThoseOfAllMaps) {
  Printing printing = good_printing();
  printing.cell_region_maps = {{0, {PureMap{1}}}, {1, {DirectMap{{{"g", 1}, {"stiffness", 2}}, 0}}}};
  EXPECT_THAT(channels_of(printing), testing::ElementsAre("stiffness", "g"));
}

TEST(ChannelsOf, NamesEachOnce) {
  EXPECT_THAT(channels_of({DirectMap{{{"g", 1}, {"b", 2}, {"g", 3}}, 0}}), testing::ElementsAre("g", "b"));
  EXPECT_THAT(channels_of({ColourMap{"r", "r", "r", 1}}), testing::ElementsAre("r"));
}

}  // namespace
}  // namespace ccslice
