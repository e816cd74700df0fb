// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/models/models.h"

#include <array>
#include <cmath>
#include <numbers>

namespace ccslice {
namespace {

/// Vertices numbered over a lattice of (i, j, k), i fastest; round the ring i wraps.
class Lattice {
 public:
  Lattice(int points_i, int points_j, bool wraps) : points_i_(points_i), points_j_(points_j), wraps_(wraps) {}

  std::uint32_t vertex(int i, int j, int k) const {
    return static_cast<std::uint32_t>((wraps_ ? i % points_i_ : i) + points_i_ * (j + points_j_ * k));
  }
  void append_hex(int i, int j, int k, ControlMesh& mesh) const {
    constexpr std::array<std::array<int, 3>, 8> kCorners = {
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
    for (const auto& [di, dj, dk] : kCorners) mesh.cell_vertices.push_back(vertex(i + di, j + dj, k + dk));
    mesh.cell_kinds.push_back(CellKind::kHex);
  }

 private:
  int points_i_, points_j_;
  bool wraps_;
};

/// Clockwise seen from above, so that (round, outwards, up) is a right-handed frame.
void append_ring_vertices(const RingShape& shape, ControlMesh& mesh) {
  const double step = 2 * std::numbers::pi / shape.cells_round;
  const double control_per_limit = 6 / (4 + 2 * std::cos(step));
  for (int k = 0; k <= shape.cells_high; ++k) {
    for (int j = 0; j <= shape.cells_across; ++j) {
      const double fraction = static_cast<double>(j) / shape.cells_across;
      const double limit_radius = 0.5 * std::lerp(shape.inner_diameter_mm, shape.outer_diameter_mm, fraction);
      for (int i = 0; i < shape.cells_round; ++i) {
        const double radius = limit_radius * control_per_limit;
        mesh.positions.emplace_back(radius * std::cos(i * step), -radius * std::sin(i * step),
                                    shape.height_mm * k / shape.cells_high);
        mesh.channel_values.push_back(static_cast<float>(fraction));
      }
    }
  }
}

void append_box_sharp_edges(const BoxShape& shape, const Lattice& lattice, ControlMesh& mesh) {
  for (const int b : {0, 1}) {
    for (const int c : {0, 1}) {
      const int y = b * shape.cells_y, z = c * shape.cells_z;
      for (int i = 0; i < shape.cells_x; ++i) {
        mesh.sharp_edges.push_back({lattice.vertex(i, y, z), lattice.vertex(i + 1, y, z)});
      }
      const int x = b * shape.cells_x;
      for (int j = 0; j < shape.cells_y; ++j) {
        mesh.sharp_edges.push_back({lattice.vertex(x, j, z), lattice.vertex(x, j + 1, z)});
      }
      const int y2 = c * shape.cells_y;
      for (int k = 0; k < shape.cells_z; ++k) {
        mesh.sharp_edges.push_back({lattice.vertex(x, y2, k), lattice.vertex(x, y2, k + 1)});
      }
    }
  }
}

constexpr std::array<SampleModel, 6> kModels = {
    {{"box", "a 24 x 16 x 8 mm box with sharp edges, 48 cells, channel 'gradient' along x", [] { return make_box(); }},
     {"bracket", "a topology-optimized plate of 144 mm, 163 cells, channel 'stiffness' from the middle outwards",
      make_bracket},
     {"coyote", "a coyote standing, on its side, of 84 mm, 48 cells, channel 'stiffness' from its back to its paws",
      make_coyote},
     {"engine", "a block of 46 mm with six bores, 301 cells, channel 'hardness' highest in the bores' liners",
      make_engine},
     {"grid", "a lattice of 56 mm, 1,000 cells, channel 'stiffness' along x and higher within the nodes", make_grid},
     {"ring", "a ring of 83.5 mm, 512 regular cells, channel 'hardness' from its inner to its outer radius",
      [] { return make_ring(); }}}};

}  // namespace

ControlMesh make_ring(const RingShape& shape) {
  ControlMesh mesh;
  mesh.channel_names = {"hardness"};
  append_ring_vertices(shape, mesh);
  const Lattice lattice(shape.cells_round, shape.cells_across + 1, true);
  for (int k = 0; k < shape.cells_high; ++k) {
    for (int j = 0; j < shape.cells_across; ++j) {
      for (int i = 0; i < shape.cells_round; ++i) lattice.append_hex(i, j, k, mesh);
    }
  }
  for (const int k : {0, shape.cells_high}) {
    for (const int j : {0, shape.cells_across}) {
      for (int i = 0; i < shape.cells_round; ++i) {
        mesh.sharp_edges.push_back({lattice.vertex(i, j, k), lattice.vertex(i + 1, j, k)});
      }
    }
  }
  return mesh;
}

ControlMesh make_box(const BoxShape& shape) {
  ControlMesh mesh;
  mesh.channel_names = {"gradient"};
  const Vec3 counts(shape.cells_x, shape.cells_y, shape.cells_z);
  for (int k = 0; k <= shape.cells_z; ++k) {
    for (int j = 0; j <= shape.cells_y; ++j) {
      for (int i = 0; i <= shape.cells_x; ++i) {
        mesh.positions.push_back(shape.size_mm.cwiseProduct(Vec3(i, j, k)).cwiseQuotient(counts));
        mesh.channel_values.push_back(static_cast<float>(i) / static_cast<float>(shape.cells_x));
      }
    }
  }
  const Lattice lattice(shape.cells_x + 1, shape.cells_y + 1, false);
  for (int k = 0; k < shape.cells_z; ++k) {
    for (int j = 0; j < shape.cells_y; ++j) {
      for (int i = 0; i < shape.cells_x; ++i) lattice.append_hex(i, j, k, mesh);
    }
  }
  append_box_sharp_edges(shape, lattice, mesh);
  return mesh;
}

std::span<const SampleModel> sample_models() { return kModels; }

const SampleModel* find_sample_model(std::string_view name) {
  for (const SampleModel& model : kModels) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

}  // namespace ccslice
