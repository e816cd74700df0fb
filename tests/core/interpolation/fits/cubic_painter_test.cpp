// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/cubic_painter.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace ccslice {
namespace {

constexpr std::size_t kChannels = 2;

struct Piece {
  VoxelFrame frame;
  std::vector<CubicPolynomial> polynomials;
};

std::vector<Piece> random_pieces(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> coefficient(-1, 1);
  std::vector<Piece> pieces(count);
  for (Piece& piece : pieces) {
    const Vec3 low = 10 * Vec3::NullaryExpr([&] { return coefficient(random); });
    piece.frame = VoxelFrame::of(low, low + Vec3::Constant(8));
    piece.polynomials.resize(kChannels);
    for (CubicPolynomial& polynomial : piece.polynomials) {
      for (double& c : polynomial) c = coefficient(random);
    }
  }
  return pieces;
}

void expect_cubics(LayerCubics& cubics, const std::vector<Piece>& pieces, std::uint32_t index, std::uint32_t layer) {
  const Piece& piece = pieces[index];
  cubics.prefetch_for(index, piece.polynomials);
  const CubicInLayer* const found = cubics.of(index, piece.frame, piece.polynomials, layer);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const Vec3 place = piece.frame(Vec3(3, 5, layer));
    const auto [c0, c1, c2, c3] = along_row(found[c], place.y());
    const double value = ((c3 * place.x() + c2) * place.x() + c1) * place.x() + c0;
    EXPECT_EQ(value, value_at(piece.polynomials[c], place)) << index << " in layer " << layer;
  }
}

TEST(LayerCubics, AreThoseOfTheLayerInAnyOrder) {
  std::mt19937 random(3);
  const std::vector<Piece> pieces = random_pieces(40, random);
  LayerCubics cubics;
  for (int i = 0; i < 2000; ++i) {
    expect_cubics(cubics, pieces, static_cast<std::uint32_t>(random() % pieces.size()),
                  static_cast<std::uint32_t>(random() % 3));
  }
}

TEST(LayerCubics, AreForgottenWithTheSlab) {
  std::mt19937 random(4);
  const std::vector<Piece> before = random_pieces(4, random), after = random_pieces(4, random);
  LayerCubics cubics;
  for (std::uint32_t index = 0; index < 4; ++index) expect_cubics(cubics, before, index, 7);
  cubics.clear();
  for (std::uint32_t index = 0; index < 4; ++index) expect_cubics(cubics, after, index, 7);
}

}  // namespace
}  // namespace ccslice
