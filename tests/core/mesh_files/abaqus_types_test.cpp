// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_types.h"

#include <gtest/gtest.h>

#include <optional>
#include <string_view>

namespace ccslice {
namespace {

std::optional<AbaqusSolidType> solid_of(std::string_view name) {
  const AbaqusElementType type = abaqus_element_type(name);
  EXPECT_EQ(type.role, AbaqusRole::kSolid) << name;
  return abaqus_solid(type);
}

TEST(AbaqusTypes, AreSolidsInEachFamily) {
  for (const char* hex :
       {"C3D8",    "C3D8I",   "C3D8IH", "C3D8RT", "C3D8P",   "C3D8E",   "DC3D8",   "DC3D8E", "DCC3D8D", "Q3D8RH",
        "AC3D8",   "EC3D8R",  "EMC3D8", "FC3D8",  "F3D8",    "F3D8R",   "CSS8",    "SC8R",   "SC8RT",   "COH3D8",
        "COH3D8P", "COD3D8P", "GK3D8",  "GK3D8N", "GK3D8TN", "C3D20RB", "C3D20RI", "AC3D20", "C3D27RH"}) {
    EXPECT_EQ(solid_of(hex)->kind, CellKind::kHex) << hex;
  }
  for (const char* wedge : {"C3D6", "DC3D6", "AC3D15", "SC6R", "COH3D6", "GK3D6", "F3D6", "C3D15", "C3D15VH"}) {
    EXPECT_EQ(solid_of(wedge)->kind, CellKind::kWedge) << wedge;
  }
  for (const char* tet : {"C3D4", "DC3D4", "DC3D10", "AC3D4", "EMC3D4", "FC3D4", "C3D10MH", "C3D10HS", "Q3D10M"}) {
    EXPECT_EQ(solid_of(tet)->kind, CellKind::kTet) << tet;
  }
  EXPECT_FALSE(solid_of("C3D5")->kind) << "a pyramid";
  EXPECT_FALSE(solid_of("C3D7"));
}

TEST(AbaqusTypes, HaveAsManyNodesAsTheirNamesSay) {
  EXPECT_EQ(solid_of("C3D15")->most_nodes, 15u);
  EXPECT_EQ(solid_of("C3D15V")->nodes, 15u);
  EXPECT_EQ(solid_of("C3D15V")->most_nodes, 18u);
  EXPECT_EQ(solid_of("C3D27R")->nodes, 21u);
  EXPECT_EQ(solid_of("C3D27R")->most_nodes, 27u);
  EXPECT_EQ(solid_of("DC3D20")->nodes, 20u);
}

TEST(AbaqusTypes, MayBeFlatBetweenTwoFacesAlone) {
  for (const char* name : {"COH3D8", "COH3D6", "GK3D8", "COD3D8P"}) EXPECT_TRUE(solid_of(name)->may_be_flat) << name;
  for (const char* name : {"C3D8", "SC8R", "CSS8"}) EXPECT_FALSE(solid_of(name)->may_be_flat) << name;
}

TEST(AbaqusTypes, AreNoSolidsOtherwise) {
  for (const char* flat : {"S4R",  "S8R",     "STRI3",   "M3D4",  "SFM3D4", "R3D4",    "B31",   "T3D2", "CPS4", "CPE8R",
                           "CAX4", "COH2D4",  "COHAX4",  "GK3D2", "GK3D4L", "GK3D6LN", "GKPS4", "ASI4", "F3D3", "AC2D4",
                           "SAX1", "DCOUP3D", "SPRINGA", "MASS",  "D",      "U1",      "SC",    "C3D",  ""}) {
    EXPECT_EQ(abaqus_element_type(flat).role, AbaqusRole::kFlat) << flat;
  }
  for (const char* unread : {"CCL12", "CCL24RH", "CIN3D8", "PC3D", "GK3D12M", "GK3D18"}) {
    const AbaqusRole role = abaqus_element_type(unread).role;
    EXPECT_EQ(role, std::string_view(unread) == "PC3D" ? AbaqusRole::kFlat : AbaqusRole::kUnread) << unread;
  }
  EXPECT_EQ(abaqus_element_type("F3D4").role, AbaqusRole::kAmbiguous);
}

}  // namespace
}  // namespace ccslice
