// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/mesh_id.h"

#include <gtest/gtest.h>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

TEST(MeshId, IsTheSha256OfTheBytes) {
  EXPECT_EQ(mesh_id_of("abc"), "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(mesh_id_of(""), "sha256:e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(MeshId, RecognizesIds) {
  EXPECT_TRUE(is_mesh_id(mesh_id_of("abc")));
  EXPECT_FALSE(is_mesh_id(""));
  EXPECT_FALSE(is_mesh_id("sha256:"));
  EXPECT_FALSE(is_mesh_id("sha256:" + std::string(63, 'a')));
  EXPECT_FALSE(is_mesh_id("sha256:" + std::string(64, 'A')));
  EXPECT_FALSE(is_mesh_id("sha256:" + std::string(64, 'g')));
  EXPECT_FALSE(is_mesh_id("sha512:" + std::string(64, 'a')));
}

TEST(MeshId, NamesTheFieldAndTheRemedy) {
  try {
    require_mesh_id("nonsense", "mesh_ids[3]");
    FAIL() << "accepted";
  } catch (const ServiceError& error) {
    EXPECT_EQ(error.code(), ServiceErrorCode::kMeshIdInvalid);
    EXPECT_EQ(error.field(), "mesh_ids[3]");
    EXPECT_NE(std::string(error.what()).find("mesh_ids[3]"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("sha256:"), std::string::npos);
  }
}

TEST(MeshIdHasher, TakesTheBytesInAnyPieces) {
  MeshIdHasher hasher;
  for (const char* piece : {"", "a", "bcd", "", "ef"}) hasher.add(piece);
  EXPECT_EQ(hasher.mesh_id(), mesh_id_of("abcdef"));
}

}  // namespace
}  // namespace ccslice::server
