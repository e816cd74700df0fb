// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/cli/options/job.h"
#include "client/cli/options/map_overrides.h"
#include "client/cli/options/printing.h"
#include "core/base/number_text.h"

namespace ccslice::cli {
namespace {

v1::MaterialMap map_of(const std::string& text) {
  return parse_printing({.materials = {"a=#102030"}, .maps = {text}, .background = ""})->map();
}

TEST(PrintingOptions, NameMaterialsAndColours) {
  EXPECT_FALSE(parse_printing({.materials = {}, .maps = {}, .background = ""}));
  const auto printing = parse_printing({.materials = {"soft=#102030", "a=b=#A0b0C080"},
                                        .maps = {},
                                        .halftone = "error-diffusion",
                                        .seed = 7,
                                        .background = "#ffffff"});
  ASSERT_TRUE(printing);
  EXPECT_EQ(printing->materials(0).name(), "soft");
  EXPECT_EQ(printing->materials(0).rgba(), 0x102030ffu);
  EXPECT_EQ(printing->materials(1).name(), "a=b");
  EXPECT_EQ(printing->materials(1).rgba(), 0xa0b0c080u);
  EXPECT_EQ(printing->background_rgba(), 0xffffffffu);
  EXPECT_EQ(printing->halftone().method(), v1::HALFTONE_METHOD_ERROR_DIFFUSION);
  EXPECT_EQ(printing->halftone().seed(), 7u);
  EXPECT_FALSE(printing->has_map());
  for (const char* bad : {"soft", "soft=", "=#102030", "soft=102030", "soft=#10203", "soft=#10203g", "soft=#"}) {
    EXPECT_THROW(parse_printing({.materials = {bad}, .maps = {}, .background = ""}), UsageError) << bad;
  }
}

TEST(PrintingOptions, ReadOverridesOfAllMaps) {
  const std::vector<std::string> where = {"depth<0.5=hard", "\"a<b\"<-1e-3=y"};
  const auto alone = parse_printing(
      {.materials = {"soft=#102030", "hard=#ffffff"}, .maps = {}, .overrides = {.where = where}, .background = ""});
  EXPECT_EQ(alone->map().material(), "soft") << "takes the rest";
  ASSERT_EQ(alone->map().overrides_size(), 2);
  EXPECT_EQ(alone->map().overrides(0).channel(), "depth");
  EXPECT_EQ(alone->map().overrides(0).below(), 0.5);
  EXPECT_EQ(alone->map().overrides(0).material(), "hard");
  EXPECT_EQ(alone->map().overrides(1).channel(), "a<b");
  EXPECT_EQ(alone->map().overrides(1).below(), -1e-3);
  const auto regions = parse_printing({.materials = {"soft=#102030"},
                                       .maps = {"region:core=soft,shell=soft"},
                                       .overrides = {.where = where},
                                       .background = ""});
  EXPECT_FALSE(regions->has_map());
  EXPECT_EQ(regions->cell_region_maps(1).map().overrides_size(), 2);
  for (const char* bad :
       {"", "depth", "depth<=hard", "depth<0.5", "<0.5=hard", "depth<x=hard", "depth>0.5=hard", "depth=hard"}) {
    EXPECT_THROW(
        parse_printing({.materials = {"a=#102030"}, .maps = {}, .overrides = {.where = {bad}}, .background = ""}),
        UsageError)
        << bad;
  }
}

TEST(PrintingOptions, ReadNothing) {
  const auto black = parse_printing({.materials = {"soft=#102030", "void"}, .maps = {}, .background = ""});
  EXPECT_FALSE(black->materials(0).leaves_empty());
  EXPECT_TRUE(black->materials(1).leaves_empty());
  EXPECT_EQ(black->materials(1).rgba(), 0x000000ffu);
  const auto white = parse_printing({.materials = {"soft=#102030", "void"}, .maps = {}, .background = "#ffffff"});
  EXPECT_EQ(white->materials(1).rgba(), 0xffffffffu) << "the background's";
  const auto own = parse_printing({.materials = {"soft=#102030", "void=#00000000"}, .maps = {}, .background = ""});
  EXPECT_TRUE(own->materials(1).leaves_empty());
  EXPECT_EQ(own->materials(1).rgba(), 0u);
  const auto weighed =
      parse_printing({.materials = {"soft=#102030", "void"}, .maps = {}, .background = "", .densities = {"1.2"}});
  EXPECT_EQ(weighed->materials(0).density_g_per_cm3(), 1.2);
  EXPECT_EQ(weighed->materials(1).density_g_per_cm3(), 0);
  EXPECT_THROW(parse_printing({.materials = {"Void=#102030"}, .maps = {}, .background = ""}), UsageError);
  EXPECT_THROW(
      parse_printing({.materials = {"soft=#102030", "void"}, .maps = {}, .background = "", .densities = {"void=1"}}),
      UsageError);
}

TEST(PrintingOptions, ReadShellsAndWhatIsKeptOutByCellRegion) {
  const OverrideOptions options{.where = {"x<1=soft", "region:core=y<2=hard"},
                                .shells = {"0.5=hard", "0.25=soft", "region:\"a,b\"=0.75=soft"},
                                .keep_outs = {"soft=2:hard", "region:core=hard=0.5:soft"}};
  const auto field = parse_depth_field(options);
  ASSERT_TRUE(field);
  EXPECT_EQ(field->formula(), "distance(2)") << "the farthest";
  EXPECT_FALSE(parse_depth_field({.where = {"x<1=soft"}}));
  const auto printing = parse_printing({.materials = {"soft=#102030", "hard=#ffffff"},
                                        .maps = {"region:core=hard", "blend:x:0=soft,1=hard"},
                                        .overrides = options,
                                        .background = ""});
  const auto texts = [](const v1::MaterialMap& map) {
    std::vector<std::string> all;
    for (const v1::MapOverride& own : map.overrides()) {
      all.push_back(own.channel() + "<" + number_text(own.below()) + "=" + own.material() +
                    (own.instead_of().empty() ? "" : " instead of " + own.instead_of()));
    }
    return all;
  };
  const std::string depth = field->name();
  const std::vector<std::string> for_all = {"x<1=soft", depth + "<0.5=hard", depth + "<0.75=soft",
                                            depth + "<2=hard instead of soft"};
  const auto with = [&](std::vector<std::string> own) {
    own.insert(own.end(), for_all.begin(), for_all.end());
    return own;
  };
  EXPECT_EQ(texts(printing->map()), for_all);
  ASSERT_EQ(printing->cell_region_maps_size(), 2);
  EXPECT_EQ(printing->cell_region_maps(0).cell_region(), "core");
  EXPECT_EQ(texts(printing->cell_region_maps(0).map()), with({"y<2=hard", depth + "<0.5=soft instead of hard"}));
  EXPECT_EQ(printing->cell_region_maps(1).cell_region(), "a,b");
  EXPECT_EQ(texts(printing->cell_region_maps(1).map()), with({depth + "<0.75=soft"}));
  EXPECT_EQ(printing->cell_region_maps(1).map().blend().channel(), "x") << "begins as the map of all";
  for (const char* bad : {"", "soft", "soft=0.5", "soft=0.5:", "=0.5:hard", "soft=x:hard", "soft=0:hard",
                          "soft=-1:hard", "region:=soft=1:hard", "region:core"}) {
    EXPECT_THROW((void)parse_overrides({.keep_outs = {bad}}), UsageError) << bad;
  }
  EXPECT_THROW(parse_printing({.materials = {"soft=#102030"},
                               .maps = {"region:core=soft"},
                               .overrides = {.shells = {"region:shell=1=soft"}},
                               .background = ""}),
               UsageError)
      << "a region without a map";
}

TEST(PrintingOptions, ReadEveryKindOfMap) {
  const v1::MaterialMap blend = map_of("blend:hardness:0=soft,0.5=mid,1=hard");
  EXPECT_EQ(blend.blend().channel(), "hardness");
  EXPECT_EQ(blend.blend().stops_size(), 3);
  EXPECT_EQ(blend.blend().stops(1).value(), 0.5);
  EXPECT_EQ(blend.blend().stops(2).material(), "hard");
  const v1::MaterialMap curve = map_of("calibration:stiffness:hard/soft:20=0,95.5=1");
  EXPECT_EQ(curve.calibration().material(), "hard");
  EXPECT_EQ(curve.calibration().base(), "soft");
  EXPECT_EQ(curve.calibration().points(1).property(), 95.5);
  const v1::MaterialMap direct = map_of("direct:x=soft,y=hard,rest=clear");
  EXPECT_EQ(direct.direct().shares_size(), 2);
  EXPECT_EQ(direct.direct().shares(1).channel(), "y");
  EXPECT_EQ(direct.direct().rest_material(), "clear");
  const v1::MaterialMap colour = map_of("colour:r,g,b:255");
  EXPECT_EQ(colour.colour().blue_channel(), "b");
  EXPECT_EQ(colour.colour().full_value(), 255);
  for (const char* bad :
       {"blend", "blend:x", "blend:x:soft", "blend:x:y=soft", "calibration:x:hard:0=1", "colour:r,g", "mix:x:0=a"}) {
    EXPECT_THROW(map_of(bad), UsageError) << bad;
  }
}

TEST(PrintingOptions, TakeNamesOfChannelsWithColons) {
  EXPECT_EQ(map_of("blend:S:Mises:0=a,10=b").blend().channel(), "S:Mises");
  EXPECT_EQ(map_of("blend:\"S:Mises\":0=a,10=b").blend().channel(), "S:Mises");
  EXPECT_EQ(map_of("blend:\"0=a:1\":0=a,10=b").blend().channel(), "0=a:1");
  const v1::CalibrationMap curve = map_of("calibration:a:b:c:hard/soft:20=0,95=1").calibration();
  EXPECT_EQ(curve.channel(), "a:b:c");
  EXPECT_EQ(curve.material(), "hard");
  EXPECT_EQ(map_of("calibration:\"a/b:2\":hard/soft:20=0,95=1").calibration().channel(), "a/b:2");
  const v1::DirectMap direct = map_of("direct:u:1=soft,\"v,2=\"=hard,\"rest\"=clear,rest=mid").direct();
  ASSERT_EQ(direct.shares_size(), 3);
  EXPECT_EQ(direct.shares(0).channel(), "u:1");
  EXPECT_EQ(direct.shares(1).channel(), "v,2=");
  EXPECT_EQ(direct.shares(2).channel(), "rest");
  EXPECT_EQ(direct.rest_material(), "mid");
  const v1::ColourMap colour = map_of("colour:\"S:1\",g,\"S,3\":255").colour();
  EXPECT_EQ(colour.red_channel(), "S:1");
  EXPECT_EQ(colour.blue_channel(), "S,3");
  EXPECT_EQ(colour.full_value(), 255);
  EXPECT_EQ(map_of("colour:\"S:1\",g,\"S:3\"").colour().full_value(), 0);
  EXPECT_EQ(map_of("colour:S:r,S:g,S:b").colour().blue_channel(), "S:b");
}

// A number behind the last colon may be the full value or the end of a name.
TEST(PrintingOptions, RefuseColoursThatCanBeReadInTwoWays) {
  for (const char* bad : {"colour:S:1,S:2,S:3", "colour:r,g,S:b:255"}) {
    try {
      FAIL() << map_of(bad).colour().blue_channel();
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("between quotation marks"));
    }
  }
  for (const char* bad : {"colour:r,g", "colour:r,g,b,a", "colour:\"r,g,b\"", "blend:\"x\"", "blend:\"x:0=a"}) {
    EXPECT_THROW(map_of(bad), UsageError) << bad;
  }
}

TEST(PrintingOptions, SayWhatTheyTake) {
  const auto error_of = [](const std::string& material, const std::string& map) -> std::string {
    try {
      static_cast<void>(parse_printing({.materials = {material}, .maps = {map}, .background = ""}));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "no error";
  };
  const std::string map = "material:a", material = "a=#102030";
  EXPECT_EQ(
      error_of("soft", map),
      "--material takes NAME=#RRGGBB, the name of a resin that `ccslice printers` lists, or void for nothing, not "
      "'soft'");
  EXPECT_EQ(error_of(material, "blend:x:soft,hard"), "--map blend takes VALUE=MATERIAL, not 'soft'");
  EXPECT_EQ(error_of(material, "direct:soft"), "--map direct takes CHANNEL=MATERIAL, not 'soft'");
  EXPECT_EQ(error_of(material, "calibration:x:a/b:0"), "--map calibration takes PROPERTY=FRACTION, not '0'");
  EXPECT_EQ(
      error_of(material, "hardness"),
      "--map takes direct:..., blend:..., calibration:..., colour:..., material:... or region:..., as in its help, "
      "not 'hardness'");
}

TEST(PrintingOptions, GiveCellRegionsMapsOfTheirOwn) {
  const auto printing =
      parse_printing({.materials = {"soft=#102030"},
                      .maps = {"region:core=blend:x:0=soft,1=hard", "region:shell=hard,2=soft", "material:clear"},
                      .strict = true,
                      .background = ""});
  EXPECT_EQ(printing->map().material(), "clear");
  ASSERT_EQ(printing->cell_region_maps_size(), 3);
  EXPECT_EQ(printing->cell_region_maps(0).cell_region(), "core");
  EXPECT_EQ(printing->cell_region_maps(0).map().blend().stops(1).material(), "hard");
  EXPECT_TRUE(printing->cell_region_maps(0).map().strict());
  EXPECT_EQ(printing->cell_region_maps(1).cell_region(), "shell");
  EXPECT_EQ(printing->cell_region_maps(1).map().material(), "hard");
  EXPECT_EQ(printing->cell_region_maps(2).cell_region(), "2");
  const auto in_one = parse_printing(
      {.materials = {"soft=#102030"},
       .maps = {"region:core=blend:x:0=soft,1.5=hard,shell=hard,rim=colour:r,g,b:255,2=soft,foot=direct:y=soft,z=hard"},
       .background = ""});
  ASSERT_EQ(in_one->cell_region_maps_size(), 5);
  EXPECT_EQ(in_one->cell_region_maps(0).map().blend().stops_size(), 2);
  EXPECT_EQ(in_one->cell_region_maps(1).map().material(), "hard");
  EXPECT_EQ(in_one->cell_region_maps(2).map().colour().blue_channel(), "b");
  EXPECT_EQ(in_one->cell_region_maps(3).cell_region(), "2");
  EXPECT_EQ(in_one->cell_region_maps(4).map().direct().shares_size(), 2);
  for (const std::vector<std::string>& bad : {std::vector<std::string>{"region:"},
                                              {"region:\"\"=soft"},
                                              {"region:\"a"},
                                              {"region:\"a\"="},
                                              {"region:core"},
                                              {"region:core="},
                                              {"region:=blend:x:0=a,1=b"},
                                              {"region:core=mix:x"},
                                              {"blend:x:0=a,1=b", "material:a"}}) {
    EXPECT_THROW(parse_printing({.materials = {"a=#102030"}, .maps = bad, .background = ""}), UsageError) << bad[0];
  }
}

TEST(PrintingOptions, TakeNamesOfCellRegionsInQuotationMarks) {
  const auto printing = parse_printing(
      {.materials = {"soft=#102030"},
       .maps = {"region:\"a,b=c\"=blend:x:0=soft,1=hard,\"d, \"e\"\"=soft,f=hard", "region:\"g\"=direct:y=soft,z=hard"},
       .background = ""});
  ASSERT_EQ(printing->cell_region_maps_size(), 4);
  EXPECT_EQ(printing->cell_region_maps(0).cell_region(), "a,b=c");
  EXPECT_EQ(printing->cell_region_maps(0).map().blend().stops_size(), 2);
  EXPECT_EQ(printing->cell_region_maps(1).cell_region(), "d, \"e\"");
  EXPECT_EQ(printing->cell_region_maps(1).map().material(), "soft");
  EXPECT_EQ(printing->cell_region_maps(2).cell_region(), "f");
  EXPECT_EQ(printing->cell_region_maps(3).cell_region(), "g");
  EXPECT_EQ(printing->cell_region_maps(3).map().direct().shares_size(), 2);
  try {
    FAIL() << parse_printing({.materials = {"soft=#102030"}, .maps = {"region:a,b=soft"}, .background = ""})
                  ->cell_region_maps_size();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("not 'a'; names with commas or '=' go between quotation marks"));
  }
}

TEST(PrintingOptions, GiveAPictureOfMaterialsAndMasks) {
  const auto printing = parse_printing({.materials = {"a=#102030", "b=#405060"}, .maps = {}, .background = ""});
  const auto planes = parse_planes({.channels = {}, .masks = true}, false, &*printing);
  ASSERT_EQ(planes.size(), 3u);
  EXPECT_TRUE(planes[0].has_materials());
  EXPECT_EQ(planes[0].encoding(), v1::PLANE_ENCODING_PNG);
  EXPECT_EQ(planes[2].material_mask().material(), "b");
  EXPECT_EQ(parse_planes({.channels = {}, .encoding = "png-rgba"}, false, &*printing)[0].encoding(),
            v1::PLANE_ENCODING_PNG_RGBA);
  EXPECT_THROW(parse_planes({.channels = {}, .masks = true}, false), UsageError);
  EXPECT_THROW(parse_planes({.channels = {}, .encoding = "tiff"}, false, &*printing), UsageError);
}

std::vector<v1::PlaneSpec> planes_with(const std::string& outside, const std::string& encoding,
                                       std::vector<std::string> channels) {
  return parse_planes({.occupancy = true, .channels = std::move(channels), .encoding = encoding, .outside = outside},
                      false, nullptr);
}

TEST(PlaneOptions, SayWhatIsOutside) {
  EXPECT_FALSE(planes_with("", "auto", {"a"})[1].has_outside_sample());
  const auto planes = planes_with("255", "auto", {"a", "b:u16", "c:f32"});
  EXPECT_FALSE(planes[0].has_outside_sample()) << "occupancies have none";
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(planes[i].outside_sample(), 255);
  EXPECT_TRUE(std::isnan(planes_with("nan", "auto", {"c:f32"})[1].outside_sample()));
  for (const char* bad : {"256", "-1", "1.5", "nan", "white", "1e400"}) {
    EXPECT_THROW(planes_with(bad, "auto", {"a"}), UsageError) << bad;
  }
  EXPECT_THROW(planes_with("1", "auto", {}), UsageError) << "no channel";
}

TEST(PlaneOptions, GiveChannelsAlpha) {
  const auto png = planes_with("alpha", "auto", {"a:u16"});
  EXPECT_EQ(png[0].encoding(), v1::PLANE_ENCODING_PNG) << "occupancies have none";
  EXPECT_EQ(png[1].encoding(), v1::PLANE_ENCODING_PNG_ALPHA);
  EXPECT_EQ(planes_with("alpha", "tiff", {"a:f32"})[1].encoding(), v1::PLANE_ENCODING_TIFF_ALPHA);
  for (const char* encoding : {"zstd", "raw"}) EXPECT_THROW(planes_with("alpha", encoding, {"a"}), UsageError);
  EXPECT_THROW(planes_with("alpha", "exr", {"a:f32"}), UsageError);
}

}  // namespace
}  // namespace ccslice::cli
