// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
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

/// A page that leads to the address, for its owner's eyes only: everybody reads the arguments of programs, and the
/// address has the token. Gone with this object.
class LeadingPage {
 public:
  explicit LeadingPage(const std::string& address) {
    const char* const own = std::getenv("XDG_RUNTIME_DIR");
    std::string path = (own ? std::filesystem::path(own) : std::filesystem::temp_directory_path()) /
                       ("ccslice-" + std::string(6, 'X') + ".html");  // What mkstemps() fills in.
    constexpr int kEnding = 5;
    const int descriptor = ::mkstemps(path.data(), kEnding);  // Mode 0600.
    if (descriptor < 0) return;
    const std::string page = "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=" + address + "\">\n";
    const bool written = ::write(descriptor, page.data(), page.size()) == static_cast<ssize_t>(page.size());
    ::close(descriptor);
    path_ = path;
    if (!written) remove();
  }
  ~LeadingPage() { remove(); }
  LeadingPage(const LeadingPage&) = delete;
  LeadingPage& operator=(const LeadingPage&) = delete;

  /// Empty if there is none.
  const std::string& path() const { return path_; }

 private:
  void remove() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
    path_.clear();
  }
  std::string path_;
};

/// Hands a page to the desktop, where there is one. What the program says goes nowhere.
void open_browser(const std::string& path) {
  if (path.empty()) return;
  std::string program = "xdg-open", argument = path;
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
  v1::ViewAddress document;
  document.set_address(address);
  print_line(json_of(document));
}

void run_view(Session& session, const ViewOptions& options) {
  const std::string id = ensure_on_server(session, options.mesh);
  const std::string name =
      names_mesh_id(options.mesh) ? "" : std::filesystem::path(options.mesh.mesh).filename().string();
  ViewServer server(session, {id, name}, options.port);
  tell_address(session, server.address());
  std::fflush(stdout);  // Somebody waits for it.
  if (!session.quiet()) print_note("open this address in a browser; Ctrl-C ends it");
  const bool has_desktop = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  std::optional<LeadingPage> page;
  if (!options.no_open && has_desktop) open_browser(page.emplace(server.address()).path());
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
