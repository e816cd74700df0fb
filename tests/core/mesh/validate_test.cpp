// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/validate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;

/// Cells in a row, with gaps between them, each so many times.
ControlMesh repeated_cells(int cells, int times) {
  ControlMesh mesh = box_mesh(2 * cells, 1, 1, 10, [](int x, int, int) { return x % 2 == 0; });
  const std::vector<std::uint32_t> once = mesh.cell_vertices;
  for (int time = 1; time < times; ++time) {
    mesh.cell_vertices.insert(mesh.cell_vertices.end(), once.begin(), once.end());
    mesh.cell_kinds.insert(mesh.cell_kinds.end(), static_cast<std::size_t>(cells), CellKind::kHex);
  }
  return mesh;
}

TEST(Validate, CountsCellsThatComeAgain) {
  const auto refused = [](int cells, int times, ErrorCode code, const std::string& text) {
    ControlMesh mesh = repeated_cells(cells, times);
    expect_error([&] { validate(mesh); }, code, text);
  };
  refused(1, 2, ErrorCode::kMeshSharedFaces, "valence 2; merge");
  refused(2, 2, ErrorCode::kMeshSharedFaces,
          "cells 0 and 2 share more than one face: the edge between those faces has valence 2, and so do two others;");
  refused(3, 2, ErrorCode::kMeshSharedFaces, "valence 2, and so do 2 more pairs; merge");
  refused(1, 3, ErrorCode::kMeshNonManifoldFace, "cells 0, 1 and 2 share one face, and there are 5 more such faces; a");
}

TEST(Validate, AcceptsEveryMeshOfTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    ControlMesh copy = mesh;
    EXPECT_NO_THROW(validate(copy)) << name;
  }
}

TEST(Validate, RefusesEveryInvalidMeshWithItsCodeAndIds) {
  for (const auto& invalid : oracle::invalid_meshes()) {
    ControlMesh copy = invalid.mesh;
    try {
      validate(copy);
      ADD_FAILURE() << invalid.name << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), invalid.code) << invalid.name << ": " << error.what();
      EXPECT_FALSE(error.field().empty()) << invalid.name;
      EXPECT_TRUE(invalid.ids.empty() || !error.ids().empty()) << invalid.name << " names no id";
      for (const auto id : error.ids()) {
        EXPECT_TRUE(invalid.ids.empty() || std::count(invalid.ids.begin(), invalid.ids.end(), id) > 0)
            << invalid.name << " names " << id << ": " << error.what();
      }
    }
  }
}

TEST(Validate, LeavesARefusedMeshUnchanged) {
  ControlMesh mesh = box_mesh(2, 1, 1);
  std::swap_ranges(mesh.cell_vertices.begin(), mesh.cell_vertices.begin() + 4, mesh.cell_vertices.begin() + 4);
  mesh.positions[0] = mesh.positions.back() * 3;  // The other cell is inverted in one corner.
  const auto before = mesh.cell_vertices;
  EXPECT_THROW(validate(mesh), Error);
  EXPECT_EQ(mesh.cell_vertices, before);
}

TEST(Validate, ReorientsCellsWhoseCornersAreAllNegative) {
  for (const std::string name : {"single_hex", "single_tet", "single_wedge"}) {
    ControlMesh mesh;
    for (const auto& tiny : oracle::tiny_meshes()) {
      if (tiny.name == name) mesh = tiny.mesh;
    }
    if (mesh.cell_count() == 0) continue;
    for (Vec3& p : mesh.positions) p.x() = -p.x();
    const auto before = mesh.cell_vertices;
    EXPECT_NO_THROW(validate(mesh)) << name;
    EXPECT_NE(mesh.cell_vertices, before) << name;
    const auto once = mesh.cell_vertices;
    validate(mesh);
    EXPECT_EQ(mesh.cell_vertices, once) << name;
  }
}

TEST(Validate, RefusesNeighboursOnTheSameSideOfTheirFace) {
  // The upper cell's top lies below the face that it shares with the lower one.
  ControlMesh mesh = box_mesh(1, 1, 2);
  for (Vec3& p : mesh.positions) {
    if (p.z() == 20) p.z() = 5;
  }
  try {
    ControlMesh copy = mesh;
    validate(copy);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshInvertedCell);
    EXPECT_EQ(error.ids(), (std::vector<std::int64_t>{0, 1}));
  }
  mesh.allow_folds = true;
  EXPECT_EQ(validate(mesh).inverted_cells, (std::vector<std::uint32_t>{0, 1}));
}

