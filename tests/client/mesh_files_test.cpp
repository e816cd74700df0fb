// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line's own mesh files, and what it does to a mesh on the way.

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>

#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/ccmesh.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"
#include "core/models/models.h"
#include "tests/client/process.h"
#include "tests/support/mutate.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::string fixture(const std::string& name) { return CCSLICE_TEST_DATA_DIR "/meshes/" + name; }

/// The message of the error that loading throws.
std::string error_of(const MeshOptions& options) {
  try {
    load_mesh(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

TEST(MeshFiles, JsonAndCcmeshHoldTheSameHouse) {
  const LoadedMesh binary = load_mesh({.mesh = fixture("house.ccmesh")});
  const LoadedMesh json = load_mesh({.mesh = fixture("house.json")});
  EXPECT_EQ(binary.bytes->bytes(), to_proto(json.mesh).SerializeAsString());
  EXPECT_EQ(binary.bytes->id(), json.bytes->id());
  EXPECT_THAT(json.mesh.channel_names, ElementsAre("hardness", "mix.0", "mix.1", "mix.2", "count.0", "count.1"));
  EXPECT_EQ(json.mesh.sharp_edges.size(), 2u);
  const LoadedMesh vtk = load_mesh({.mesh = fixture("vtk_binary_5_1.vtk")});
  EXPECT_EQ(vtk.mesh.positions, json.mesh.positions);
  EXPECT_EQ(vtk.mesh.cell_vertices, json.mesh.cell_vertices);
}

TEST(MeshFiles, JsonIsLossless) {
  ControlMesh mesh = make_ring();
  mesh.positions[0] = Vec3(1e-17, 1.0 / 3, -0.0);
  mesh.positions[1] = Vec3(5e-324, -1.7976931348623157e308, 1e22);
  mesh.channel_values[0] = 0.1f;
  mesh.channel_values[1] = -0.0f;
  mesh.channel_names[0] = "\"h\\\n\xc3\xa4\xf0\x9f\x92\x8e";
  mesh.sharp_vertices = {3};
  mesh.allow_folds = true;
  mesh.interpolating = true;
  mesh.missed_vertices = {{1, Vec3(0.1, -0.0, 1e300)}, {4, Vec3(1.0 / 3, 2, 5e-324)}};
  const v1::ControlMesh message = to_proto(mesh);
  EXPECT_EQ(to_proto(from_proto(message)).SerializeAsString(), message.SerializeAsString());
  const std::string json = to_json(message);
  EXPECT_EQ(parse_ccmesh(json).SerializeAsString(), message.SerializeAsString());
  v1::ControlMesh by_protobuf;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &by_protobuf).ok());
  EXPECT_EQ(by_protobuf.SerializeAsString(), message.SerializeAsString());
}

/// Gives a field a value, or a list two, other than their defaults.
void fill_field(const google::protobuf::FieldDescriptor& field, v1::ControlMesh& mesh) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *mesh.GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return reflection.SetBool(&mesh, &field, true);
  ASSERT_TRUE(field.is_repeated()) << field.name() << ": no way to fill it yet";
  for (const unsigned item : {1, 2}) {
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_UINT32: reflection.AddUInt32(&mesh, &field, item); break;
      case FieldDescriptor::CPPTYPE_DOUBLE: reflection.AddDouble(&mesh, &field, item / 3.0); break;
      case FieldDescriptor::CPPTYPE_FLOAT: reflection.AddFloat(&mesh, &field, static_cast<float>(item) / 3); break;
      case FieldDescriptor::CPPTYPE_ENUM: reflection.AddEnumValue(&mesh, &field, static_cast<int>(item)); break;
      case FieldDescriptor::CPPTYPE_STRING: reflection.AddString(&mesh, &field, std::string(item, 'a')); break;
      default: FAIL() << field.name() << ": no way to fill it yet";
    }
  }
}

TEST(MeshFiles, JsonHasEveryFieldOfAControlMesh) {
  const google::protobuf::Descriptor& fields = *v1::ControlMesh::descriptor();
  for (int i = 0; i < fields.field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *fields.field(i);
    v1::ControlMesh mesh;
    mesh.add_cell_kinds(v1::CELL_KIND_HEX);
    fill_field(field, mesh);
    const std::string json = to_json(mesh);
    EXPECT_THAT(json, HasSubstr("\"" + field.json_name() + "\":"));
    EXPECT_EQ(parse_ccmesh(json).SerializeAsString(), mesh.SerializeAsString()) << json;
    v1::ControlMesh by_protobuf;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &by_protobuf).ok()) << json;
    EXPECT_EQ(by_protobuf.SerializeAsString(), mesh.SerializeAsString()) << json;
  }
}

