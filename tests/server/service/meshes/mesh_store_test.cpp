// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace ccslice::server {
namespace {

TEST(ParseMeshStore, TakesFolders) {
  const MeshStorePlace place = parse_mesh_store("dir:/srv/my meshes");
  EXPECT_EQ(place.folder, "/srv/my meshes");
  EXPECT_EQ(show_mesh_store(place), "dir:/srv/my meshes");
}

TEST(ParseMeshStore, TakesRedis) {
  const auto shown = [](const std::string& text) { return show_mesh_store(parse_mesh_store(text)); };
  EXPECT_EQ(shown("redis://cache"), "redis://cache:6379/0");
  EXPECT_EQ(shown("redis://cache/"), "redis://cache:6379/0");
  EXPECT_EQ(shown("redis://cache:7000/3"), "redis://cache:7000/3");
  EXPECT_EQ(shown("redis://[::1]:7000/3"), "redis://[::1]:7000/3");
  EXPECT_EQ(parse_mesh_store("redis://[::1]/").host, "::1");
  EXPECT_EQ(parse_mesh_store("redis://cache").user, "");
  EXPECT_EQ(parse_mesh_store("redis://slicer@cache:7000/3").user, "slicer");
  EXPECT_EQ(shown("redis://slicer@[::1]"), "redis://slicer@[::1]:6379/0");
}

TEST(ParseMeshStore, NamesARemedyForTls) {
  try {
    (void)parse_mesh_store("rediss://cache:6379/0");
    ADD_FAILURE();
  } catch (const std::invalid_argument& takes) {
    EXPECT_NE(std::string(takes.what()).find("deploy/proxies/redis-tls.cfg"), std::string::npos) << takes.what();
  }
}

TEST(ParseMeshStore, RefusesTheRest) {
  for (const char* text :
       {"", "dir:", "/srv", "redis:", "redis://", "redis://:1", "redis://h:0", "redis://h:65536", "redis://h:x",
        "redis://h/-1", "redis://h/a", "redis://[::1", "redis://[::1]x", "redis://user:secret@h", "redis://@h",
        "redis://a@b@h", "redis://a b@h", "redis://h/0@x", "s3://bucket"}) {
    try {
      (void)parse_mesh_store(text);
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& takes) {
      EXPECT_NE(std::string(takes.what()).find("dir:FOLDER"), std::string::npos);
    }
  }
}

TEST(OpenMeshStore, WantsThePasswordOfAUser) {
  MeshStoreOptions options;
  options.place = parse_mesh_store("redis://slicer@localhost");
  try {
    (void)open_mesh_store(options);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("--mesh-store-password-file"), std::string::npos) << error.what();
  }
}

TEST(OpenMeshStore, NamesAPasswordFileThatCannotBeRead) {
  MeshStoreOptions options;
  options.place = parse_mesh_store("redis://localhost");
  options.password_file = "/nowhere/password";
  try {
    (void)open_mesh_store(options);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/password"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace ccslice::server
