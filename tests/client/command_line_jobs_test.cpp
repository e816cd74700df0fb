// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: jobs as files.

#include "tests/client/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/base/read_file.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST_F(CommandLine, SlicesAJobOfAFileAsItWasSaid) {
  const std::vector<std::string> said = {
      "slice",     box_,           "--pitch",    "0.5", "--at",        "1,0,0",          "--at", "9,9,0",
      "--channel", "gradient:u16", "--contours", "svg", "--write-job", path("job.json"), "-o",   path("said")};
  const ProcessResult first = run(said);
  ASSERT_EQ(first.exit_code, cli::kExitOk) << first.err;
  for (const std::vector<std::string>& meshes : {std::vector<std::string>{}, {box_}}) {
    std::vector<std::string> again = {"slice",   "--job", path("job.json"), "--contours", "svg",
                                      "--force", "-o",    path("again")};
    again.insert(again.end(), meshes.begin(), meshes.end());
    const ProcessResult result = run(again);
    ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
    for (const auto& entry : fs::directory_iterator(path("said"))) {
      EXPECT_EQ(read_whole(entry.path().string()), read_whole(path("again/" + entry.path().filename().string())))
          << entry.path();
    }
  }
  EXPECT_EQ(run(said).exit_code, cli::kExitOutput) << "the layers are there";
}

TEST_F(CommandLine, EstimatesCostsFromSomeLayers) {
  const auto number = [](const std::string& json, const std::string& at) { return json_at(json, at).number_value(); };
  for (const auto& [pitch, layers] : {std::pair("1", 8), std::pair("0.1", 16)}) {
    const std::vector<std::string> job = {box_,
                                          "--pitch",
                                          pitch,
                                          "--material",
                                          "hard=#101010",
                                          "--material",
                                          "soft=#f0f0f080",
                                          "--map",
                                          "blend:gradient:0=hard,1=soft",
                                          "--json",
                                          "--quiet"};
    std::vector<std::string> plan = {"plan", "--costs"}, slice = {"slice", "--force", "-o", path("out")};
    plan.insert(plan.end(), job.begin(), job.end());
    slice.insert(slice.end(), job.begin(), job.end());
    const ProcessResult planned = run(plan), sliced = run(slice);
    ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
    ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    EXPECT_EQ(number(planned.out, "costs.sampled_layers"), layers);
    const double voxels = number(sliced.out, "voxel_count");
    EXPECT_NEAR(number(planned.out, "costs.voxel_count"), voxels, layers == 8 ? 0 : 0.01 * voxels);
    for (int m = 0; m < 2; ++m) {
      const auto of = [&](const std::string& json, const std::string& at) {
        return json_at(json, at).list_value().values(m).struct_value().fields().at("volume_cm3").number_value();
      };
      EXPECT_NEAR(of(planned.out, "costs.materials"), of(sliced.out, "materials"), layers == 8 ? 1e-12 : 0.03);
    }
  }
}

TEST_F(CommandLine, WeighsMaterials) {
  std::vector<std::string> slice = {
      "slice",        box_,         "--pitch",      "2",        "--material",
      "hard=#101010", "--material", "soft=#f0f0f0", "--map",    "blend:gradient:0=hard,1=soft",
      "--density",    "hard=1.25",  "-o",           path("out")};
  const ProcessResult sliced = run(slice);
  ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  EXPECT_THAT(sliced.out + sliced.err, testing::HasSubstr(" g, soft"));
  const std::string manifest = read_file_bytes(path("out/manifest.json"), 1 << 20);
  EXPECT_NEAR(json_at(manifest, "materials.0.grams").number_value(),
              1.25 * json_at(manifest, "materials.0.volume_cm3").number_value(), 1e-12);
  EXPECT_EQ(json_at(manifest, "slice_job.printing.materials.0.density_g_per_cm3").number_value(), 1.25);
  const auto refuses = [&](const std::string& density, const std::string& part) {
    slice[slice.size() - 3] = density;
    const ProcessResult refused = run(slice);
    EXPECT_EQ(refused.exit_code, cli::kExitUsage);
    EXPECT_THAT(refused.err, testing::HasSubstr(part));
  };
  refuses("0", "weighs nothing");
  refuses("hard=-1", "weighs nothing");
  refuses("hrad=1", "there is no --material 'hrad'");
  refuses("hard=x", "--density");
}

