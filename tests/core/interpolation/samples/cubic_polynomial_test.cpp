// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/cubic_polynomial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace ccslice {
namespace {

using Places = std::vector<Vec3>;

Places random_places(std::size_t count, std::uint32_t seed, const Vec3& spread = Vec3::Ones()) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  Places places;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = u(random), y = u(random), z = u(random);
    places.push_back(Vec3(x, y, z).cwiseProduct(spread));
  }
  return places;
}

double value_at(const CubicPolynomial& polynomial, const Vec3& p) {
  const std::array<double, 4> c = along_row(polynomial, p.y(), p.z());
  return ((c[3] * p.x() + c[2]) * p.x() + c[1]) * p.x() + c[0];
}

std::vector<double> values_of(const Places& places, const std::function<double(const Vec3&)>& function) {
  std::vector<double> values;
  for (const Vec3& place : places) values.push_back(function(place));
  return values;
}

/// Every one of the twenty terms, each with a factor of its own.
double some_cubic(const Vec3& p) {
  double value = 0;
  int factor = 3;
  for (int i = 0; i <= 3; ++i) {
    for (int j = 0; i + j <= 3; ++j) {
      for (int k = 0; i + j + k <= 3; ++k) {
        factor = factor * 7 % 31;
        value += (factor - 15) * std::pow(p.x(), i) * std::pow(p.y(), j) * std::pow(p.z(), k);
      }
    }
  }
  return value;
}

double not_a_cubic(const Vec3& p) { return std::exp(p.x() - 0.5 * p.y()) * std::cos(2 * p.z() + p.x()); }

TEST(VoxelFrame, MapsTheVoxelsToTheCube) {
  const VoxelFrame frame = VoxelFrame::of(Vec3(4, 10, 7), Vec3(19, 11, 7));
  EXPECT_EQ(frame(Vec3(4, 10, 7)), Vec3(-1, -1, 0));
  EXPECT_EQ(frame(Vec3(19, 11, 7)), Vec3(1, 1, 0));
  EXPECT_EQ(frame(Vec3(11.5, 10.5, 7)), Vec3::Zero());
}

TEST(BoundAlongRow, HoldsBetweenItsEndsAndIsSharpOnShortRows) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int round = 0; round < 200; ++round) {
    const std::array<double, 4> row = {u(random), u(random), u(random), u(random)};
    const double a = u(random), b = u(random), from = std::min(a, b), to = std::max(a, b);
    double largest = -std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 64; ++k) {
      const double x = from + k / 64.0 * (to - from);
      largest = std::max(largest, row[0] + x * (row[1] + x * (row[2] + x * row[3])));
    }
    const double bound = bound_along_row(row, from, to);
    EXPECT_GE(bound, largest - 1e-12);
    EXPECT_LE(bound, largest + 3 * (to - from) * (to - from)) << "from " << from << " to " << to;
  }
  EXPECT_NEAR(bound_along_row({1, 2, 0, 0}, -1, 0.5), 2, 1e-15);
  EXPECT_NEAR(bound_along_row({1, -2, 0, 0}, -1, 0.5), 3, 1e-15);
  EXPECT_EQ(bound_along_row({0.25, 3, 5, 7}, 0, 0), 0.25);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 4; ++k) {
    for (const double value : {kInfinity, -kInfinity, std::nan("")}) {
      std::array<double, 4> row = {-1, 0, 0, 0};
      row[k] = value;
      EXPECT_EQ(bound_along_row(row, -1, 0), kInfinity);
    }
  }
}

TEST(BoundOfSlopes, HoldsInACubeAndIsSharpInACornerOfIt) {
  std::mt19937 random(7);
  std::normal_distribution<double> coefficient;
  for (const double most : {0.5, 1.0, 1.3}) {
    CubicPolynomial polynomial, sizes;
    for (double& c : polynomial) c = coefficient(random);
    std::transform(polynomial.begin(), polynomial.end(), sizes.begin(), [](double c) { return std::abs(c); });
    const Vec3 bound = bound_of_slopes(polynomial, most);
    for (const Vec3& place : random_places(200, 8)) {
      const Vec3 slopes = gradient_at(polynomial, most * place).cwiseAbs();
      EXPECT_LE((slopes - bound).maxCoeff(), 1e-4) << place.transpose();
    }
    EXPECT_LT((gradient_at(sizes, Vec3::Constant(most)) - bound).norm(), 1e-4) << most;
  }
}

