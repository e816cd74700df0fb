// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_channels.h"

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

Material linear(const Vec3& slope) {
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

enum Kind : std::size_t { kSmooth, kLinear, kRandom, kConstant, kOneVertex, kStep };
constexpr std::array kNames = {"smooth", "linear", "random", "constant", "one vertex", "step"};

Material make(HostileRandom& random, std::size_t kind, const Vec3& slope, std::size_t vertices) {
  switch (kind) {
    case kSmooth: return smooth(random);
    case kLinear: return linear(slope);
    case kRandom: return random_by_vertex(random);
    case kConstant: return constant(random);
    case kOneVertex: return one_vertex(random, vertices);
    default: return step(random);
  }
}

}  // namespace

HostileChannels add_hostile_channels(HostileRandom& random, ControlMesh& mesh) {
  constexpr std::array weights = {0.25, 0.3, 0.2, 0.03, 0.07, 0.15};
  HostileChannels result;
  Box3 box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  const auto channels = static_cast<std::size_t>(random.pick(1, 3));
  mesh.channel_names.clear();
  mesh.channel_values.assign(mesh.vertex_count() * channels, 0);
  for (std::size_t c = 0; c < channels && mesh.vertex_count() > 0; ++c) {
    const Vec3 sizes = box.sizes().cwiseMax(1e-300), slope = random.in_cube(1);
    const std::size_t kind = random.weighted(weights);
    const Material material = make(random, kind, slope, mesh.vertex_count());
    const bool plain = random.chance(0.5);
    const double scale = plain ? 1 : random.log_between(1e-3, 1e3);
    const double base = plain ? 0 : scale * random.between(-20, 20);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const Vec3 place = (mesh.positions[v] - box.min()).cwiseQuotient(sizes);
      mesh.channel_values[v * channels + c] = static_cast<float>(base + scale * material(v, place));
    }
    mesh.channel_names.push_back(std::string(1, static_cast<char>('a' + c)));
    result.description += (c == 0 ? " " : " / ") + std::string(kNames[kind]);
    const Vec3 slope_mm = scale * slope.cwiseQuotient(sizes);
    result.linear.emplace_back();
    if (kind == kLinear) result.linear.back() = LinearMaterial{slope_mm, base - slope_mm.dot(box.min())};
  }
  return result;
}

}  // namespace ccslice::oracle