TEST(Validate, RefusesAHugeFanAtOnce) {
  // A hundred thousand wedges round one axis: refused before anything quadratic in that number runs.
  ControlMesh mesh;
  const std::uint32_t n = 100'000;
  mesh.positions = {{0, 0, 0}, {0, 0, 1}};
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * 3.14159265358979 * i / n;
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 1);
    const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % n);
    mesh.cell_kinds.push_back(CellKind::kWedge);
    mesh.cell_vertices.insert(mesh.cell_vertices.end(), {0, a, b, 1, a + 1, b + 1});
  }
  try {
    validate(mesh);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshValenceTooHigh);
    EXPECT_EQ(error.ids(), (std::vector<std::int64_t>{0, 1}));
  }
}

TEST(Validate, AllowsFoldsWhenAsked) {
  ControlMesh mesh = box_mesh(1, 1, 1);
  mesh.positions[0] = Vec3(30, 30, 30);
  ControlMesh refused = mesh;
  EXPECT_THROW(validate(refused), Error);
  mesh.allow_folds = true;
  EXPECT_EQ(validate(mesh).inverted_cells, std::vector<std::uint32_t>{0});
}

/// Control points of such a mesh are not where the part is; the order of corners has to agree all the same.
TEST(Validate, TakesInterpolatingMeshesByTheirTopology) {
  ControlMesh mesh = box_mesh(2, 1, 1);
  mesh.positions[0] = Vec3(30, 30, 30);
  mesh.interpolating = true;
  const ControlMesh before = mesh;
  EXPECT_TRUE(validate(mesh).inverted_cells.empty());
  EXPECT_EQ(mesh.cell_vertices, before.cell_vertices);
  std::swap_ranges(mesh.cell_vertices.begin(), mesh.cell_vertices.begin() + 4, mesh.cell_vertices.begin() + 4);
  EXPECT_THROW(validate(mesh), Error);
}

TEST(Validate, RefusesBadMissedVertices) {
  const auto refuse = [](std::vector<MissedVertex> missed, ErrorCode code, const std::string& text,
                         const std::string& field) {
    ControlMesh mesh = box_mesh(2, 2, 2);
    mesh.interpolating = true;
    mesh.missed_vertices = std::move(missed);
    expect_error([&] { validate(mesh); }, code, text);
    try {
      validate(mesh);
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), field);
    }
  };
  const Vec3 place(1, 2, 3);
  refuse({{2, place}, {27, place}}, ErrorCode::kMeshIndexOutOfRange,
         "out of range: vertex 27: vertex ids run from 0 to 26", "missed_vertices[1]");
  refuse({{2, place}, {2, place}}, ErrorCode::kMeshRepeatedVertex, "missed again or too late: vertex 2",
         "missed_vertices[1]");
  refuse({{2, place}, {5, place}, {4, place}}, ErrorCode::kMeshRepeatedVertex,
         "list them in ascending order, each once", "missed_vertices[2]");
  refuse({{2, place}, {3, Vec3(0, std::nan(""), 0)}}, ErrorCode::kMeshNonFinite, "position at vertex 3",
         "missed_positions_mm[4]");
  refuse({{2, Vec3(0, 0, -1e7)}}, ErrorCode::kMeshCoordinateOutOfRange, "beyond the limit at vertex 2",
         "missed_positions_mm[2]");
  ControlMesh mesh = box_mesh(2, 2, 2);
  mesh.missed_vertices = {{2, place}};
  expect_error([&] { validate(mesh); }, ErrorCode::kMeshArrayMismatch,
               "missed_vertices holds 1 numbers, but meshes without 'interpolating' need 0");
  mesh.interpolating = true;
  EXPECT_NO_THROW(validate(mesh));
}

