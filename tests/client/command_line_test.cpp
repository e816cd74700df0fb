// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program itself: output and exit codes, against a real server and one that misbehaves.
// command_line_meshes_test.cpp has what it does with meshes and says of them.

#include "tests/client/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/client/fake_slicer.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;

TEST_F(CommandLine, HelpTeaches) {
  const ProcessResult help = run_alone({"--help"});
  EXPECT_EQ(help.exit_code, cli::kExitOk);
  EXPECT_THAT(help.out, HasSubstr("Exit codes"));
  for (const char* command : {"slice", "plan", "picture", "probe", "info", "upload", "export", "models", "convert"}) {
    const ProcessResult result = run_alone({command, "--help"});
    EXPECT_EQ(result.exit_code, cli::kExitOk);
    EXPECT_THAT(result.out, HasSubstr("Example")) << command;
  }
  EXPECT_THAT(run_alone({"--version"}).out, HasSubstr("."));
}

// OpenImageIO brings two hundred libraries along, which take half a second and 120 MB at the start of every command.
TEST_F(CommandLine, LoadsNoLibraryThatOnlyServersNeed) {
  Process process({"/usr/bin/env", "LD_TRACE_LOADED_OBJECTS=1", CCSLICE_BINARY}, folder_.path());
  const std::string libraries = process.wait().out;
  EXPECT_THAT(libraries, AllOf(HasSubstr("libgrpc"), Not(HasSubstr("OpenImageIO"))));
}

TEST_F(CommandLine, WritesSamplesThatTheServerTakes) {
  ASSERT_EQ(run_alone({"models", "ring", "-o", path("ring.ccmesh")}).exit_code, cli::kExitOk);
  const ProcessResult plan = run({"plan", path("ring.ccmesh"), "--pitch", "0.0423,0.0846,0.03", "--json"});
  ASSERT_EQ(plan.exit_code, cli::kExitOk) << plan.err;
  EXPECT_EQ(json_at(plan.out, "grid.columns").number_value(), 1975);
  EXPECT_EQ(json_at(plan.out, "layer_count").number_value(), 576);
  for (const char* name : {"bracket", "coyote", "engine", "grid", "ring"}) {
    EXPECT_THAT(run_alone({"models", "--json"}).out, HasSubstr("\"" + std::string(name) + "\""));
  }
}

TEST_F(CommandLine, UploadsAndDescribes) {
  const ProcessResult first = run({"upload", box_, "--grade", "extra=radial:z", "--json"});
  ASSERT_EQ(first.exit_code, cli::kExitOk) << first.err;
  EXPECT_FALSE(json_at(first.out, "was_cached").bool_value());
  const std::string id = json_at(first.out, "mesh.mesh_id").string_value();
  const ProcessResult again = run({"upload", box_, "--grade", "extra=radial:z"});
  EXPECT_THAT(again.out, HasSubstr(id));
  EXPECT_THAT(again.err, HasSubstr("held this mesh already"));
  EXPECT_THAT(run({"info", id}).out, HasSubstr("extra"));
  EXPECT_EQ(json_at(run({"info", id, "--json"}).out, "control_cells").number_value(), 48);
  EXPECT_GT(json_at(first.out, "mesh.preparation_ms").number_value(), 0);
  EXPECT_THAT(again.out, HasSubstr("on the server, prepared in "));
  EXPECT_EQ(json_at(run({"info", id, "--json"}).out, "undecided_cells").number_value(), 0);
  EXPECT_THAT(run({"info", "--meshes"}).out, HasSubstr(id));
  EXPECT_THAT(run({"info"}).out, testing::AllOf(HasSubstr("engine"), HasSubstr("encodings  raw, zstd")));
  EXPECT_EQ(json_at(run({"info", "--json"}).out, "encodings").list_value().values(1).string_value(), "zstd");
  EXPECT_EQ(json_at(run({"info", "--json"}).out, "threads").number_value(), 2);
  EXPECT_EQ(json_at(run_alone({"info", box_, "--json"}).out, "hexahedra").number_value(), 48);
}

