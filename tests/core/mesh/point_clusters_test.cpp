// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/point_clusters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "tests/support/processor_time.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

/// Every pair is compared, and sets are merged until nothing changes.
std::set<std::vector<std::uint32_t>> brute_force(const std::vector<Vec3>& points, double distance) {
  std::vector<std::uint32_t> label(points.size());
  for (std::uint32_t i = 0; i < label.size(); ++i) label[i] = i;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if ((points[i] - points[j]).norm() > distance || label[i] == label[j]) continue;
        label[i] = label[j] = std::min(label[i], label[j]);
        changed = true;
      }
    }
  }
  std::set<std::vector<std::uint32_t>> clusters;
  for (std::uint32_t i = 0; i < label.size(); ++i) {
    std::vector<std::uint32_t> members;
    for (std::uint32_t j = 0; j < label.size(); ++j) {
      if (label[j] == i) members.push_back(j);
    }
    if (members.size() > 1) clusters.insert(members);
  }
  return clusters;
}

std::set<std::vector<std::uint32_t>> found(const std::vector<Vec3>& points, double distance) {
  std::set<std::vector<std::uint32_t>> clusters;
  for (const PointCluster& cluster : find_point_clusters(points, distance)) clusters.insert(cluster.points);
  return clusters;
}

TEST(PointClusters, AreThoseOfAllPairsOfRandomPoints) {
  constexpr std::uint32_t kSeed = 20261128;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const double distance : {0.0, 1e-9, 0.01, 0.05, 0.1, 0.3, 2.0}) {
    for (const double spread : {1.0, 0.05, 1e-9}) {
      for (const int flat : {0, 1, 2}) {
        std::vector<Vec3> points;
        for (int i = 0; i < 150; ++i) {
          Vec3 point = spread * Vec3(unit(random), unit(random), unit(random)) + Vec3(3, -2, 1);
          for (int axis = 0; axis < flat; ++axis) point[axis] = 1;
          points.push_back(point);
          if (i % 3 == 0) points.push_back(points[points.size() / 2]);
        }
        EXPECT_EQ(found(points, distance), brute_force(points, distance))
            << distance << ' ' << spread << ' ' << flat << " seed " << kSeed;
      }
    }
  }
}

TEST(PointClusters, FollowChainsAndSayHowLongTheyAre) {
  const std::vector<Vec3> points = {{3, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}, {9, 0, 0}, {9, 1, 0}, {20, 0, 0}};
  const std::vector<PointCluster> clusters = find_point_clusters(points, 1);
  ASSERT_EQ(clusters.size(), 2u);
  EXPECT_THAT(clusters[0].points, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(clusters[0].length, 3);
  EXPECT_EQ(clusters[0].box.center(), Vec3(1.5, 0, 0));
  EXPECT_THAT(clusters[1].points, ElementsAre(4, 5));
  EXPECT_TRUE(find_point_clusters(points, 0.999).empty());
}

TEST(PointClusters, LeaveOutPointsThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::vector<Vec3> points = {{nan, 0, 0}, {nan, 0, 0}, {inf, 0, 0}, {inf, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(found(points, 1), (std::set<std::vector<std::uint32_t>>{{4, 5}}));
  EXPECT_TRUE(find_point_clusters({}, 1).empty());
  EXPECT_TRUE(find_point_clusters(std::vector<Vec3>{{1, 2, 3}}, 1).empty());
}

/// Each takes seconds at most; with every pair compared it would take hours.
TEST(PointClusters, TakeAMillionPointsAnywhere) {
  constexpr std::size_t kPoints = 1'000'000;
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto points = [&](auto place) {
    std::vector<Vec3> all;
    for (std::size_t i = 0; i < kPoints; ++i) all.push_back(place(static_cast<double>(i)));
    return all;
  };
  const auto seconds = [](const std::vector<Vec3>& all, double distance, std::size_t clusters) {
    const ProcessorTime used;
    EXPECT_EQ(find_point_clusters(all, distance).size(), clusters);
    return used.seconds();
  };
  EXPECT_LT(seconds(points([](double) { return Vec3(1, 2, 3); }), 1e-9, 1), 20) << "in one place";
  EXPECT_LT(seconds(points([&](double) { return Vec3(unit(random), unit(random), unit(random)); }), 0.9, 1), 20)
      << "closer than the distance";
  EXPECT_LT(seconds(points([](double i) { return Vec3(0, 1e-3 * i, 0); }), 0.99e-3, 0), 20) << "along a line";
  EXPECT_LT(seconds(points([](double i) { return Vec3(i < 5e5 ? 0 : 1.0001, 1e-7 * i, 0); }), 1, 2), 20)
      << "in two lines, just apart";
}

}  // namespace
}  // namespace ccslice
