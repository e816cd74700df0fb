// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/models/model_builder.h"

#include <utility>

namespace ccslice {
namespace {

/// u, v, w of the corners of a hexahedron.
constexpr std::array<std::array<int, 3>, 8> kCorners = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};

/// Corners of the cells round a core or an inset: on each side (four), below, above. 0-7 are the whole's, 8-15 the
/// core's.
constexpr std::array<std::array<std::uint8_t, 8>, 6> kRound = {{{0, 1, 9, 8, 4, 5, 13, 12},
                                                                {1, 2, 10, 9, 5, 6, 14, 13},
                                                                {2, 3, 11, 10, 6, 7, 15, 14},
                                                                {3, 0, 8, 11, 7, 4, 12, 15},
                                                                {0, 1, 2, 3, 8, 9, 10, 11},
                                                                {12, 13, 14, 15, 4, 5, 6, 7}}};
constexpr std::size_t kRoundInset = 5;

}  // namespace

ModelBuilder::Vertex ModelBuilder::add_vertex(const Vec3& position, double value) {
  mesh_.positions.push_back(position);
  mesh_.channel_values.push_back(static_cast<float>(value));
  return static_cast<Vertex>(mesh_.positions.size() - 1);
}

void ModelBuilder::add_cell(CellKind kind, std::span<const Vertex> corners) {
  mesh_.cell_kinds.push_back(kind);
  mesh_.cell_vertices.insert(mesh_.cell_vertices.end(), corners.begin(), corners.end());
}

Vec3 ModelBuilder::inside(const Hex& corners, const Vec3& uvw) const {
  Vec3 point = Vec3::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    double weight = 1;
    for (int d = 0; d < 3; ++d) weight *= kCorners[i][static_cast<std::size_t>(d)] == 1 ? uvw[d] : 1 - uvw[d];
    point += weight * position(corners[i]);
  }
  return point;
}

ModelBuilder::Hex ModelBuilder::add_column(const Hex& corners, double share, double bottom, double top, double value) {
  Hex column{};
  const auto across = [share](int bit) { return 0.5 + (bit - 0.5) * share; };
  for (std::size_t i = 0; i < column.size(); ++i) {
    const auto& [u, v, w] = kCorners[i];
    column[i] = add_vertex(inside(corners, Vec3(across(u), across(v), w == 1 ? top : bottom)), value);
  }
  add_hex(column);
  return column;
}

void ModelBuilder::add_round(const Hex& corners, const Hex& column, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    Hex cell{};
    for (std::size_t c = 0; c < cell.size(); ++c) {
      const std::size_t at = kRound[i][c];
      cell[c] = at < corners.size() ? corners[at] : column[at - corners.size()];
    }
    add_hex(cell);
  }
}

void ModelBuilder::add_hex_with_core(const Hex& corners, double share, double value) {
  const Hex core = add_column(corners, share, 0.5 - share / 2, 0.5 + share / 2, value);
  add_round(corners, core, kRound.size());
}

std::array<ModelBuilder::Vertex, 4> ModelBuilder::add_hex_with_inset(const Hex& corners, double share, double depth,
                                                                     double value) {
  const Hex column = add_column(corners, share, 1 - depth, 1, value);
  add_round(corners, column, kRoundInset);
  return {column[4], column[5], column[6], column[7]};
}

ControlMesh ModelBuilder::finish(const Box3& limit, const Vec3& size_mm) && {
  const Vec3 scale = size_mm.cwiseQuotient(limit.sizes());
  for (Vec3& p : mesh_.positions) p = (p - limit.min()).cwiseProduct(scale);
  return std::move(mesh_);
}

}  // namespace ccslice