TEST(MeshFiles, JsonOfProtobufIsTakenHoweverItIsWritten) {
  ControlMesh mesh = make_box();
  mesh.channel_names[0] = "\u007f<\xc3\xa4\xf0\x9f\x92\x8e\t";
  mesh.positions[0].x() = 1.25e-7;
  const v1::ControlMesh message = to_proto(mesh);
  for (const bool names_of_proto : {false, true}) {
    google::protobuf::util::JsonPrintOptions options;
    options.add_whitespace = options.always_print_primitive_fields = names_of_proto;
    options.always_print_enums_as_ints = options.preserve_proto_field_names = names_of_proto;
    std::string json;
    ASSERT_TRUE(google::protobuf::util::MessageToJsonString(message, &json, options).ok());
    EXPECT_EQ(parse_ccmesh(json).SerializeAsString(), message.SerializeAsString());
  }
  const v1::ControlMesh small =
      parse_ccmesh(R"({"cellKinds":[1,"CELL_KIND_TET"],"sharpEdges":null,"positionsMm":["1.5",2E1,-0],)"
                   R"("cell_vertices":[1.0,1e2,"7"],"channelNames":["\u00e4\ud83d\udc8e\/"]})");
  EXPECT_THAT(small.positions_mm(), ElementsAre(1.5, 20, 0));
  EXPECT_TRUE(std::signbit(small.positions_mm(2)));
  EXPECT_THAT(small.cell_vertices(), ElementsAre(1, 100, 7));
  EXPECT_EQ(small.channel_names(0), "\xc3\xa4\xf0\x9f\x92\x8e/");
}

TEST(MeshFiles, JsonMistakesTeach) {
  const TemporaryFolder folder;
  const auto error_of_text = [&](const std::string& text) {
    const std::string path = (folder.path() / "bad.json").string();
    write_file(path, text);
    return error_of({.mesh = path});
  };
  const auto error_at = [&](const std::string& text, const std::string& error) {
    EXPECT_THAT(error_of_text(text), testing::EndsWith("bad.json: " + error)) << text;
  };
  error_at("{\"positionsMm\":\n [1, 2, three]}", "line 2, column 9: expected a coordinate, found 'three'");
  error_at("{\n\n\"positions\": [1]}",
           "line 3, column 1: expected the name of a field of ccslice.v1.ControlMesh, such as \"positionsMm\", found "
           "'\"positions\"'");
  error_at("{\"positionsMm\": [1, 2}", "line 1, column 22: expected ',' or ']', found '}'");
  error_at("{\"positionsMm\": [1,]}", "line 1, column 20: expected a coordinate, found ']'");
  error_at("{\"positionsMm\": [1", "line 1, column 19: expected ',' or ']', found the end of the file");
  error_at("{\"positionsMm\": 7}", "line 1, column 17: expected '[', found '7'");
  error_at("{\"positionsMm\": [-]}", "line 1, column 18: expected a coordinate, found '-'");
  error_at("{\"positionsMm\": [1e999]}", "line 1, column 18: '1e999' is too large a number");
  for (const char* number : {"007", "-01", "1.", "1.e3", ".5", "+1", "1e"}) {
    error_at(std::string("{\"positionsMm\": [") + number + "]}",
             std::string("line 1, column 18: expected a coordinate, found '") + number + "'");
  }
  error_at("{\"positionsMm\": [\"NaN\"]}", "line 1, column 18: 'NaN' is not a finite number");
  error_at("{\"positionsMm\": [\"1]}", "line 1, column 18: expected a coordinate, found '\"'");
  error_at("{\"channelValues\": [1e39]}", "line 1, column 20: '1e39' is too large a number");
  error_at("{\"channelNames\": [\"a\\ud83d\"]}", "line 1, column 19: a string with an escape that JSON lacks");
  error_at("{\"channelNames\": [\"a", "line 1, column 19: a string without its closing quotation mark");
  error_at("{\"channelNames\": [\"a\nb\"]}",
           "line 1, column 21: a control character or the end of a line within a string");
  error_at("{\"cellKinds\": [\"HEX\"]}",
           "line 1, column 16: expected a cell's kind, such as \"CELL_KIND_HEX\", found '\"HEX\"'");
  error_at("{\"cellVertices\": [-1]}", "line 1, column 19: expected a vertex id (from 0), found '-1'");
  error_at("{\"cellVertices\": [4294967296]}", "line 1, column 19: expected a vertex id (from 0), found '4294967296'");
  error_at("{\"cellVertices\": [1.5]}", "line 1, column 19: expected a vertex id (from 0), found '1.5'");
  error_at("{\"cellNodeCells\": [-1]}", "line 1, column 20: expected a cell's number (from 0), found '-1'");
  error_at("{\"allowFolds\": 1}", "line 1, column 16: expected true or false, found '1'");
  error_at("{\"allowFolds\": true, \"allow_folds\": true}", "line 1, column 22: a second 'allowFolds'");
  error_at("{\"cellKinds\": [1]} {", "line 1, column 20: expected the end of the file, found '{'");
  EXPECT_THAT(error_of_text("{}"), HasSubstr("no cellKinds"));
  EXPECT_THAT(error_of_text("plain text"), HasSubstr("OpenVolumeMesh"));
}