TEST_F(CommandLine, ProbesPoints) {
  const ProcessResult text = run({"probe", box_, "--at", "6,8,4", "--at=-1,0,0"});
  ASSERT_EQ(text.exit_code, cli::kExitOk) << text.err;
  EXPECT_THAT(text.out, HasSubstr("gradient 0.25"));
  EXPECT_THAT(text.out, HasSubstr("(-1, 0, 0) outside"));
  cli::write_file(path("points.csv"), "6,8,4\n12 8 4\n");
  const ProcessResult json = run({"probe", box_, "--points", path("points.csv"), "--json"});
  EXPECT_THAT(json.out, HasSubstr("\"location\":\"inside\""));
  EXPECT_EQ(run({"probe", box_}).exit_code, cli::kExitUsage);
}

TEST_F(CommandLine, WrongCommandLinesAreUsageErrors) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"carve"},
      {"slice", box_},
      {"slice", box_, "-o", path("o")},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--dpi", "600"},
      {"slice", box_, "-o", path("o"), "--pitch", "fine"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--layers", "9..3"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--layers", "8"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--rotate", "q=3"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--encoding", "jpeg"},
      {"plan", box_, "--pitch", "1", "--grade", "oops"},
      {"plan", "sha256:" + std::string(64, '0'), "--pitch", "1", "--grade", "a=x"},
      {"plan", box_, "--pitch", "1", "--units", "ft"},
      {"upload", box_, "--size", "q=30"},
      {"upload", box_, "--max-file-bytes=-1"},
      {"upload", box_, "--max-file-bytes=-1b"},
      {"plan", box_, "--pitch", "1", "--material", "a=#000000", "--map", "material:a", "--seed=-1"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--size=-3"},
      {"info", "sha256:" + std::string(64, '0'), "--on-bed"},
      {"models", "teapot"},
      {"models", "ring", "-o", path("ring.stl")},
      {"picture", box_, "-o", path("box.jpg")},
      {"picture", box_, "--plane", "z=1", "-o", path("box.jpg")},
      {"convert", box_, "-o", path("o.stl")},
      {"export", box_, "-o", path("o.obj")},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--encoding", "exr"},
      {"slice", box_, "-o", path("o"), "--pitch", "1", "--all-channels", "--encoding", "tiff"},
  };
  for (std::vector<std::string> arguments : wrong) {
    const bool command = !arguments.empty();
    const ProcessResult result =
        command && arguments[0] != "carve" && arguments[0] != "models" ? run(arguments) : run_alone(arguments);
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << testing::PrintToString(arguments) << result.err;
  }
  EXPECT_FALSE(fs::exists(path("o")));
}

TEST_F(CommandLine, BadFilesAreInputErrors) {
  cli::write_file(path("syntax.mesh"), "MeshVersionFormatted 1\nVertices 1\n0 zero 0 0\n");
  cli::write_file(path("random.bin"), std::string(1000, '\xa7'));
  cli::write_file(path("nan.vtk"),
                  "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\nnan 0 0\n");
  cli::write_file(path("empty.mesh"), "");
  for (const char* name : {"syntax.mesh", "random.bin", "nan.vtk", "empty.mesh", "missing.mesh"}) {
    const ProcessResult result = run({"upload", path(name), "--json"});
    EXPECT_EQ(result.exit_code, cli::kExitInput) << name;
    EXPECT_THAT(result.err, HasSubstr(name));
    EXPECT_EQ(json_at(result.out, "error.exit_code").number_value(), cli::kExitInput);
  }
  EXPECT_THAT(run({"upload", path("syntax.mesh")}).err, HasSubstr("line 3: expected a coordinate, found 'zero'"));
}

TEST_F(CommandLine, RefusalsOfTheServerSayWhy) {
  const ProcessResult missing = run({"plan", "sha256:" + std::string(64, '0'), "--pitch", "1", "--json"});
  EXPECT_EQ(missing.exit_code, cli::kExitRefused);
  EXPECT_EQ(json_at(missing.out, "error.reason").string_value(), "MESH_MISSING");
  const ProcessResult channel = run({"slice", box_, "--pitch", "1", "--channel", "nosuch", "-o", path("o"), "--json"});
  EXPECT_EQ(channel.exit_code, cli::kExitRefused);
  EXPECT_EQ(json_at(channel.out, "error.reason").string_value(), "CHANNEL_UNKNOWN");
  EXPECT_THAT(channel.err, HasSubstr("nosuch"));
  const ProcessResult pitch = run({"plan", box_, "--pitch", "0", "--json"});
  EXPECT_EQ(json_at(pitch.out, "error.reason").string_value(), "PITCH_INVALID");
}

