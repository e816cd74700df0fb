// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What `ccslice export` writes, read back from its specification, against the limit volume itself.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "client/cli/base/output_file.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/mesh_bytes.h"
#include "core/limit/limit_evaluator.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "server/rpc/server/server.h"
#include "server/service/base/logging.h"
#include "tests/client/local_server.h"
#include "tests/client/process.h"

namespace ccslice::client {
namespace {

/// Corners joined where their numbers are equal.
struct Welded {
  std::vector<Vec3> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

Welded read_stl(const std::string& file) {
  std::uint32_t count = 0;
  std::memcpy(&count, &file.at(80), sizeof count);
  EXPECT_EQ(file.size(), 84 + 50 * std::size_t{count});
  Welded surface;
  std::map<std::array<float, 3>, std::size_t> numbers;
  for (std::size_t t = 0; t < count; ++t) {
    std::array<std::array<float, 3>, 4> numbers_of;  // Normal, corners.
    std::memcpy(&numbers_of, &file[84 + 50 * t], sizeof numbers_of);
    std::array<std::size_t, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& corner = numbers_of[k + 1];
      const auto [at, fresh] = numbers.emplace(corner, surface.points.size());
      if (fresh) surface.points.emplace_back(corner[0], corner[1], corner[2]);
      triangle[k] = at->second;
    }
    const Vec3 a = surface.points[triangle[0]], b = surface.points[triangle[1]], c = surface.points[triangle[2]];
    const Vec3 normal(numbers_of[0][0], numbers_of[0][1], numbers_of[0][2]);
    EXPECT_GE(normal.dot((b - a).cross(c - a)), 0);
    surface.triangles.push_back(triangle);
  }
  return surface;
}

/// Sides of triangles that the opposite side of exactly one other doesn't match.
std::size_t unmatched_sides(const Welded& surface) {
  std::map<std::pair<std::size_t, std::size_t>, int> sides;
  for (const auto& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  std::size_t unmatched = 0;
  for (const auto& [side, count] : sides) {
    const auto opposite = sides.find({side.second, side.first});
    unmatched += count != 1 || opposite == sides.end() || opposite->second != 1;
  }
  return unmatched;
}

double volume(const Welded& surface) {
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    volume += surface.points[a].dot(surface.points[b].cross(surface.points[c])) / 6;
  }
  return volume;
}

double area(const Welded& surface) {
  double area = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3 origin = surface.points[a];
    area += (surface.points[b] - origin).cross(surface.points[c] - origin).norm() / 2;
  }
  return area;
}

/// The integral of det J over all limit cells: Gauss's rule of 5 points each way, exact on regular cells, on 2^3 parts
/// of each cell for the sake of irregular ones.
double limit_volume(const ControlMesh& mesh) {
  constexpr int kParts = 2;
  const double root = std::sqrt(10.0 / 7), half = std::sqrt(70.0);
  const std::array<double, 5> nodes = {-std::sqrt(5 + 2 * root) / 3, -std::sqrt(5 - 2 * root) / 3, 0,
                                       std::sqrt(5 - 2 * root) / 3, std::sqrt(5 + 2 * root) / 3};
  const std::array<double, 5> weights = {(322 - 13 * half) / 900, (322 + 13 * half) / 900, 128.0 / 225,
                                         (322 + 13 * half) / 900, (322 - 13 * half) / 900};
  std::vector<std::pair<double, double>> rule;  // Parameter and weight over [0,1].
  for (int part = 0; part < kParts; ++part) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      rule.emplace_back((part + (nodes[i] + 1) / 2) / kParts, weights[i] / 2 / kParts);
    }
  }
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  double volume = 0;
  for (const LimitCellId cell : solid->cells()) {
    for (const auto& [u, wu] : rule) {
      for (const auto& [v, wv] : rule) {
        for (const auto& [w, ww] : rule) {
          volume += wu * wv * ww * evaluator.sample({cell, Vec3(u, v, w)}).jacobian.determinant();
        }
      }
    }
  }
  return volume;
}

class Export : public testing::Test {
 protected:
  Export() { server::set_up_logging(server::LogLevel::kWarning, server::LogFormat::kText); }

  /// The file that the command writes.
  std::string run(const ControlMesh& mesh, const std::string& name, const std::vector<std::string>& options = {}) {
    const std::string input = (folder_.path() / "mesh.ccmesh").string(), output = (folder_.path() / name).string();
    cli::write_file(input, MeshBytes(cli::to_proto(mesh)).bytes());
    std::vector<std::string> command = {CCSLICE_BINARY, "export", input, "-o", output, "--force", "--quiet"};
    command.push_back("--server=" + server_.address());
    command.insert(command.end(), options.begin(), options.end());
    const ProcessResult result = Process(command, folder_.path()).wait();
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    return read_whole(output);
  }

  server::Server server_{local_server_options()};
  TemporaryFolder folder_;
};

TEST_F(Export, StlOfTheRingIsClosedOrientedAndAsLargeAsTheLimit) {
  const ControlMesh ring = make_ring();
  const double exact = limit_volume(ring);
  for (const double tolerance_mm : {0.05, 0.005}) {
    const Welded surface = read_stl(run(ring, "ring.stl", {"--chord-tolerance", std::to_string(tolerance_mm)}));
    EXPECT_EQ(unmatched_sides(surface), 0u);
    EXPECT_NEAR(volume(surface), exact, tolerance_mm * area(surface));
  }
}

TEST_F(Export, StlOfABoxIsTheBoxMirroredOrNot) {
  for (const char* scale : {"1", "1,1,-1"}) {
    const Welded surface = read_stl(run(make_box(), "box.stl", {"--scale", scale}));
    EXPECT_EQ(unmatched_sides(surface), 0u);
    EXPECT_NEAR(volume(surface), 24 * 16 * 8, 1e-3);
  }
}

double big_endian_double(const std::string& file, std::size_t at) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 8; ++i) bits = bits << 8 | static_cast<unsigned char>(file.at(at + i));
  return std::bit_cast<double>(bits);
}

float big_endian_float(const std::string& file, std::size_t at) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i) bits = bits << 8 | static_cast<unsigned char>(file.at(at + i));
  return std::bit_cast<float>(bits);
}

TEST_F(Export, VtkHasTheChannelsAtItsPoints) {
  ControlMesh box = make_box();
  box.channel_names[0] = "a channel%";
  const std::string file = run(box, "box.vtk");
  EXPECT_THAT(file, testing::StartsWith("# vtk DataFile Version 3.0\n"));
  EXPECT_THAT(file, testing::HasSubstr("\nBINARY\nDATASET POLYDATA\nPOINTS "));
  const std::size_t points = file.find("POINTS ") + 7;
  const std::size_t count = std::stoul(file.substr(points));
  const std::size_t first_point = file.find('\n', points) + 1;
  const std::string channel = "SCALARS a%20channel%25 float 1\nLOOKUP_TABLE default\n";
  const std::size_t first_value = file.find(channel) + channel.size();
  ASSERT_EQ(file.size(), first_value + 4 * count + 1);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_NEAR(big_endian_float(file, first_value + 4 * i), big_endian_double(file, first_point + 24 * i) / 24, 1e-6);
  }
}

}  // namespace
}  // namespace ccslice::client