TEST(MeshFiles, ErrorsNameTheRemedy) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "part").string();
  write_file(path, "");
  EXPECT_THAT(error_of({.mesh = path}), testing::EndsWith("part: the file is empty"));
  write_file(path, "solid part\nfacet normal 0 0 1\n");
  EXPECT_THAT(error_of({.mesh = path}), HasSubstr("meshio convert"));
  ControlMesh box = make_box();
  box.positions[box.cell_vertices[6]] = Vec3(-100, -100, -100);
  write_file(path, to_proto(box).SerializeAsString());
  EXPECT_THAT(error_of({.mesh = path}), HasSubstr("--allow-folds"));
  write_file(path, R"({"cellKinds": ["CELL_KIND_PYRAMID"]})");
  EXPECT_THAT(error_of({.mesh = path}), HasSubstr("cell 0 is a pyramid"));
  write_file(path, R"({"cellKinds": [1], "missedVertices": [0, 1], "missedPositionsMm": [0, 0, 0]})");
  EXPECT_THAT(error_of({.mesh = path}),
              HasSubstr("missed_positions_mm has 3 numbers, not 3 for each of the 2 missed_vertices"));
}

class MutatedCcmeshes : public testing::TestWithParam<const char*> {};

TEST_P(MutatedCcmeshes, GiveAMeshOrAnError) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  constexpr int kMutations = 1000;
  const std::string original = read_file_bytes(fixture(GetParam()), kMaxBytes);
  std::mt19937 random(20190528);
  int meshes = 0;
  for (int mutation = 0; mutation < kMutations; ++mutation) {
    try {
      ControlMesh mesh = from_proto(parse_ccmesh(oracle::mutated(original, random)));
      ++meshes;
      validate(mesh);
    } catch (const Error& error) {
      EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what();
    }
  }
  EXPECT_GT(meshes, 0);
  EXPECT_LT(meshes, kMutations);
}

INSTANTIATE_TEST_SUITE_P(Readers, MutatedCcmeshes, testing::Values("house.ccmesh", "house.json"),
                         [](const auto& info) { return std::string(info.param).substr(6); });

TEST(MeshFiles, AreReadWithTheFilesThatTheyInclude) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(fixture("house.inp"), folder.path() / "included.inp");
  const std::string path = (folder.path() / "main.inp").string();
  write_file(path, "*INCLUDE, INPUT=included.inp\n");
  EXPECT_EQ(load_mesh({.mesh = path}).bytes->id(), load_mesh({.mesh = fixture("house.inp")}).bytes->id());
  write_file(path, "*INCLUDE, INPUT=main.inp\n");
  EXPECT_EQ(error_of({.mesh = path}), path + ": line 1: 'main.inp' includes itself: take one of the includes out");
}

TEST(MeshFiles, OfFormatsThatAreNotReadHaveARemedy) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "part.exo").string();
  write_file(path, "\x89HDF\r\n\x1a\n");
  EXPECT_THAT(error_of({.mesh = path}), HasSubstr("apt install meshio-tools"));
  write_file(path, "solid cube");
  EXPECT_THAT(error_of({.mesh = path}), testing::AllOf(HasSubstr("neither a Gmsh file"), HasSubstr("meshio convert")));
}