TEST(Validate, ChecksLimitsBeforeAnythingElse) {
  const ControlMesh mesh = box_mesh(2, 2, 2);
  const auto code_with = [&](const MeshLimits& limits, ControlMesh copy) {
    try {
      validate(copy, limits);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  };
  MeshLimits limits;
  limits.max_cells = 7;
  EXPECT_EQ(code_with(limits, mesh), ErrorCode::kMeshTooLarge);
  limits = {};
  limits.max_vertices = 26;
  EXPECT_EQ(code_with(limits, mesh), ErrorCode::kMeshTooLarge);
  limits = {};
  limits.max_abs_coordinate_mm = 15;
  EXPECT_EQ(code_with(limits, mesh), ErrorCode::kMeshCoordinateOutOfRange);
  limits = {};
  limits.max_edge_valence = 3;
  EXPECT_EQ(code_with(limits, mesh), ErrorCode::kMeshValenceTooHigh);
  limits = {};
  limits.max_vertex_valence = 7;
  EXPECT_EQ(code_with(limits, mesh), ErrorCode::kMeshValenceTooHigh);
  ControlMesh channels = mesh;
  channels.channel_names = {"a", "b"};
  channels.channel_values.assign(54, 0.0f);
  limits = {};
  limits.max_channels = 1;
  EXPECT_EQ(code_with(limits, channels), ErrorCode::kMeshTooLarge);
}

TEST(Validate, RefusesFansWithARemedy) {
  ControlMesh fan = oracle::fan_mesh(64, 1, 1);
  EXPECT_NO_THROW(validate(fan));
  fan = oracle::fan_mesh(65, 1, 1);
  expect_error([&] { validate(fan); }, ErrorCode::kMeshValenceTooHigh,
               "has 65 cells round it; the limit is 64: mesh the part with a core");
  for (const int cells : {300, 1000}) {
    fan = oracle::fan_mesh(cells, 1, 1);
    expect_error([&] { validate(fan); }, ErrorCode::kMeshValenceTooHigh, "the limit is 256; mesh the part with a core");
  }
}

std::uint32_t vertex_at(const ControlMesh& mesh, const Vec3& place) {
  const auto found = std::find(mesh.positions.begin(), mesh.positions.end(), place);
  return static_cast<std::uint32_t>(found - mesh.positions.begin());
}

TEST(Validate, RefusesBadChannelsAndSharpFeatures) {
  const ControlMesh box = box_mesh(2, 2, 2);
  const std::uint32_t centre = vertex_at(box, Vec3(10, 10, 10)), side = vertex_at(box, Vec3(10, 10, 0));
  const std::uint32_t corner = vertex_at(box, Vec3(0, 0, 0)), next = vertex_at(box, Vec3(10, 0, 0));
  const auto refused = [](auto change) {
    ControlMesh mesh = box_mesh(2, 2, 2);
    mesh.channel_names = {"a", "b"};
    mesh.channel_values.assign(54, 0.0f);
    change(mesh);
    try {
      validate(mesh);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(refused([](ControlMesh& m) { m.channel_names[1] = "a"; }), ErrorCode::kMeshBadChannel);
  EXPECT_EQ(refused([](ControlMesh& m) { m.channel_names[0].clear(); }), ErrorCode::kMeshBadChannel);
  EXPECT_EQ(refused([](ControlMesh& m) { m.channel_names[0].assign(1000, 'x'); }), ErrorCode::kMeshBadChannel);
  EXPECT_EQ(refused([](ControlMesh& m) { m.channel_values.pop_back(); }), ErrorCode::kMeshArrayMismatch);
  EXPECT_EQ(refused([](ControlMesh& m) { m.channel_values[3] = std::numeric_limits<float>::quiet_NaN(); }),
            ErrorCode::kMeshNonFinite);
  EXPECT_EQ(refused([](ControlMesh& m) { m.cell_vertices.pop_back(); }), ErrorCode::kMeshArrayMismatch);
  EXPECT_EQ(refused([&](ControlMesh& m) { m.sharp_edges = {{centre, side}}; }), ErrorCode::kMeshBadSharpFeature);
  EXPECT_EQ(refused([&](ControlMesh& m) {
              m.sharp_edges = {{corner, next}, {next, corner}};
            }),
            ErrorCode::kMeshBadSharpFeature);
  EXPECT_EQ(refused([&](ControlMesh& m) { m.sharp_edges = {{centre, corner}}; }), ErrorCode::kMeshBadSharpFeature);
  EXPECT_EQ(refused([](ControlMesh& m) { m.sharp_edges = {{0, 27}}; }), ErrorCode::kMeshIndexOutOfRange);
  EXPECT_EQ(refused([&](ControlMesh& m) { m.sharp_vertices = {centre}; }), ErrorCode::kMeshBadSharpFeature);
  EXPECT_EQ(refused([&](ControlMesh& m) { m.sharp_vertices = {corner, corner}; }), ErrorCode::kMeshBadSharpFeature);
  EXPECT_EQ(refused([](ControlMesh& m) { m.sharp_vertices = {99}; }), ErrorCode::kMeshIndexOutOfRange);
}

}  // namespace
}  // namespace ccslice