TEST_F(CommandLine, WrongOptionsExitAlikeWhoeverFindsThem) {
  for (const char* option : {"--pitch=-0.2", "--pitch=x", "--printer=j75", "--pich=1"}) {
    const ProcessResult result = run({"plan", box_, option});
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << option;
    EXPECT_THAT(result.err, HasSubstr(std::string(option).substr(0, 5))) << "the option, not a field of the request";
  }
  EXPECT_THAT(run({"plan", box_, "--pitch=1", "--extent=0,1,1"}).err, HasSubstr("--extent: 0"));
  EXPECT_THAT(run({"plan", box_, "--printer=custom"}).err, HasSubstr("--printer: there is no profile"));
}

TEST_F(CommandLine, AddressesThatAreNoneAreNamed) {
  for (const char* address : {"localhost", "localhost:", ":50051", "localhost:0", "localhost:65536", "localhost:1x",
                              "http://localhost:50051"}) {
    const ProcessResult result = run_alone({"info", std::string("--server=") + address});
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << address;
    EXPECT_THAT(result.err, HasSubstr("--server takes an address HOST:PORT")) << address;
  }
  EXPECT_THAT(run_alone({"info", "--server", ""}).err, HasSubstr("--server takes an address HOST:PORT"));
  Process process({"/usr/bin/env", "CCSLICE_SERVER=nonsense", CCSLICE_BINARY, "info"}, folder_.path());
  EXPECT_THAT(process.wait().err, HasSubstr("CCSLICE_SERVER takes an address"));
}

TEST_F(CommandLine, VariablesThatNoProgramReadsAreRefused) {
  const auto run_with = [&](const char* variable, const char* option) {
    return Process({"/usr/bin/env", variable, CCSLICE_BINARY, "printers", option}, folder_.path()).wait();
  };
  const ProcessResult wrong = run_with("CCSLICE_SERVRE=localhost:1", "--json");
  EXPECT_EQ(wrong.exit_code, cli::kExitUsage);
  EXPECT_THAT(wrong.err, HasSubstr("CCSLICE_SERVRE; did you mean CCSLICE_SERVER?"));
  EXPECT_THAT(wrong.out, HasSubstr("\"reason\":\"USAGE\""));
  EXPECT_EQ(run_with("CCSLICE_SERVRE=localhost:1", "--help").exit_code, cli::kExitOk);
  EXPECT_EQ(run_with("CCSLICE_MEMORY=1GiB", "--json").exit_code, cli::kExitOk) << "a server of its own takes it";
}

TEST_F(CommandLine, ListsPrintersWithoutAServer) {
  const ProcessResult text = run_alone({"printers"});
  EXPECT_EQ(text.exit_code, cli::kExitOk);
  EXPECT_THAT(text.out, HasSubstr("j750-hm"));
  EXPECT_THAT(text.out, HasSubstr("600 x 300 dpi"));
  EXPECT_THAT(text.out, HasSubstr("490 x 390 x 200 mm"));
  EXPECT_THAT(text.out, HasSubstr("VeroCY-V"));
  const std::string json = "{\"all\":" + run_alone({"printers", "--json"}).out + "}";
  const google::protobuf::Value all = json_at(json, "all");
  const auto& profiles = all.list_value().values();
  ASSERT_GT(profiles.size(), 3);
  EXPECT_EQ(profiles[0].struct_value().fields().at("name").string_value(), "j55");
  EXPECT_EQ(profiles[0].struct_value().fields().at("max_materials").number_value(), 5);
}

TEST_F(CommandLine, ExplainsItself) {
  const ProcessResult help = run_alone({"help", "slice"});
  EXPECT_EQ(help.exit_code, cli::kExitOk);
  EXPECT_EQ(help.out, run_alone({"slice", "--help"}).out);
  EXPECT_EQ(run_alone({"help"}).out, run_alone({"--help"}).out);
  const ProcessResult bare = run_alone({});
  EXPECT_EQ(bare.exit_code, cli::kExitUsage) << "a script that names no command is wrong";
  EXPECT_THAT(bare.err, HasSubstr("Subcommands:"));
  EXPECT_THAT(run_alone({"slce"}).err, HasSubstr("did you mean slice?"));
  const ProcessResult unknown = run_alone({"help", "slce"});
  EXPECT_EQ(unknown.exit_code, cli::kExitUsage);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean slice?"));
  EXPECT_EQ(json_at(run_alone({"plan", "--json", "--nosuch"}).out, "error.reason").string_value(), "USAGE");
}

