// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile_channels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace ccslice::oracle {
namespace {

/// Of a vertex and its place in the part's box, [0, 1]^3.
using Material = std::function<double(std::size_t vertex, const Vec3& place)>;

Material smooth(HostileRandom& random) {
  const Vec3 waves = random.in_cube(2 * std::numbers::pi * random.log_between(0.2, 2)), more = 2 * random.in_cube(8);
  const double phase = random.between(0, 6), share = random.unit();
  return [=](std::size_t, const Vec3& p) { return std::sin(waves.dot(p) + phase) + share * std::cos(more.dot(p)); };
}

Material linear(HostileRandom& random) {
  const Vec3 slope = random.in_cube(1);
  return [=](std::size_t, const Vec3& p) { return slope.dot(p); };
}

/// Each vertex its own.
Material random_by_vertex(HostileRandom& random) {
  const std::uint64_t seed = random.bits();
  return [=](std::size_t vertex, const Vec3&) { return HostileRandom(seed + vertex, 0).unit(); };
}

Material constant(HostileRandom& random) {
  const double value = random.chance(0.3) ? 0 : random.between(-1, 1);
  return [=](std::size_t, const Vec3&) { return value; };
}

Material one_vertex(HostileRandom& random, std::size_t vertices) {
  const std::size_t other = random.bits() % vertices;
  return [=](std::size_t vertex, const Vec3&) { return vertex == other ? 1.0 : 0.0; };
}

/// 0 on one side of a plane, 1 on the other.
Material step(HostileRandom& random) {
  const Vec3 normal = random.chance(0.5) ? Vec3(Mat3::Identity().col(random.pick(0, 2))) : random.in_cube(1);
  const double height = normal.dot(Vec3(random.unit(), random.unit(), random.unit()));
  return [=](std::size_t, const Vec3& p) { return normal.dot(p) > height ? 1.0 : 0.0; };
}

Material make(HostileRandom& random, std::size_t vertices, std::string& name) {
  constexpr std::array weights = {0.25, 0.2, 0.25, 0.05, 0.1, 0.15};
  constexpr std::array names = {"smooth", "linear", "random", "constant", "one vertex", "step"};
  const std::size_t kind = random.weighted(weights);
  name = names[kind];
  switch (kind) {
    case 0: return smooth(random);
    case 1: return linear(random);
    case 2: return random_by_vertex(random);
    case 3: return constant(random);
    case 4: return one_vertex(random, vertices);
    default: return step(random);
  }
}

}  // namespace

std::string add_hostile_channels(HostileRandom& random, ControlMesh& mesh) {
  if (mesh.vertex_count() == 0) return " none";
  Box3 box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  const Vec3 sizes = box.sizes().cwiseMax(1e-300);
  const int channels = random.pick(1, 3);
  mesh.channel_names.clear();
  mesh.channel_values.assign(mesh.vertex_count() * static_cast<std::size_t>(channels), 0);
  std::string description;
  for (int c = 0; c < channels; ++c) {
    std::string name;
    const Material material = make(random, mesh.vertex_count(), name);
    const bool plain = random.chance(0.5);
    const double scale = plain ? 1 : random.log_between(1e-3, 1e3);
    const double base = plain ? 0 : scale * random.between(-20, 20);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const Vec3 place = (mesh.positions[v] - box.min()).cwiseQuotient(sizes);
      mesh.channel_values[v * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)] =
          static_cast<float>(base + scale * material(v, place));
    }
    mesh.channel_names.push_back(std::string(1, static_cast<char>('a' + c)));
    description += (c == 0 ? " " : " / ") + name;
  }
  return description;
}

}  // namespace ccslice::oracle
