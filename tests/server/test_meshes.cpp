// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/server/test_meshes.h"

#include <array>
#include <map>
#include <random>
#include <string>

namespace ccslice::server {
namespace {

/// Vertices of an n^3 block by their places 0..n in each direction.
class Places {
 public:
  explicit Places(std::uint32_t n) : n_(n) {}
  std::uint32_t at(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return (k * (n_ + 1) + j) * (n_ + 1) + i;
  }

 private:
  std::uint32_t n_;
};

void add_vertices(std::uint32_t n, double size_mm, v1::ControlMesh& mesh) {
  const double step = size_mm / n;
  for (std::uint32_t k = 0; k <= n; ++k) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      for (std::uint32_t i = 0; i <= n; ++i) {
        for (const std::uint32_t place : {i, j, k}) mesh.add_positions_mm(place * step);
      }
    }
  }
}

void add_cells(std::uint32_t n, v1::ControlMesh& mesh) {
  const Places vertex(n);
  for (std::uint32_t k = 0; k < n; ++k) {
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i) {
        mesh.add_cell_kinds(v1::CELL_KIND_HEX);
        for (const std::uint32_t above : {k, k + 1}) {
          mesh.add_cell_vertices(vertex.at(i, j, above));
          mesh.add_cell_vertices(vertex.at(i + 1, j, above));
          mesh.add_cell_vertices(vertex.at(i + 1, j + 1, above));
          mesh.add_cell_vertices(vertex.at(i, j + 1, above));
        }
      }
    }
  }
}

void add_sharp_edge(std::uint32_t a, std::uint32_t b, v1::ControlMesh& mesh) {
  mesh.add_sharp_edges(a);
  mesh.add_sharp_edges(b);
}

}  // namespace

v1::ControlMesh make_plain_block(std::uint32_t n, double size_mm) {
  v1::ControlMesh mesh;
  add_vertices(n, size_mm, mesh);
  add_cells(n, mesh);
  return mesh;
}

v1::ControlMesh make_block(std::uint32_t n, double size_mm) {
  v1::ControlMesh mesh = make_plain_block(n, size_mm);
  mesh.add_channel_names("x");
  for (int i = 0; i < mesh.positions_mm_size(); i += 3) {
    mesh.add_channel_values(static_cast<float>(mesh.positions_mm(i)));
  }
  return mesh;
}

v1::ControlMesh make_box(std::uint32_t n, double size_mm) {
  v1::ControlMesh mesh = make_block(n, size_mm);
  const Places vertex(n);
  for (const std::uint32_t a : {0u, n}) {
    for (const std::uint32_t b : {0u, n}) {
      for (std::uint32_t i = 0; i < n; ++i) {
        add_sharp_edge(vertex.at(i, a, b), vertex.at(i + 1, a, b), mesh);
        add_sharp_edge(vertex.at(a, i, b), vertex.at(a, i + 1, b), mesh);
        add_sharp_edge(vertex.at(a, b, i), vertex.at(a, b, i + 1), mesh);
      }
    }
  }
  return mesh;
}

v1::ControlMesh make_overlapping_boxes(std::uint32_t count) {
  v1::ControlMesh all;
  const v1::ControlMesh box = make_plain_block(1, 10);
  std::mt19937 random(1);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(all.positions_mm_size()) / 3;
    std::array<double, 3> shift_mm;
    for (double& shift : shift_mm) shift = 2.0 * random() / std::mt19937::max() - 1;
    for (int p = 0; p < box.positions_mm_size(); ++p) {
      all.add_positions_mm(box.positions_mm(p) + shift_mm[static_cast<std::size_t>(p % 3)]);
    }
    all.add_cell_kinds(v1::CELL_KIND_HEX);
    for (const std::uint32_t vertex : box.cell_vertices()) all.add_cell_vertices(first + vertex);
  }
  return all;
}

v1::ControlMesh make_two_blocks(double shift_mm) {
  const v1::ControlMesh block = make_block(2, 10);
  v1::ControlMesh both = block;
  const auto first = static_cast<std::uint32_t>(block.positions_mm_size()) / 3;
  for (int p = 0; p < block.positions_mm_size(); ++p) {
    both.add_positions_mm(block.positions_mm(p) + (p % 3 == 0 ? shift_mm : 0));
  }
  both.mutable_cell_kinds()->MergeFrom(block.cell_kinds());
  both.mutable_channel_values()->MergeFrom(block.channel_values());
  for (const std::uint32_t vertex : block.cell_vertices()) both.add_cell_vertices(first + vertex);
  return both;
}

v1::ControlMesh make_comb(std::uint32_t walls) {
  constexpr double kWallMm = 0.5;
  const std::uint32_t steps = 2 * walls + 1;
  v1::ControlMesh mesh;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> vertices;  // By their places.
  const auto vertex = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    const auto [at, is_new] = vertices.try_emplace({x, y, z}, static_cast<std::uint32_t>(vertices.size()));
    if (is_new) {
      mesh.add_positions_mm(kWallMm * x);
      mesh.add_positions_mm(10.0 * y);
      mesh.add_positions_mm(std::array{0.0, 1.0, 20.0}[z]);
    }
    return at->second;
  };
  for (std::uint32_t x = 0; x < steps; ++x) {
    const std::uint32_t height = x % 2 == 0 ? 1 : 2;  // Of the plate, or with a wall.
    for (std::uint32_t z = 0; z < height; ++z) {
      mesh.add_cell_kinds(v1::CELL_KIND_HEX);
      for (const std::uint32_t above : {z, z + 1}) {
        mesh.add_cell_vertices(vertex(x, 0, above));
        mesh.add_cell_vertices(vertex(x + 1, 0, above));
        mesh.add_cell_vertices(vertex(x + 1, 1, above));
        mesh.add_cell_vertices(vertex(x, 1, above));
      }
    }
  }
  return mesh;
}

v1::ControlMesh with_channels(v1::ControlMesh mesh, int channels) {
  mesh.clear_channel_names();
  mesh.clear_channel_values();
  for (int c = 0; c < channels; ++c) mesh.add_channel_names("channel " + std::to_string(c));
  for (int v = 0; v < mesh.positions_mm_size(); v += 3) {
    for (int c = 0; c < channels; ++c) mesh.add_channel_values(static_cast<float>(c));
  }
  return mesh;
}

}  // namespace ccslice::server
