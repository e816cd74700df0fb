// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_sets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "core/mesh_files/read_abaqus.h"
#include "core/mesh_import/cell_numbers.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

const std::string kNodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";

/// Tetrahedra of these numbers, all of the same nodes: readers don't look at their places.
std::string tets(const std::vector<int>& numbers, const std::string& set = "") {
  std::string text = "*ELEMENT, TYPE=C3D4" + (set.empty() ? "" : ", ELSET=" + set) + "\n";
  for (const int number : numbers) text += std::to_string(number) + ", 1, 2, 3, 4\n";
  return text;
}

std::map<std::string, std::vector<std::uint32_t>> sets_of(const std::string& text) {
  std::map<std::string, std::vector<std::uint32_t>> sets;
  for (const CellSet& set : read_abaqus(text).cell_sets) sets[set.name] = set.cells;
  return sets;
}

TEST(AbaqusSets, ListElementsAndEarlierSets) {
  EXPECT_THAT(sets_of(kNodes + "*ELSET, ELSET=early\n12, 10\n" + tets({10, 11, 12, 20, 22}) +
                      "*ELSET, ELSET=\"Two words\"\n20, early, LATE\n*ELSET, elset=late\n11,\n22, 22, 99\n" +
                      "*ELSET, ELSET=Early\n11\n"),
              ElementsAre(Pair("Two words", ElementsAre(0, 1, 2, 3)), Pair("early", ElementsAre(0, 1, 2)),
                          Pair("late", ElementsAre(1, 4))));
}

TEST(AbaqusSets, AreGenerated) {
  EXPECT_THAT(sets_of(kNodes + tets({1, 2, 3, 4, 5, 6, 7}) +
                      "*ELSET, ELSET=odd, GENERATE\n1, 7, 2\n*ELSET, ELSET=some, GENERATE\n2, 3\n6, 6\n"),
              ElementsAre(Pair("odd", ElementsAre(0, 2, 4, 6)), Pair("some", ElementsAre(1, 2, 5))));
}

TEST(AbaqusSets, ComeWithTheElements) {
  EXPECT_THAT(sets_of(kNodes + tets({5, 6, 8}, "a") + tets({1}) + tets({7, 9}, "B") + tets({2}, "A")),
              ElementsAre(Pair("B", ElementsAre(4, 5)), Pair("a", ElementsAre(0, 1, 2, 6))));
}

TEST(AbaqusSets, AreAllElementsOfAnInstance) {
  const std::string parts = "*PART, NAME=p\n" + kNodes + tets({0, 1, 2}) + "*END PART\n*ASSEMBLY, NAME=x\n";
  EXPECT_THAT(sets_of(parts + "*INSTANCE, NAME=a, PART=p, ELSET=ALL, NSET=N\n*END INSTANCE\n" +
                      "*INSTANCE, NAME=b, PART=p\n*END INSTANCE\n*INSTANCE, NAME=c, PART=p, ELSET=both\n" +
                      "*END INSTANCE\n*INSTANCE, NAME=d, PART=p, ELSET=both\n*END INSTANCE\n" +
                      "*ELSET, ELSET=ALL, INSTANCE=b\n0, 2\n*END ASSEMBLY\n"),
              ElementsAre(Pair("ALL", ElementsAre(0, 1, 2, 3, 5)), Pair("both", ElementsAre(6, 7, 8, 9, 10, 11))));
  EXPECT_THAT(sets_of("*PART, NAME=p\n" + kNodes + "*ELEMENT, TYPE=C3D4\n9007199254740992, 1, 2, 3, 4\n*END PART\n" +
                      "*ASSEMBLY, NAME=x\n*INSTANCE, NAME=a, PART=p, ELSET=all\n*END INSTANCE\n*END ASSEMBLY\n"),
              ElementsAre(Pair("all", ElementsAre(0))))
      << "of any number";
}

TEST(AbaqusSets, TakeMaterialsOfAllSectionsOfSolids) {
  for (const char* section : {"SOLID", "COHESIVE", "GASKET", "SHELL", "FLUID"}) {
    const MeshFile file =
        read_abaqus(kNodes + tets({1}, "a") + "*" + section + " SECTION, ELSET=a, MATERIAL=steel\n1.\n");
    ASSERT_EQ(file.cell_materials.size(), 1u) << section;
    EXPECT_EQ(file.cell_materials[0].name, "steel");
  }
}

