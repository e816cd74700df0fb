// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/service/meshes/mesh_store.h"

namespace ccslice::server {

/// The bytes that a store gives for a mesh; nothing if it hasn't it.
inline std::optional<std::string> stored_bytes(MeshStore& store, const std::string& mesh_id) {
  std::string bytes;
  std::uint64_t size = 0;
  const bool found = store.read(mesh_id, {.begin = [&](std::uint64_t announced) { size = announced; },
                                          .append = [&](std::string_view piece) { bytes += piece; }});
  if (!found) return std::nullopt;
  EXPECT_EQ(size, bytes.size());
  return bytes;
}

}  // namespace ccslice::server
