// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/tray_package.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/client/cli/package_files.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::uint64_t kMost = 64 << 20;
const std::vector<Vec3> kCorners = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
const std::string kStart =
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Id=\"r\" "
    "Target=\"/3D/other.model\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";

std::string component(int id, const std::string& path = "", const Placement& placement = Placement::Identity()) {
  return "<component " + (path.empty() ? "" : "p:path=\"" + path + "\" ") + "objectid=\"" + std::to_string(id) +
         "\" transform=\"" + twelve_numbers(placement) + "\"/>";
}

Placement shift(double x, double y, double z) { return motion(Vec3::UnitX(), 0, Vec3(x, y, z)); }

class TrayPackageTest : public testing::Test {
 protected:
  TrayPackage read(const PackageEntries& entries, std::uint64_t most = kMost) {
    return read_tray_package(write_package(path_, entries), most);
  }
  TrayPackage read_model(const std::string& resources, const std::string& items) {
    return read({{"3D/3dmodel.model", model_text(resources, items)}});
  }
  std::string error_of(const PackageEntries& entries, std::uint64_t most = kMost) {
    try {
      read(entries, most);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path_));
      return error.what();
    }
    return "no error";
  }
  std::string error_of_model(const std::string& resources, const std::string& items) {
    return error_of({{"3D/3dmodel.model", model_text(resources, items)}});
  }

  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "plate.3mf").string();
};

TEST_F(TrayPackageTest, ReadsCopiesAsPrusaSlicerWritesThem) {
  const TrayPackage package = read(
      {{"3D/3dmodel.model",
        model_text(object_text(1, mesh_text(kCorners)) + object_text(2, components_text("<component objectid=\"1\"/>")),
                   item_text(1, shift(1, 2, 3), "printable=\"1\"") + item_text(2, shift(4, 5, 6), "printable=\"0\""))},
       {"Metadata/Slic3r_PE_model.config",
        "<config><object id=\"1\"><metadata type=\"object\" key=\"name\" value=\"ring\"/></object></config>"}});
  ASSERT_EQ(package.instances.size(), 2u);
  EXPECT_EQ(package.instances[0].label, "object 1 'ring'");
  EXPECT_EQ(package.instances[1].label, "object 2 'ring'") << "the name is that of the object that it copies";
  EXPECT_EQ(*package.instances[1].points, kCorners);
  EXPECT_EQ(package.instances[1].placement.translation(), Vec3(4, 5, 6));
  EXPECT_TRUE(package.instances[0].printable);
  EXPECT_FALSE(package.instances[1].printable);
  EXPECT_FALSE(package.instances[0].plate);
  EXPECT_TRUE(package.plates.empty());
}

TEST_F(TrayPackageTest, TellsVolumesInOneMeshApart) {
  std::vector<Vec3> points = kCorners;
  for (const Vec3& corner : kCorners) points.push_back(corner + Vec3(5, 5, 5));
  const std::string mesh = mesh_text(points);
  const std::string two = mesh.substr(0, mesh.find("<triangles>")) +
                          "<triangles><triangle v1=\"0\" v2=\"1\" v3=\"3\"/><triangle v1=\"4\" v2=\"7\" v3=\"5\"/>"
                          "</triangles></mesh>";
  const auto settings = [](const std::string& last) {
    return "<config><object id=\"1\"><metadata type=\"object\" key=\"name\" value=\"ring\"/><volume firstid=\"0\" "
           "lastid=\"0\"><metadata type=\"volume\" key=\"volume_type\" value=\"ModelPart\"/></volume><volume "
           "firstid=\"1\" lastid=\"" +
           last +
           "\"><metadata type=\"volume\" key=\"name\" value=\"cube\"/><metadata type=\"volume\" "
           "key=\"volume_type\" value=\"ParameterModifier\"/></volume></object></config>";
  };
  const std::string model =
      model_text(object_text(1, two), item_text(1, shift(1, 2, 3)) + item_text(1, shift(0, 0, 0)));
  const TrayPackage package = read({{"3D/3dmodel.model", model}, {"Metadata/Slic3r_PE_model.config", settings("1")}});
  ASSERT_EQ(package.instances.size(), 4u);
  EXPECT_EQ(*package.instances[0].points, kCorners);
  EXPECT_EQ(package.instances[0].aid, "");
  EXPECT_EQ(package.instances[1].points->front(), Vec3(5, 5, 5));
  EXPECT_EQ(package.instances[1].aid, "ParameterModifier");
  EXPECT_EQ(package.instances[1].name, "cube");
  EXPECT_EQ(package.instances[2].points, package.instances[0].points) << "held once";
  EXPECT_THAT(
      error_of({{"3D/3dmodel.model", model_text(object_text(1, mesh_text(kCorners)), item_text(1, shift(0, 0, 0)))},
                {"Metadata/Slic3r_PE_model.config", settings("1")}}),
      AllOf(HasSubstr("object 1 'ring'"), HasSubstr("'cube'")));
}

