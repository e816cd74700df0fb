// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/pixel_surface.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <vector>

namespace ccslice {
namespace {

/// A polynomial and its slopes.
struct Function {
  std::function<double(double, double)> value, along_u, along_v;

  SurfaceSample at(const Vec2& place) const {
    return {value(place.x(), place.y()), {along_u(place.x(), place.y()), along_v(place.x(), place.y())}};
  }
};

const Function kQuadratic = {[](double u, double v) { return 1 + 2 * u - 3 * v + 0.5 * u * u - u * v + 2 * v * v; },
                             [](double u, double v) { return 2 + u - v; },
                             [](double u, double v) { return -3 - u + 4 * v; }};
const Function kCubic = {[](double u, double v) { return u * u * u - 2 * v * v * v + u * u * v + u * v * v * v; },
                         [](double u, double v) { return 3 * u * u + 2 * u * v + v * v * v; },
                         [](double u, double v) { return -6 * v * v + u * u + 3 * u * v * v; }};

const std::array kCorners = {Vec2(-1, -1), Vec2(1, -1), Vec2(-1, 1), Vec2(1, 1)};
const std::array kInside = {Vec2(0, 0), Vec2(0.3, -0.7), Vec2(-0.9, 0.2), Vec2(0.5, 0.5)};

std::vector<SurfaceSample> samples_of(const Function& function, std::span<const Vec2> places) {
  std::vector<SurfaceSample> samples;
  for (const Vec2& place : places) samples.push_back(function.at(place));
  return samples;
}

void expect_alike(const PixelSurface& surface, const Function& function) {
  for (const Vec2& place : kInside) {
    const SurfaceSample found = surface.at(place), meant = function.at(place);
    EXPECT_NEAR(found.value, meant.value, 1e-3) << place.transpose();
    EXPECT_LT((found.slope - meant.slope).norm(), 3e-3) << place.transpose();
  }
}

TEST(PixelSurface, OfCornersReproducesCubics) {
  for (const Function* function : {&kQuadratic, &kCubic}) {
    const auto samples = samples_of(*function, kCorners);
    expect_alike(surface_of_corners({samples[0], samples[1], samples[2], samples[3]}), *function);
  }
}

TEST(PixelSurface, RowsAreItsValues) {
  const auto samples = samples_of(kCubic, kCorners);
  const PixelSurface surface = surface_of_corners({samples[0], samples[1], samples[2], samples[3]});
  const std::array<double, 4> row = surface.row(0.3);
  for (const double u : {-1.0, -0.2, 0.6}) {
    EXPECT_NEAR(row[0] + u * (row[1] + u * (row[2] + u * row[3])), surface.at({u, 0.3}).value, 1e-14);
  }
}

TEST(QuadraticFitter, ReproducesQuadraticsFromThreePlacesOrMore) {
  const std::vector<std::vector<Vec2>> all = {{kCorners.begin(), kCorners.end()},
                                              {Vec2(-1, -1), Vec2(0.75, -1), Vec2(-1, 0.5)},
                                              {kCorners[0], kCorners[1], kCorners[2], kCorners[3], Vec2(0.25, 0)}};
  for (const auto& places : all) {
    const QuadraticFitter fitter(places);
    const auto samples = samples_of(kQuadratic, places);
    const PixelSurface surface = fitter.fit(samples);
    expect_alike(surface, kQuadratic);
    EXPECT_LT(fitter.misfit(surface, samples), 1e-3);
  }
}

TEST(QuadraticFitter, MisfitTellsWhatIsntQuadratic) {
  const auto samples = samples_of(kCubic, kCorners);
  const PixelSurface surface = QuadraticFitter::of_corners().fit(samples);
  const double misfit = QuadraticFitter::of_corners().misfit(surface, samples);
  double worst = 0;
  for (const Vec2& place : kInside) {
    worst = std::max(worst, std::abs(surface.at(place).value - kCubic.at(place).value));
  }
  EXPECT_GT(misfit, 0.5 * worst);
}

TEST(QuadraticFitter, KeepsWhatAPairLeavesOpenSmall) {
  // Along a row: the bend across it isn't known.
  const std::array places = {Vec2(-1, -1), Vec2(1, -1)};
  const auto samples = samples_of(kQuadratic, places);
  const QuadraticFitter fitter(places);
  const PixelSurface surface = fitter.fit(samples);
  EXPECT_LT(fitter.misfit(surface, samples), 1e-2);
  EXPECT_NEAR(surface.at({0, -1}).value, kQuadratic.at({0, -1}).value, 1e-2);
  const double bend = surface.at({0, 1}).slope.y() - surface.at({0, -1}).slope.y();
  EXPECT_LT(std::abs(bend), 4 * 4);
}

}  // namespace
}  // namespace ccslice