TEST_F(CommandLine, IsInterruptedWhileItOpensAFifo) {
  ASSERT_EQ(mkfifo(path("fifo.vtk").c_str(), 0600), 0);
  const auto process = start({"info", path("fifo.vtk")}, "");
  const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!process->catches(SIGINT) && std::chrono::steady_clock::now() < latest) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // Nobody writes: it hangs by now.
  const auto begin = std::chrono::steady_clock::now();
  process->send_signal(SIGINT);
  EXPECT_EQ(process->wait().exit_code, cli::kExitInterrupted);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(4));
}

/// Escape sequences, backspaces, CSI as one character, and a line of its own.
const std::string kEvil =
    "evil\x1b[2J\x1b]0;title\x07\b\b\r\xc2\x9b"
    "31m\nforged";

/// Whether a terminal shows it all and does nothing else, and has no line that begins as that of kEvil.
bool is_harmless(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : ' ');
    if ((byte < 0x20 && byte != '\n') || byte == 0x7f || (byte == 0xc2 && next < 0xa0)) return false;
  }
  return text.find("\nforged") == std::string::npos;
}

TEST_F(CommandLine, NothingInAMeshMovesTheCursor) {
  ControlMesh mesh = make_box();
  mesh.channel_names[0] = kEvil;
  cli::write_file(path("evil.ccmesh"), MeshBytes(cli::to_proto(mesh)).bytes());
  const std::vector<std::vector<std::string>> commands = {
      {"info"},
      {"upload"},
      {"probe", "--at", "6,8,4"},
      {"plan", "--pitch", "1", "--channel", "nosuch"},
      {"plan", "--pitch", "1", "--channel", kEvil},
      {"slice", "--pitch", "1", "--channel", kEvil, "-o", path("out")}};
  for (std::vector<std::string> command : commands) {
    command.insert(command.begin() + 1, path("evil.ccmesh"));
    for (const bool json : {false, true}) {
      if (json) command.emplace_back("--json");
      fs::remove_all(path("out"));
      const ProcessResult result = run(command);
      EXPECT_TRUE(is_harmless(result.out)) << command[0] << ": " << result.out;
      EXPECT_TRUE(is_harmless(result.err)) << command[0] << ": " << result.err;
    }
  }
  EXPECT_THAT(run({"info", path("evil.ccmesh")}).out, HasSubstr("evil?[2J"));
  EXPECT_EQ(json_at(run({"info", path("evil.ccmesh"), "--json"}).out, "channels")
                .list_value()
                .values(0)
                .struct_value()
                .fields()
                .at("name")
                .string_value(),
            kEvil)
      << "whole, but escaped";
}

TEST_F(CommandLine, NothingThatAServerSaysMovesTheCursor) {
  FakeSlicer fake;
  fake.engine_version = kEvil;
  fake.tamper_answer = [](google::protobuf::Message& answer) {
    if (auto* const info = dynamic_cast<v1::GetServerInfoResponse*>(&answer)) {
      info->set_server_version(kEvil);
      info->add_printer_profiles()->set_name(kEvil);
    } else if (auto* const plan = dynamic_cast<v1::PlanSlicesResponse*>(&answer)) {
      plan->add_warnings()->set_message(kEvil);
    } else if (auto* const upload = dynamic_cast<v1::UploadMeshResponse*>(&answer)) {
      upload->mutable_mesh()->add_channels()->set_name(kEvil);
      upload->mutable_mesh()->add_cell_regions()->set_name(kEvil);
    }
  };
  fake.before_layer = [](std::uint32_t, grpc::ServerContext&) {
    return failure(grpc::StatusCode::INTERNAL, kEvil, kEvil);
  };
  const std::vector<std::vector<std::string>> commands = {
      {"info"}, {"upload", box_}, {"plan", box_, "--pitch", "1"}, {"slice", box_, "--pitch", "1", "-o", path("out")}};
  for (std::vector<std::string> command : commands) {
    for (const bool json : {false, true}) {
      if (json) command.push_back("--json");
      fake.meshes.clear();
      fs::remove_all(path("out"));
      const ProcessResult result = start(command, fake.address())->wait();
      EXPECT_TRUE(is_harmless(result.out)) << command[0] << ": " << result.out;
      EXPECT_TRUE(is_harmless(result.err)) << command[0] << ": " << result.err;
      EXPECT_THAT(result.out + result.err, HasSubstr("evil")) << command[0];
    }
  }
}