TEST_F(TrayPackageTest, ReadsPartsAndPlatesAsBambuStudioWritesThem) {
  const Placement turned = motion(Vec3(1, 1, 0), 30, Vec3(7, 8, 9));
  const TrayPackage package = read(
      {{"_rels/.rels", kStart},
       {"3D/other.model",
        model_text(object_text(2, components_text(component(1, "/3D/Objects/object_1.model", shift(0, 0, 5)) +
                                                  component(3, "/3D/Objects/object_1.model"))),
                   item_text(2, turned) + item_text(2, shift(100, 0, 0)) + item_text(2, shift(0, 300, 0)))},
       {"3D/Objects/object_1.model",
        model_text(object_text(1, mesh_text(kCorners)) + object_text(3, mesh_text(kCorners), "type=\"other\""), "")},
       {"Metadata/model_settings.config",
        "<config><object id=\"2\"><metadata key=\"name\" value=\"ring\"/><part id=\"1\" subtype=\"normal_part\"/>"
        "<part id=\"3\" subtype=\"modifier_part\"><metadata key=\"name\" value=\"cube\"/></part></object>"
        "<plate><metadata key=\"plater_id\" value=\"1\"/><model_instance><metadata key=\"object_id\" value=\"2\"/>"
        "<metadata key=\"instance_id\" value=\"0\"/></model_instance></plate>"
        "<plate><metadata key=\"plater_id\" value=\"2\"/><metadata key=\"plater_name\" value=\"b\"/><model_instance>"
        "<metadata key=\"object_id\" value=\"2\"/><metadata key=\"instance_id\" value=\"1\"/></model_instance></plate>"
        "</config>"}});
  ASSERT_EQ(package.instances.size(), 6u);
  const TrayInstance& first = package.instances[0];
  EXPECT_EQ(first.label, "object 2 'ring'");
  EXPECT_TRUE(first.placement.matrix().isApprox((turned * shift(0, 0, 5)).matrix(), 1e-8));
  EXPECT_EQ(first.plate, 1u);
  EXPECT_EQ(first.aid, "");
  EXPECT_EQ(package.instances[1].aid, "modifier_part");
  EXPECT_EQ(package.instances[1].name, "cube");
  EXPECT_EQ(package.instances[2].label, "object 2 'ring' (copy 2)");
  EXPECT_EQ(package.instances[2].plate, 2u);
  EXPECT_EQ(package.instances[4].plate, 0u) << "beside the plates";
  EXPECT_EQ(package.instances[0].points, package.instances[2].points) << "held once";
  ASSERT_EQ(package.plates.size(), 2u);
  EXPECT_EQ(package.plates[1].name, "b");
}

