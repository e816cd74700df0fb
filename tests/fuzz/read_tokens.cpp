// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's token file, a token, and the place of a mesh store, from arbitrary bytes: rules, a line, a place, or the
// error that is meant for it.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "server/service/meshes/mesh_store.h"
#include "server/service/network/access.h"

namespace {

using namespace ccslice::server;

void read_rules(std::string_view text) {
  AccessRules rules;
  try {
    rules = parse_access_rules(text);
  } catch (const std::invalid_argument&) {
    return;
  }
  for (const AccessRule& rule : rules.rules) {
    if (rule.name.empty() || rule.role == Role::kNone) throw std::logic_error("a rule that says nothing");
  }
}

void read_place(const std::string& text) {
  try {
    const MeshStorePlace place = parse_mesh_store(text);
    if (show_mesh_store(parse_mesh_store(show_mesh_store(place))) != show_mesh_store(place)) {
      throw std::logic_error("a place that reads otherwise than it is shown");
    }
  } catch (const std::invalid_argument&) {
    return;
  }
}

void make_line(std::string_view token) {
  try {
    read_rules(access_line("name", "read", token) + "\n");
  } catch (const std::invalid_argument&) {
    return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_rules(text);
  read_place(std::string(text));
  make_line(text);
  return 0;
}
