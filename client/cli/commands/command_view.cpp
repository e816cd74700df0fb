// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <spawn.h>
#include <sys/wait.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "client/cli/base/console.h"
#include "client/cli/base/json.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/view/view_server.h"

extern char** environ;

namespace ccslice::cli {
namespace {

struct ViewOptions {
  MeshOptions mesh;
  std::uint16_t port = 0;
  bool no_open = false;
};

/// Hands the address to the desktop, where there is one. What the program says goes nowhere.
void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", argument = address;
  char* arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  for (const int descriptor : {1, 2}) posix_spawn_file_actions_addopen(&quiet, descriptor, "/dev/null", 1, 0);
  if (posix_spawnp(&child, program.c_str(), &quiet, nullptr, arguments, environ) == 0) {
    std::thread([child] { waitpid(child, nullptr, 0); }).detach();
  }
  posix_spawn_file_actions_destroy(&quiet);
}

void tell_address(const Session& session, const std::string& address) {
  if (!session.options().json) return print_line(address);
  JsonWriter json;
  print_line(json.begin_object().member("address", address).end_object().text());
}

void run_view(Session& session, const ViewOptions& options) {
  const std::string id = ensure_on_server(session, options.mesh);
  const std::string name =
      names_mesh_id(options.mesh) ? "" : std::filesystem::path(options.mesh.mesh).filename().string();
  ViewServer server(session, {id, name}, options.port);
  tell_address(session, server.address());
  std::fflush(stdout);  // Somebody waits for it.
  if (!session.quiet()) print_note("open this address in a browser; Ctrl-C ends it");
  if (!options.no_open) open_browser(server.address());
  std::atomic<bool> over{false};
  std::thread interrupted([&] {
    constexpr std::chrono::milliseconds kLook(100);
    while (!over && !session.call().cancellation->wait_for(kLook)) {
    }
    // Who has read the address may interrupt before the server runs, and stop() does nothing to one that doesn't yet.
    while (!over && !server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    server.stop();
  });
  server.run();
  over = true;
  interrupted.join();
}

}  // namespace

Command add_view(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* app = parent.add_subcommand("view", "Show cuts through a part in the browser, and move them");
  add_mesh_options(*app, options->mesh);
  app->add_option("--port", options->port, "Port of 127.0.0.1 that the page is served on (default: any free one)")
      ->check(CLI::Range(0, 65535));
  app->add_flag("--no-open", options->no_open, "Only print the address");
  add_server_options(*app, common);
  app->footer(
      "The address has a token: whoever has it may look, nobody else. docs/view_api.md tells how plug-ins use it.\n"
      "Example:\n  ccslice view engine.ccmesh");
  return {app, [options](Session& session) { run_view(session, *options); }};
}

}  // namespace ccslice::cli