TEST_F(CommandLine, TakesMeshesOfAJobFromFilesBesideIt) {
  std::ofstream(path("job.json"))
      << R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": 1, "y_mm": 1, "z_mm": 1}},)"
      << R"( "planes": [{"occupancy": {}, "encoding": "PLANE_ENCODING_PNG"}], "contours": {}})";
  const ProcessResult planned = run({"plan", "--job", path("job.json"), "--json"});
  ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
  EXPECT_EQ(json_at(planned.out, "layer_count").number_value(), 8);
  const ProcessResult sliced = run({"slice", "--job", path("job.json"), "-o", path("out")});
  ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  EXPECT_TRUE(fs::exists(path("out/layer_0000_contours.json")));
  const ProcessResult without = run({"slice", "--job", path("job.json"), "--contours", "none", "-o", path("without")});
  ASSERT_EQ(without.exit_code, cli::kExitOk) << without.err;
  EXPECT_TRUE(fs::exists(path("without/layer_0000_occupancy.png")));
  EXPECT_FALSE(fs::exists(path("without/layer_0000_contours.json")));
}

TEST_F(CommandLine, SaysThatAnotherMeshStandsInForThatOfAJob) {
  std::ofstream(path("job.json"))
      << R"({"parts": [{"mesh_id": "none.vtk"}], "grid": {"pitch": {"x_mm": 1, "y_mm": 1, "z_mm": 1}}})";
  const ProcessResult planned = run({"plan", "--job", path("job.json"), box_});
  ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
  EXPECT_THAT(planned.err, AllOf(HasSubstr(box_ + " stands in for none.vtk"), HasSubstr("parts[0]")));
  EXPECT_EQ(run({"plan", "--job", path("job.json"), box_, "--quiet"}).err, "");
}

TEST_F(CommandLine, SaysWhatIsWrongWithAJobOfAFile) {
  const auto error_of = [&](const std::string& json, std::vector<std::string> more = {},
                            cli::ExitCode code = cli::kExitUsage) {
    std::ofstream(path("job.json")) << json;
    more.insert(more.begin(), {"slice", "--job", path("job.json"), "-o", path("out")});
    const ProcessResult result = run(more);
    EXPECT_EQ(result.exit_code, code) << json << result.err;
    return result.err;
  };
  const std::string good =
      R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": 1, "y_mm": 1, "z_mm": 1}},)"
      R"( "planes": [{"occupancy": {}, "encoding": "PLANE_ENCODING_PNG"}]})";
  EXPECT_THAT(error_of(good, {"--pitch", "1"}), AllOf(HasSubstr("--pitch"), HasSubstr("--job")));
  EXPECT_THAT(error_of(good, {"--at", "1,1,1"}), HasSubstr("--at"));
  EXPECT_THAT(error_of(good, {"--contours", "csv"}), HasSubstr("contours"));
  EXPECT_THAT(error_of(R"({"parts": [{"mesh_id": "box.ccmesh"}], "contours": {}})", {"--contours", "none"}),
              HasSubstr("--contours none leaves nothing"));
  EXPECT_THAT(error_of(good, {"--format", "grabcad"}), HasSubstr("PLANE_ENCODING_PNG_RGBA"));
  EXPECT_EQ(run({"plan", "--job", path("job.json"), "--format", "grabcad"}).exit_code, cli::kExitUsage);
  EXPECT_THAT(error_of(good, {box_, box_}), HasSubstr("1 part"));
  EXPECT_THAT(error_of(R"({"parts": [{}]})"), HasSubstr("parts[0]"));
  EXPECT_THAT(error_of(R"({"parts": [{"mesh_id": "sha256:)" + std::string(64, '0') + R"("}]})", {box_}),
              HasSubstr("is of the mesh sha256:000"));
  EXPECT_THAT(error_of(R"({"parts": [{"mesh_id": "none.vtk"}]})", {}, cli::kExitInput), HasSubstr("none.vtk"));
  EXPECT_THAT(
      error_of(R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": -1, "y_mm": 1, "z_mm": 1}}})"),
      HasSubstr("job.json: grid.pitch.x_mm"));
  EXPECT_THAT(run({"slice", "--pitch", "1", "-o", path("out")}).err, HasSubstr("--job"));
}

}  // namespace
}  // namespace ccslice::client