const std::string kAssembly = "*PART, NAME=p\n" + kNodes + tets({1, 2}) + "*ELSET, ELSET=first\n1\n*END PART\n" +
                              "*PART, NAME=q\n" + kNodes + tets({1, 2}) + "*ELSET, ELSET=first\n2\n*END PART\n" +
                              "*ASSEMBLY, NAME=x\n*INSTANCE, NAME=p-1, PART=p\n*END INSTANCE\n" +
                              "*INSTANCE, NAME=q-1, PART=q\n*END INSTANCE\n" +
                              "*INSTANCE, NAME=p-2, PART=p\n9, 0, 0\n*END INSTANCE\n";

TEST(AbaqusSets, OfAPartAreInEveryInstance) {
  EXPECT_THAT(sets_of(kAssembly + "*END ASSEMBLY\n"), ElementsAre(Pair("first", ElementsAre(0, 3, 4))));
}

TEST(AbaqusSets, OfTheAssemblyAreOfOneInstance) {
  EXPECT_THAT(sets_of(kAssembly + "*ELSET, ELSET=one, INSTANCE=P-2\n2\n*ELSET, ELSET=one, INSTANCE=q-1\n2\n" +
                      "*ELSET, ELSET=named\np-1.2, p-2.first, nobody.first, p-1.nothing\n*END ASSEMBLY\n"),
              ElementsAre(Pair("first", ElementsAre(0, 3, 4)), Pair("named", ElementsAre(1, 4)),
                          Pair("one", ElementsAre(3, 5))));
}

// A set that goes on later holds the sets that came since it was opened, and each of those stands for all that it
// holds in the end.
TEST(AbaqusSets, GoOnLater) {
  EXPECT_THAT(sets_of(kNodes + tets({1, 2, 3}) + "*ELSET, ELSET=all\n1\n*ELSET, ELSET=second\n2\n" +
                      "*ELSET, ELSET=all\nsecond\n*ELSET, ELSET=second\n3\n"),
              ElementsAre(Pair("all", ElementsAre(0, 1, 2)), Pair("second", ElementsAre(1, 2))));
}

TEST(AbaqusSets, MayNameEachOther) {
  EXPECT_THAT(
      sets_of(kNodes + tets({1, 2, 3}) + "*ELSET, ELSET=a\n1\n*ELSET, ELSET=b\n2, a\n" +
              "*ELSET, ELSET=c\n3, b\n*ELSET, ELSET=a\nc\n"),
      ElementsAre(Pair("a", ElementsAre(0, 1, 2)), Pair("b", ElementsAre(0, 1, 2)), Pair("c", ElementsAre(0, 1, 2))));
}

// The assembly's set of an instance belongs to the assembly; its data lines name the sets of the instance's part.
TEST(AbaqusSets, OfAnInstanceNameItsPartsSets) {
  EXPECT_THAT(
      sets_of(kAssembly + "*ELSET, ELSET=one, INSTANCE=p-2\nfirst\n*ELSET, ELSET=two\none, q-1.first\n" +
              "*END ASSEMBLY\n"),
      ElementsAre(Pair("first", ElementsAre(0, 3, 4)), Pair("one", ElementsAre(4)), Pair("two", ElementsAre(3, 4))));
}

TEST(AbaqusSets, WithoutCellsAreLeftOut) {
  const MeshFile file = read_abaqus(kNodes + tets({1}) + "*ELSET, ELSET=none\n5\n*ELSET, ELSET=cae, INTERNAL\n1\n" +
                                    "*ELSET, ELSET=itself\nitself, unknown\n");
  EXPECT_THAT(file.cell_sets, IsEmpty());
  EXPECT_THAT(file.warnings, ElementsAre("sets left out: itself, none",
                                         "members of sets, for no set of that name stands before them, left out: "
                                         "UNKNOWN"));
}