TEST_F(TrayPackageTest, ScalesEachPartByItsOwnUnit) {
  const TrayPackage package = read(
      {{"3D/3dmodel.model", model_text(object_text(2, components_text(component(1, "/3D/o.model", shift(1, 0, 0)))),
                                       item_text(2, shift(0, 1, 0)), "inch")},
       {"3D/o.model", model_text(object_text(1, mesh_text(kCorners)), "", "centimeter")}});
  ASSERT_EQ(package.instances.size(), 1u);
  EXPECT_EQ(package.instances[0].points->at(1), Vec3(10, 0, 0));
  EXPECT_TRUE(package.instances[0].placement.translation().isApprox(Vec3(25.4, 25.4, 0)));
}

TEST_F(TrayPackageTest, RefusesCircles) {
  EXPECT_THAT(error_of_model(object_text(1, components_text(component(2))) +
                                 object_text(2, components_text(component(1)), "name=\"snake\""),
                             item_text(2, shift(0, 0, 0))),
              AllOf(HasSubstr("object 2 'snake'"), HasSubstr("circle")));
  EXPECT_THAT(error_of_model(object_text(1, components_text(component(1))), item_text(1, shift(0, 0, 0))),
              HasSubstr("made of itself"));
}

TEST_F(TrayPackageTest, RefusesDeepAndBranchingNests) {
  const auto start = std::chrono::steady_clock::now();
  for (const int branches : {1, 2}) {
    for (const bool ends_in_mesh : {true, false}) {
      std::string resources = object_text(1, ends_in_mesh ? mesh_text(kCorners) : "");
      const int levels = branches == 1 ? 1000 : 30;
      for (int i = 2; i <= levels; ++i) {
        std::string components;
        for (int b = 0; b < branches; ++b) components += component(i - 1);
        resources += object_text(i, components_text(components));
      }
      EXPECT_THAT(error_of_model(resources, item_text(levels, shift(0, 0, 0))),
                  AllOf(HasSubstr(branches == 1 ? "levels deep" : "more than")));
    }
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST_F(TrayPackageTest, NamesMissingPartsAndObjects) {
  EXPECT_THAT(error_of({{"a", "b"}}), HasSubstr("no 3D model"));
  EXPECT_THAT(error_of({{"_rels/.rels", kStart}}), AllOf(HasSubstr("no part"), HasSubstr("3D/other.model")));
  EXPECT_THAT(error_of_model(object_text(1, mesh_text(kCorners)), ""), HasSubstr("no build items"));
  EXPECT_THAT(error_of_model("", item_text(9, shift(0, 0, 0))),
              AllOf(HasSubstr("object 9"), HasSubstr("doesn't have")));
  const std::string missing = object_text(1, components_text(component(2, "/3D/none.model")), "name=\"ring\"");
  EXPECT_THAT(error_of_model(missing, item_text(1, shift(0, 0, 0))),
              AllOf(HasSubstr("object 1 'ring'"), HasSubstr("3D/none.model")));
  const std::string outside = object_text(1, components_text(component(2, "/../../etc/passwd")), "name=\"ring\"");
  EXPECT_THAT(error_of_model(outside, item_text(1, shift(0, 0, 0))),
              AllOf(HasSubstr("object 1 'ring'"), HasSubstr("/../../etc/passwd"), HasSubstr("no path")));
}

TEST_F(TrayPackageTest, RefusesMoreThanItMayUnpack) {
  const std::string zeros(3 << 20, '\0');
  EXPECT_THAT(error_of({{"3D/3dmodel.model", zeros}}, 1 << 20),
              AllOf(HasSubstr("3D/3dmodel.model"), HasSubstr("--max-file-bytes")));
  EXPECT_THAT(error_of({{"3D/3dmodel.model", zeros}}), HasSubstr("no XML"));
}

TEST_F(TrayPackageTest, RefusesMoreCopiesThanAnybodyPrints) {
  std::string items;
  for (std::size_t i = 0; i <= kMostTrayInstances; ++i) items += "<item objectid=\"1\"/>";
  EXPECT_THAT(error_of_model(object_text(1, mesh_text(kCorners)), items), HasSubstr("more than 65536 objects"));
}

}  // namespace
}  // namespace ccslice::cli