TEST(MeshFiles, AreSharpenedByAngle) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "box.ccmesh").string();
  ControlMesh box = make_box();
  box.sharp_edges.clear();
  box.sharp_vertices.clear();
  write_file(path, to_proto(box).SerializeAsString());
  const LoadedMesh sharp = load_mesh({.mesh = path, .meaning = {.sharp = {.angle_deg = 90}}});
  EXPECT_GE(sharp.mesh.sharp_edges.size(), 12u);
  ASSERT_EQ(sharp.warnings.size(), 1u);
  EXPECT_THAT(sharp.warnings[0], HasSubstr("convex ones"));
  EXPECT_NE(sharp.bytes->id(), load_mesh({.mesh = path}).bytes->id());
  EXPECT_TRUE(load_mesh({.mesh = path, .meaning = {.sharp = {.angle_deg = 91}}}).mesh.sharp_edges.empty());
  EXPECT_THAT(error_of({.mesh = path, .meaning = {.sharp = {.angle_deg = 0}}}),
              HasSubstr("--sharp-angle takes degrees"));
}

TEST(MeshFiles, ReentrantEdgesAreTaggedOnDemandAndWarnedAbout) {
  const std::string house = fixture("meshio.mesh");  // Has a bend between its roof and the gable's tetrahedron.
  const LoadedMesh convex = load_mesh({.mesh = house, .meaning = {.sharp = {.angle_deg = 20}}});
  const LoadedMesh all = load_mesh({.mesh = house, .meaning = {.sharp = {.angle_deg = 20, .reentrant = true}}});
  ASSERT_EQ(convex.warnings.size(), 1u);
  EXPECT_THAT(convex.warnings[0], HasSubstr("stay smooth (--sharp-reentrant)"));
  ASSERT_EQ(all.warnings.size(), 2u);
  EXPECT_THAT(all.warnings[1], HasSubstr("often fold"));
  EXPECT_GT(all.mesh.sharp_edges.size(), convex.mesh.sharp_edges.size());
}

TEST(MeshFiles, AreSharpenedByAList) {
  const TemporaryFolder folder;
  const std::string list = (folder.path() / "sharp.txt").string();
  const MeshOptions options{.mesh = fixture("meshio.mesh"), .meaning = {.sharp = {.file = list}}};
  write_file(list, "# the front edge and a corner\n0 1\n10\n");
  const LoadedMesh sharp = load_mesh(options);
  EXPECT_THAT(sharp.mesh.sharp_edges, ElementsAre(std::array<std::uint32_t, 2>{0, 1}));
  EXPECT_THAT(sharp.mesh.sharp_vertices, ElementsAre(10u));
  write_file(list, "0 6\n");
  EXPECT_THAT(error_of(options), HasSubstr("sharp edge 1-7 at (6, 6, 6) mm isn't an edge of any cell"));
  write_file(list, "0 99\n");
  EXPECT_THAT(error_of(options), HasSubstr("out of range"));
  write_file(list, "0 1\nrim\n");
  EXPECT_THAT(error_of(options), HasSubstr("sharp.txt: line 2: expected a vertex id, found 'rim'"));
}

TEST(MeshFiles, TakeSeveralGrades) {
  const TemporaryFolder folder;
  const std::string values = (folder.path() / "load.txt").string();
  write_file(values, "0 1 2 3 4 5 6 7 8 9 10\n");
  const LoadedMesh graded =
      load_mesh({.mesh = fixture("meshio.mesh"), .grades = {"a=z", "b=radial:z", "c=distance", "d=file:" + values}});
  EXPECT_THAT(graded.mesh.channel_names, ElementsAre("a", "b", "c", "d"));
  EXPECT_EQ(graded.mesh.channel_values[4 * 7 + 3], 7);
  EXPECT_THAT(error_of({.mesh = fixture("meshio.mesh"), .grades = {"a=z", "a=x"}}), HasSubstr("already"));
}

TEST(MeshFiles, IdsOfUploadedMeshesTakeNoChanges) {
  const std::string id = "sha256:" + std::string(64, '0');
  EXPECT_TRUE(names_mesh_id({.mesh = id}));
  EXPECT_THROW(names_mesh_id({.mesh = id, .size = {.units = "mm"}}), UsageError);
  EXPECT_THROW(names_mesh_id({.mesh = id, .meaning = {.sharp = {.angle_deg = 40}}}), UsageError);
  EXPECT_THROW(names_mesh_id({.mesh = id, .meaning = {.sharp = {.file = "list.txt"}}}), UsageError);
}

}  // namespace
}  // namespace ccslice::cli