// Abaqus/CAE names the elements of a section by a set of its own.
TEST(AbaqusSets, GiveElementsMaterialsBySections) {
  MeshFile file = read_abaqus(kNodes + tets({1, 2, 3}, "all") + tets({4}, "Loose") +
                              "*ELSET, ELSET=_Picked2, INTERNAL, GENERATE\n1, 2\n*ELSET, ELSET=late\n3\n"
                              "*Solid Section, elset=_PICKED2, material=Steel\n,\n"
                              "*SOLID SECTION, ELSET=late, MATERIAL=Nylon 12\n1.,\n"
                              "*SOLID SECTION, ELSET=loose, MATERIAL=STEEL\n*SOLID SECTION, ELSET=none, MATERIAL=x\n");
  ASSERT_EQ(file.cell_materials.size(), 2u);
  EXPECT_EQ(file.cell_materials[0].name, "Steel");
  EXPECT_THAT(file.cell_materials[0].cells, ElementsAre(0, 1, 3));
  EXPECT_THAT(file.cell_materials[1].cells, ElementsAre(2));
  EXPECT_EQ(file.cell_sets.size(), 3u);
  EXPECT_THAT(file.warnings, ElementsAre(testing::HasSubstr("no set of that name stands before them, left out: NONE")));
  make_cell_regions("materials", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("Steel", file.cell_materials[1].name));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(0, 0, 1, 0));
  make_cell_regions("Steel", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("Steel", "rest"));
}

TEST(AbaqusSets, MayStandAfterTheirSections) {
  const MeshFile file =
      read_abaqus(kNodes + tets({1, 2}) + "*SOLID SECTION, ELSET=high, MATERIAL=Steel\n*ELSET, ELSET=high\n2\n");
  ASSERT_EQ(file.cell_materials.size(), 1u);
  EXPECT_THAT(file.cell_materials[0].cells, ElementsAre(1));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(AbaqusSets, HaveNamesOfTheirOwnBesideMaterials) {
  const MeshFile file = read_abaqus(kNodes + tets({1, 2}) + "*ELSET, ELSET=core\n1\n*ELSET, ELSET=all\n1, 2\n" +
                                    "*SOLID SECTION, ELSET=all, MATERIAL=core\n");
  ASSERT_EQ(file.cell_materials.size(), 1u);
  EXPECT_THAT(file.cell_materials[0].cells, ElementsAre(0, 1));
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0));
}

TEST(AbaqusSets, ThatAreNoSetsNameTheLine) {
  expect_error([] { read_abaqus(kNodes + tets({1}) + "*ELSET\n1\n"); }, ErrorCode::kFileSyntax, "line 8");
  expect_error([] { read_abaqus(kNodes + tets({1}) + "*ELSET, ELSET=a\n1, 2x\n"); }, ErrorCode::kFileSyntax,
               "line 9: expected an element's number, found '2x'");
  expect_error([] { read_abaqus(kNodes + tets({1}) + "*ELSET, ELSET=a, GENERATE\n1, b\n"); }, ErrorCode::kFileSyntax,
               "expected the last element, found 'b'");
}

// A set that holds the one before twice would have 2^n members.
TEST(AbaqusSets, CannotRepeatCellsWithoutEnd) {
  std::string text = kNodes + tets({1, 2, 3}) + "*ELSET, ELSET=s0, GENERATE\n1, 3\n";
  for (int i = 1; i < 100; ++i) {
    const std::string before = "s" + std::to_string(i - 1);
    text += "*ELSET, ELSET=s" + std::to_string(i) + "\n" + before + ", " + before + "\n";
  }
  EXPECT_EQ(sets_of(text).size(), 100u);
  std::string many = "*PART, NAME=p\n" + kNodes + tets({1}) + "*ELSET, ELSET=a\n";
  for (int i = 0; i < 2000; ++i) many += std::to_string(2 * i) + "\n";
  many += "*END PART\n*ASSEMBLY, NAME=x\n";
  for (int i = 0; i < 2000; ++i) many += "*INSTANCE, NAME=i" + std::to_string(i) + ", PART=p\n*END INSTANCE\n";
  expect_error([&] { read_abaqus(many); }, ErrorCode::kMeshTooLarge, "the element sets have more than");
  std::string ranges = "*ELSET, ELSET=a, GENERATE\n";
  for (int i = 0; i < 400'000; ++i) ranges += "1, 9\n";
  expect_error(
      [&] {
        read_abaqus(kNodes + tets({1, 2, 3}) + ranges);
      },
      ErrorCode::kMeshTooLarge, "the element sets have more than");
}

}  // namespace
}  // namespace ccslice