TEST(CubicFitter, ReproducesCubics) {
  for (const std::size_t count : {40u, 60u, 90u}) {
    const Places places = random_places(count, 1);
    const std::vector<double> values = values_of(places, some_cubic);
    CubicFitter fitter;
    fitter.factorize(places);
    CubicPolynomial polynomial;
    EXPECT_LT(fitter.fit(values, polynomial), 1e-6);
    for (const Vec3& p : random_places(50, 2)) EXPECT_NEAR(value_at(polynomial, p), some_cubic(p), 1e-6);
  }
}

TEST(CubicFitter, ItsErrorIsTheLargestAtThePlaces) {
  const Places places = random_places(41, 4);
  const std::vector<double> values = values_of(places, not_a_cubic);
  CubicFitter fitter;
  fitter.factorize(places);
  CubicPolynomial polynomial;
  const double error = fitter.fit(values, polynomial);
  double worst = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    worst = std::max(worst, std::abs(value_at(polynomial, places[i]) - values[i]));
  }
  EXPECT_GT(worst, 1e-3);
  EXPECT_NEAR(error, worst, 1e-12);
}

// Whatever the places leave open: a fit once took a tenth off a constant where few columns were sampled.
TEST(CubicFitter, ReproducesConstantsEverywhere) {
  for (const Places& places :
       {random_places(3, 5), random_places(40, 5, Vec3(1, 0, 0)), Places(7, Vec3(1, -1, 1.0 / 3))}) {
    CubicFitter fitter;
    fitter.factorize(places);
    CubicPolynomial polynomial;
    EXPECT_LT(fitter.fit(std::vector<double>(places.size(), 0.8202), polynomial), 1e-15);
    for (const Vec3& p : random_places(20, 8)) EXPECT_NEAR(value_at(polynomial, p), 0.8202, 1e-15);
  }
}

// Terms coincide there; a fit exists all the same, and is right where the samples are.
TEST(CubicFitter, TakesPlacesInOnePlaneOrOneRow) {
  for (const Vec3& spread : {Vec3(1, 1, 0), Vec3(0, 1, 1), Vec3(1, 0, 0), Vec3(0, 0, 1)}) {
    const Places places = random_places(40, 7, spread);
    const std::vector<double> values = values_of(places, some_cubic);
    CubicFitter fitter;
    fitter.factorize(places);
    CubicPolynomial polynomial;
    EXPECT_LT(fitter.fit(values, polynomial), 1e-6) << spread.transpose();
    for (const Vec3& p : random_places(20, 8, spread)) {
      EXPECT_NEAR(value_at(polynomial, p), some_cubic(p), 1e-6) << spread.transpose();
    }
    const std::vector<double> rough = values_of(places, not_a_cubic);
    const double error = fitter.fit(rough, polynomial);
    EXPECT_GT(error, 1e-5) << spread.transpose();
    EXPECT_LT(error, 10) << spread.transpose();
  }
}

TEST(CubicFitter, KeepsNothingOfTheFitBefore) {
  CubicFitter used, fresh;
  used.factorize(random_places(90, 9));
  CubicPolynomial a, b;
  const std::vector<double> other(90, 3.0);
  used.fit(other, a);
  const Places places = random_places(40, 10);
  const std::vector<double> values = values_of(places, not_a_cubic);
  used.factorize(places);
  fresh.factorize(places);
  EXPECT_EQ(used.fit(values, a), fresh.fit(values, b));
  EXPECT_EQ(a, b);
}

}  // namespace
}  // namespace ccslice
