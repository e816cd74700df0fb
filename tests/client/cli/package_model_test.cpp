// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/package_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/client/cli/package_files.h"

namespace ccslice::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::vector<Vec3> kPoints = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1.5, 0), Vec3(0, 0, -2e3)};

std::string error_of(const std::string& xml) {
  try {
    parse_package_model(xml, "plate.3mf: 3D/a.model");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFileSyntax);
    return error.what();
  }
  return "no error";
}

TEST(PackageModel, ReadsObjectsComponentsAndItems) {
  const Placement turned = motion(Vec3::UnitZ(), 90, Vec3(3, 4, 5));
  const PackageModel model = parse_package_model(
      model_text(object_text(1, mesh_text(kPoints), "type=\"support\" name=\"a &amp; b\"") +
                     object_text(2, components_text("<component objectid=\"1\" p:path=\"/3D/o.model\" transform=\"" +
                                                    twelve_numbers(turned) + "\"/>")),
                 item_text(2, turned) + item_text(2, turned, "printable=\"0\"") + "<item objectid=\"1\"/>"),
      "x");
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_EQ(model.objects.at(1).name, "a & b");
  EXPECT_EQ(model.objects.at(1).type, "support");
  EXPECT_EQ(*model.objects.at(1).points, kPoints);
  EXPECT_FALSE(model.objects.at(2).points);
  ASSERT_EQ(model.objects.at(2).components.size(), 1u);
  const ModelComponent& component = model.objects.at(2).components.front();
  EXPECT_EQ(component.path, "/3D/o.model");
  EXPECT_EQ(component.object_id, 1u);
  EXPECT_LT((component.transform * Vec3(1, 0, 0) - Vec3(3, 5, 5)).norm(), 1e-8) << "row vectors, translation last";
  ASSERT_EQ(model.items.size(), 3u);
  EXPECT_TRUE(model.items[0].printable);
  EXPECT_FALSE(model.items[1].printable);
  EXPECT_TRUE(model.items[2].object.transform.matrix().isApprox(Placement::Identity().matrix()));
}

TEST(PackageModel, ScalesPointsAndTranslationsByTheUnit) {
  for (const auto& [unit, mm] : {std::pair("micron", 0.001),
                                 {"millimeter", 1.0},
                                 {"centimeter", 10.0},
                                 {"inch", 25.4},
                                 {"foot", 304.8},
                                 {"meter", 1000.0}}) {
    const PackageModel model = parse_package_model(
        model_text(object_text(1, mesh_text(kPoints)), item_text(1, motion(Vec3::UnitX(), 0, Vec3(1, 2, 3))), unit),
        "x");
    EXPECT_TRUE(model.objects.at(1).points->at(2).isApprox(Vec3(0, 1.5 * mm, 0))) << unit;
    EXPECT_TRUE(model.items.at(0).object.transform.translation().isApprox(mm * Vec3(1, 2, 3))) << unit;
    EXPECT_TRUE(model.items.at(0).object.transform.linear().isIdentity()) << unit;
  }
  EXPECT_THAT(error_of(model_text("", "", "furlong")), AllOf(HasSubstr("3D/a.model"), HasSubstr("'furlong'")));
}

TEST(PackageModel, TakesElementsWithPrefixes) {
  const PackageModel model = parse_package_model(
      "<c:model xmlns:c=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><c:resources><c:object id=\"4\">"
      "<c:mesh><c:vertices><c:vertex x=\"+1\" y=\"2e0\" z=\"3.\"/></c:vertices></c:mesh></c:object></c:resources>"
      "<c:build><c:item objectid=\"4\"/></c:build></c:model>",
      "x");
  EXPECT_EQ(model.objects.at(4).points->at(0), Vec3(1, 2, 3));
  EXPECT_EQ(model.items.size(), 1u);
}

TEST(PackageModel, NamesTheObjectAndWhatIsWrong) {
  const std::string vertex =
      "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"nan\" z=\"0\"/></vertices></mesh>";
  EXPECT_THAT(error_of(model_text(object_text(3, vertex, "name=\"ring\""), "")),
              AllOf(HasSubstr("object 3 'ring'"), HasSubstr("y of vertex 1"), HasSubstr("'nan'")));
  EXPECT_THAT(error_of(model_text(object_text(3, "<mesh><vertices><vertex x=\"1\"/></vertices></mesh>"), "")),
              HasSubstr("y of vertex 0"));
  EXPECT_THAT(error_of(model_text("<object id=\"x\"/>", "")), HasSubstr("an object's id is no whole number: 'x'"));
  EXPECT_THAT(error_of(model_text("<object id=\"99999999999\"/>", "")), HasSubstr("99999999999"));
  EXPECT_THAT(error_of(model_text("<object id=\"1\"/><object id=\"1\"/>", "")), HasSubstr("object 1 is there twice"));
  EXPECT_THAT(error_of(model_text("", "<item/>")), HasSubstr("a build item"));
  for (const char* const transform :
       {"", "1 0 0 0 1 0 0 0 1 0 0", "1 0 0 0 1 0 0 0 1 0 0 x", "1 0 0 0 1 0 0 0 1 0 0 inf"}) {
    EXPECT_THAT(error_of(model_text("", "<item objectid=\"7\" transform=\"" + std::string(transform) + "\"/>")),
                AllOf(HasSubstr("object 7"), HasSubstr("isn't 12 numbers")));
  }
  EXPECT_THAT(error_of(model_text("", "<item objectid=\"7\" transform=\"1 0 0 0 1 0 0 0 1 0 0 0 0\"/>")),
              HasSubstr("more than 12"));
  EXPECT_THAT(error_of(model_text("", "<item objectid=\"7\" transform=\"1 0 0 0 1 0 0 0 0 0 0 0\"/>")),
              HasSubstr("flattens"));
}

TEST(PackageModel, NamesWhatIsNoXml) {
  EXPECT_THAT(error_of(""), HasSubstr("no XML"));
  EXPECT_THAT(error_of("<model><resources></model>"), AllOf(HasSubstr("no XML"), HasSubstr("at byte")));
  EXPECT_THAT(error_of("<scene/>"), HasSubstr("no model element"));
  std::string deep;
  for (int i = 0; i < 1'000'000; ++i) deep += "<a>";
  EXPECT_THAT(error_of(deep), HasSubstr("no XML"));
}

TEST(PackageModel, PathsStayInThePackage) {
  EXPECT_EQ(package_entry("/3D/Objects/object_1.model", "x"), "3D/Objects/object_1.model");
  EXPECT_EQ(package_entry("3D/a.model", "x"), "3D/a.model");
  for (const char* const path : {"", "/", "/3D/../../secret", "../a", "/3D/./a", "//a", "/a/", "/3D\\a"}) {
    EXPECT_THROW(package_entry(path, "x"), Error) << path;
  }
}

}  // namespace
}  // namespace ccslice::cli
