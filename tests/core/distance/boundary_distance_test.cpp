// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/boundary_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "tests/core/distance/random_triangles.h"

namespace ccslice {
namespace {

constexpr double kErrorMm = 3e-5;

struct TestRow {
  Vec3 first, step;
  std::uint32_t begin, count;

  Vec3 at(std::uint32_t k) const { return first + static_cast<double>(begin + k) * step; }
};

/// Along an axis, tipped, or standing still; some begin or end far outside.
TestRow random_row(std::mt19937& random, int round) {
  TestRow row{random_point(random, -3, 13), random_point(random, -0.08, 0.08), 0, 0};
  row.begin = static_cast<std::uint32_t>(random() % 50);
  row.count = static_cast<std::uint32_t>(1 + random() % 200);
  if (round % 4 == 1) row.step = Vec3(0.05, 0, 0);
  if (round % 4 == 2) row.step = Vec3(0, 0, -0.07);
  if (round % 16 == 3) row.step = Vec3::Zero();
  return row;
}

TEST(BoundaryDistance, IsThatOfTheNearestTriangleUpToTheReach) {
  std::mt19937 random(1);
  for (const double reach : {0.2, 1.0, 30.0}) {
    const std::vector<FloatTriangle> triangles = random_triangles(random, 300, reach > 5 ? 0.3 : 1);
    const BoundaryDistance distance(triangles, reach, 20);
    for (int round = 0; round < 40; ++round) {
      const TestRow row = random_row(random, round);
      std::vector<float> values(row.count);
      distance.sample(row.first, row.step, row.begin, {}, values);
      for (std::uint32_t k = 0; k < row.count; k += 3) {
        ASSERT_NEAR(values[k], std::min(exact_distance(triangles, row.at(k)), reach), kErrorMm) << round << " " << k;
      }
    }
  }
}

TEST(BoundaryDistance, IsOnItsSideOfBounds) {
  std::mt19937 random(2);
  const std::vector<FloatTriangle> triangles = random_triangles(random, 300, 1);
  const BoundaryDistance distance(triangles, 1.5, 20);
  const std::vector<std::vector<float>> all_bounds = {{0.5f}, {0.02f, 0.7f}, {1.5f}, {0.4f, 0.2f, 1.2f}};
  for (int round = 0; round < 120; ++round) {
    const TestRow row = random_row(random, round);
    const std::vector<float>& bounds = all_bounds[static_cast<std::size_t>(round) % all_bounds.size()];
    std::vector<float> values(row.count);
    distance.sample(row.first, row.step, row.begin, bounds, values);
    for (std::uint32_t k = 0; k < row.count; ++k) {
      const double exact = std::min(exact_distance(triangles, row.at(k)), 1.5);
      for (const float bound : bounds) {
        if (std::abs(exact - bound) < kErrorMm) continue;
        ASSERT_EQ(values[k] < bound, exact < bound) << round << " " << k << " " << exact;
      }
    }
  }
}

/// Rows of parallel layers close to a plane at a bound, where much has to be looked at.
TEST(BoundaryDistance, IsOnItsSideAlongAPlane) {
  std::vector<FloatTriangle> square = {{{{0, 0, 0}, {9, 0, 0}, {9, 9, 0}}}, {{{0, 0, 0}, {9, 9, 0}, {0, 9, 0}}}};
  const BoundaryDistance distance(square, 2, 10);
  const std::vector<float> bounds = {0.5f};
  for (int layer = 0; layer < 40; ++layer) {
    const double z = 0.4905 + 0.0005 * layer;
    std::vector<float> values(300);
    for (const double direction : {1.0, -1.0}) {
      distance.sample(Vec3(4.5 - 3 * direction, 3.1, z), Vec3(0.02 * direction, 0, 0), 0, bounds, values);
      if (std::abs(z - 0.5) < kErrorMm) continue;
      for (const float value : values) ASSERT_EQ(value < 0.5f, z < 0.5) << z;
    }
  }
}

TEST(BoundaryDistance, GivesTheSameBitsForAnyPartOfARowOnAnyThread) {
  std::mt19937 random(5);
  const std::vector<FloatTriangle> triangles = random_triangles(random, 300, 1);
  const BoundaryDistance distance(triangles, 1, 20), again(triangles, 1, 20);
  const Vec3 first(-1, 4.2, 5.1), step(0.03, 0.001, 0);
  std::vector<float> whole(400);
  distance.sample(first, step, 0, {}, whole);
  std::vector<std::vector<float>> parts(8, std::vector<float>(50));
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] { again.sample(first, step, 50 * i, {}, parts[i]); });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_TRUE(std::ranges::equal(parts[i], std::span(whole).subspan(50 * i, 50))) << i;
  }
}

TEST(BoundaryDistance, HoldsMoreAsPointsComeIntoBlocks) {
  std::mt19937 random(6);
  const BoundaryDistance distance(random_triangles(random, 500, 0.5), 0.5, 20);
  const std::size_t before = distance.memory_bytes();
  EXPECT_GT(before, 500 * sizeof(FloatTriangle));
  std::vector<float> values(300);
  distance.sample(Vec3(0, 5, 5), Vec3(1 / 30.0, 0, 0), 0, {}, values);
  EXPECT_GT(distance.memory_bytes(), before);
}

/// A sphere of triangles, of a radius of 5 mm about (5, 5, 5).
std::vector<FloatTriangle> sphere(std::size_t rings) {
  const auto at = [&](std::size_t i, std::size_t j) {
    const double theta = std::numbers::pi * static_cast<double>(i) / static_cast<double>(rings);
    const double phi = std::numbers::pi * static_cast<double>(j) / static_cast<double>(rings);
    return to_float_point(Vec3(5, 5, 5) +
                          5 * Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
  };
  std::vector<FloatTriangle> triangles;
  for (std::size_t i = 0; i < rings; ++i) {
    for (std::size_t j = 0; j < 2 * rings; ++j) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return triangles;
}

TEST(BoundaryDistance, TakesNoMoreMemoryThanIsExpected) {
  for (const auto& [rings, reach] : {std::pair{20, 0.3}, {20, 2.0}, {20, 5.0}, {60, 0.1}, {60, 1.0}}) {
    const std::vector<FloatTriangle> triangles = sphere(static_cast<std::size_t>(rings));
    const BoundaryDistance distance(triangles, reach, 20);
    std::vector<float> values(40);
    for (int row = 0; row < 40 * 40; ++row) {
      distance.sample(Vec3(0, row % 40 / 4.0, row / 160.0), Vec3(0.25, 0, 0), 0, std::vector{0.05f}, values);
    }
    const double expected =
        BoundaryDistance::expected_bytes(static_cast<double>(triangles.size()), 314.16, Vec3::Constant(10), reach);
    const auto taken = static_cast<double>(distance.memory_bytes());
    EXPECT_GT(expected, taken) << rings << " " << reach;
    EXPECT_LT(expected, 12 * taken + 1e6) << rings << " " << reach;
  }
}

TEST(BoundaryDistance, IsCancelled) {
  std::mt19937 random(9);
  const BoundaryDistance distance(random_triangles(random, 3000, 0.2), 5, 20);
  const CancellationToken cancelled = CancellationToken::make();
  cancelled.cancel();
  std::vector<float> values(100);
  const auto sample = [&](const CancellationToken& cancel) {
    distance.sample(Vec3(0, 5, 5), Vec3(0.1, 0, 0), 0, {}, values, cancel);
  };
  EXPECT_THROW(sample(cancelled), Error);
  sample({});
  EXPECT_LT(*std::ranges::max_element(values), 5);
}

}  // namespace
}  // namespace ccslice