TEST_F(CommandLine, NobodyThereIsUnreachable) {
  const auto begin = std::chrono::steady_clock::now();
  const ProcessResult result = start({"plan", box_, "--pitch", "1"}, "127.0.0.1:1")->wait();
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err, HasSubstr("--server"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(CommandLine, TheServerIsTheFlagsElseTheVariables) {
  const auto run_with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"/usr/bin/env"});
    return Process(arguments, folder_.path()).wait().exit_code;
  };
  const std::string real = server_->address(), nobody = "127.0.0.1:1";
  EXPECT_EQ(run_with({"CCSLICE_SERVER=" + real, CCSLICE_BINARY, "info"}), cli::kExitOk);
  EXPECT_EQ(run_with({"CCSLICE_SERVER=" + nobody, CCSLICE_BINARY, "info", "--server=" + real}), cli::kExitOk);
  EXPECT_EQ(run_with({"CCSLICE_SERVER=" + real, CCSLICE_BINARY, "info", "--attempts=1", "--server=" + nobody}),
            cli::kExitUnreachable);
}

TEST_F(CommandLine, LostStandardOutputIsAnOutputError) {
  const std::vector<std::string> command = {"/bin/sh", "-c", "exec \"$0\" models --json >/dev/full", CCSLICE_BINARY};
  EXPECT_EQ(Process(command, folder_.path()).wait().exit_code, cli::kExitOutput);
}

TEST_F(CommandLine, MixedEnginesAreAMismatch) {
  FakeSlicer fake;
  fake.before_layer = [&](std::uint32_t layer, grpc::ServerContext&) {
    if (layer != 2 || fake.engine_version == "engine-2") return grpc::Status::OK;
    fake.engine_version = "engine-2";
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "rolling update");
  };
  const ProcessResult result =
      start({"slice", box_, "--pitch", "1", "--encoding", "zstd", "-o", path("out")}, fake.address())->wait();
  EXPECT_EQ(result.exit_code, cli::kExitMismatch);
  EXPECT_THAT(result.err, HasSubstr("engine-2"));
}

TEST_F(CommandLine, TheTimeoutEndsAJob) {
  FakeSlicer fake;
  fake.before_layer = [](std::uint32_t layer, grpc::ServerContext& context) {
    while (layer == 3 && !context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return grpc::Status::OK;
  };
  const ProcessResult result =
      start({"slice", box_, "--pitch", "1", "--encoding", "zstd", "--timeout", "0.5", "-o", path("out")},
            fake.address())
          ->wait();
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err, HasSubstr("not done within the time of --timeout; give more seconds"));
}

TEST_F(CommandLine, SaysThatAServerHoldsNoMeshes) {
  const server::Server empty(local_server_options());
  const ProcessResult text = start({"info", "--meshes"}, empty.address())->wait();
  EXPECT_EQ(text.out, "");
  EXPECT_THAT(text.err, HasSubstr("the server holds no meshes"));
  EXPECT_EQ(start({"info", "--meshes", "--quiet"}, empty.address())->wait().err, "");
  const ProcessResult json = start({"info", "--meshes", "--json"}, empty.address())->wait();
  EXPECT_EQ(json.out, "[]\n");
  EXPECT_EQ(json.err, "");
}

TEST_F(CommandLine, IdsThatWereCutShortAreNamed) {
  const ProcessResult result = run_alone({"info", "sha256:4dbb"});
  EXPECT_EQ(result.exit_code, cli::kExitInput);
  EXPECT_THAT(result.err, HasSubstr("sha256:4dbb is no file, and no mesh's id: those have 64 hexadecimal digits"));
  fs::copy_file(box_, path("sha256:box"));
  Process named({"/bin/bash", "-c", "cd \"$1\" && exec \"$0\" info sha256:box", CCSLICE_BINARY, folder_.path()},
                folder_.path());
  EXPECT_EQ(named.wait().exit_code, cli::kExitOk) << "a file may be called so";
}

}  // namespace
}  // namespace ccslice::client
