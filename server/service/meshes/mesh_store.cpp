// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_store.h"

#include <algorithm>
#include <charconv>
#include <fstream>

#include "server/service/meshes/folder_store.h"
#include "server/service/meshes/redis_store.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kFolderScheme = "dir:", kRedisScheme = "redis://", kTlsScheme = "rediss://";
constexpr int kRedisPort = 6379, kMostPorts = 65535, kMostDatabases = 65535;

[[noreturn]] void refuse_place() {
  throw std::invalid_argument(
      "dir:FOLDER, such as dir:/srv/meshes, or redis://USER@HOST:PORT/DATABASE, such as redis://localhost:6379/0 (the "
      "password stands in a file, CCSLICE_MESH_STORE_PASSWORD_FILE)");
}

/// hiredis 0.14, which is Debian 12's, speaks no TLS.
[[noreturn]] void refuse_tls() {
  throw std::invalid_argument(
      "dir:FOLDER or redis://HOST:PORT/DATABASE, and no rediss://: for TLS run a proxy beside the server that speaks "
      "it "
      "(deploy/proxies/redis-tls.cfg), and name that, such as redis://localhost:6380/0");
}

int parse_number(std::string_view text, int least, int most) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < least || number > most) refuse_place();
  return number;
}

/// Of a name that a password follows (USER:PASSWORD@) nothing may be taken: it would show in the log.
bool is_user(std::string_view text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~' && c != ':' && c != '/' && c != '@'; });
}

/// HOST, HOST:PORT, [IPV6] or [IPV6]:PORT.
void parse_host(std::string_view text, MeshStorePlace& place) {
  const std::size_t bracket = text.starts_with('[') ? text.find(']') : 0;
  if (bracket == std::string_view::npos) refuse_place();
  const std::size_t colon = text.find(':', bracket);
  const std::string_view host = text.substr(0, colon);
  place.host = bracket > 0 ? host.substr(1, bracket - 1) : host;
  if (bracket > 0 && host.size() != bracket + 1) refuse_place();
  if (colon != std::string_view::npos) place.port = parse_number(text.substr(colon + 1), 1, kMostPorts);
  if (place.host.empty()) refuse_place();
}

/// The first line of the file.
std::string read_password(const std::string& path) {
  std::ifstream file(path);
  std::string password;
  if (!std::getline(file, password) || password.empty()) {
    throw std::runtime_error("the password file of the mesh store, " + path +
                             ", can't be read or is empty: its first line is the password");
  }
  return password;
}

}  // namespace

MeshStorePlace parse_mesh_store(const std::string& text) {
  MeshStorePlace place;
  if (text.starts_with(kFolderScheme)) {
    place.folder = text.substr(kFolderScheme.size());
    if (place.folder.empty()) refuse_place();
    return place;
  }
  if (text.starts_with(kTlsScheme)) refuse_tls();
  if (!text.starts_with(kRedisScheme)) refuse_place();
  std::string_view rest = std::string_view(text).substr(kRedisScheme.size());
  if (const std::size_t at = rest.find('@'); at != std::string_view::npos) {
    place.user = rest.substr(0, at);
    if (!is_user(place.user) || rest.find('@', at + 1) != std::string_view::npos) refuse_place();
    rest.remove_prefix(at + 1);
  }
  const std::size_t slash = rest.find('/');
  place.port = kRedisPort;
  parse_host(rest.substr(0, slash), place);
  if (slash != std::string_view::npos && slash + 1 < rest.size()) {
    place.database = parse_number(rest.substr(slash + 1), 0, kMostDatabases);
  }
  return place;
}

std::string show_mesh_store(const MeshStorePlace& place) {
  if (!place.folder.empty()) return std::string(kFolderScheme) + place.folder;
  const bool is_ipv6 = place.host.find(':') != std::string::npos;
  const std::string user = place.user.empty() ? "" : place.user + "@";
  return std::string(kRedisScheme) + user + (is_ipv6 ? "[" + place.host + "]" : place.host) + ":" +
         std::to_string(place.port) + "/" + std::to_string(place.database);
}

std::unique_ptr<MeshStore> open_mesh_store(const MeshStoreOptions& options) {
  const MeshStorePlace& place = *options.place;
  if (!place.folder.empty()) return std::make_unique<FolderStore>(place.folder, options.folder_bytes);
  const std::string password = options.password_file.empty() ? "" : read_password(options.password_file);
  if (!place.user.empty() && password.empty()) {
    throw std::runtime_error("--mesh-store names a user of Redis: its password wants --mesh-store-password-file");
  }
  return std::make_unique<RedisStore>(place, password, options.time_to_live_s);
}

}  // namespace ccslice::server
