// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "tests/support/brute_force.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

/// Collects hexes by their corner positions; equal positions are one vertex.
class HexSoup {
 public:
  /// Corners in VTK order.
  void add(const std::array<Vec3, 8>& corners) {
    mesh_.cell_kinds.push_back(CellKind::kHex);
    for (const Vec3& p : corners) mesh_.cell_vertices.push_back(vertex(p));
  }
  ControlMesh take() { return std::move(mesh_); }

 private:
  std::uint32_t vertex(const Vec3& p) {
    const std::array<long, 3> key = {std::lround(p.x() * 1e6), std::lround(p.y() * 1e6), std::lround(p.z() * 1e6)};
    const auto [it, added] = ids_.try_emplace(key, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (added) mesh_.positions.push_back(p);
    return it->second;
  }

  ControlMesh mesh_;
  std::map<std::array<long, 3>, std::uint32_t> ids_;
};

constexpr double kTopOfInnerLobe = 1.2;

/// Makes an arc round the y axis of two lobes that lie above one another along z, sharp on all edges, with a slit of
/// `width_mm` below the points that `is_lifted`. The channel is 0 on the inner lobe, `outer_value` on the outer one.
template <class Value, class Lifted>
void bend_lobes(ControlMesh& mesh, double width_mm, const Value& outer_value, const Lifted& is_lifted) {
  sharpen_by_cells(mesh, 1);
  mesh.channel_names = {"lobe"};
  for (Vec3& p : mesh.positions) {
    mesh.channel_values.push_back(p.z() > kTopOfInnerLobe ? static_cast<float>(outer_value(p)) : 0.0f);
    const double radius = 16 + 4 * std::round(p.z() - 0.25) + (is_lifted(p) ? width_mm : 0);
    const double angle = std::numbers::pi / 8 * p.x();
    p = Vec3(radius * std::sin(angle), 5 * p.y(), radius * std::cos(angle));
  }
}

}  // namespace

ControlMesh box_mesh(int nx, int ny, int nz, double size_mm, const KeepCell& keep) {
  HexSoup soup;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (keep && !keep(i, j, k)) continue;
        std::array<Vec3, 8> corners;
        for (int b = 0; b < 8; ++b) {
          corners[kVtkCorner[b]] = size_mm * Vec3(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2 & 1));
        }
        soup.add(corners);
      }
    }
  }
  return soup.take();
}

ControlMesh kuhn_box(int cells) {
  const ControlMesh box = box_mesh(cells, cells, cells);
  // The corners of a hexahedron between 0 and 6 on the six ways along its edges.
  constexpr std::array<std::array<std::size_t, 2>, 6> kWays = {{{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}}};
  ControlMesh mesh;
  mesh.positions = box.positions;
  for (std::size_t cell = 0; cell < box.cell_count(); ++cell) {
    const std::uint32_t* corner = &box.cell_vertices[8 * cell];
    for (const auto& [a, b] : kWays) {
      mesh.cell_kinds.push_back(CellKind::kTet);
      mesh.cell_vertices.insert(mesh.cell_vertices.end(), {corner[0], corner[a], corner[b], corner[6]});
    }
  }
  return mesh;
}

ControlMesh tapered_slit(double width_mm) {
  ControlMesh mesh = box_mesh(6, 2, 3, 1, [](int x, int, int z) { return z != 1 || x == 5; });
  sharpen_by_cells(mesh, 1);
  constexpr std::array<double, 7> kAlong = {0, 10, 17, 22, 25.5, 28, 30};
  mesh.channel_names = {"lobe"};
  for (Vec3& p : mesh.positions) {
    mesh.channel_values.push_back(p.z() > 1.5 && p.x() < 4.5 ? 1.0f : 0.0f);
    const double half = 0.5 + 10 * std::min(3.0, p.x());
    const std::array<double, 4> heights = {-half, half, half + width_mm, half + width_mm + 5};
    p = Vec3(kAlong[static_cast<std::size_t>(std::lround(p.x()))], 8 * p.y(),
             heights[static_cast<std::size_t>(std::lround(p.z()))]);
  }
  return mesh;
}

ControlMesh vertex_slit(double width_mm, int cells, bool only_a_quarter) {
  const int middle = cells / 2;
  // Wide at first: equal positions would be one vertex.
  HexSoup soup;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        std::array<Vec3, 8> corners;
        for (int b = 0; b < 8; ++b) {
          const int x = i + (b & 1), y = j + (b >> 1 & 1), z = k + (b >> 2 & 1);
          const bool apart = only_a_quarter ? x > middle && y > middle : x > middle || y > middle;
          corners[kVtkCorner[b]] = Vec3(x, y, z == 1 && k == 1 && apart ? 1.5 : z);
        }
        soup.add(corners);
      }
    }
  }
  ControlMesh mesh = soup.take();
  bend_lobes(
      mesh, width_mm, [](const Vec3&) { return 1.0; }, [](const Vec3& p) { return p.z() > kTopOfInnerLobe; });
  return mesh;
}

ControlMesh forked_slit(double width_mm) {
  using Corner = std::array<double, 2>;  // Along the arc, and across it.
  constexpr int kCells = 4;              // Along each lobe.
  constexpr double kAbove = 1.5, kEnd = -0.4;
  std::vector<std::array<Corner, 4>> quads = {{{{kEnd - 1, 1}, {kEnd, 0}, {0, 1}, {kEnd, 2}}}};
  for (int i = 0; i < kCells; ++i) {
    const double first = i == 0 ? kEnd : i, above = i == 0 ? 1 : kAbove;
    quads.push_back({{{first, 0}, {i + 1.0, 0}, {i + 1.0, 1}, {i + 0.0, 1}}});
    quads.push_back({{{i + 0.0, above}, {i + 1.0, kAbove}, {i + 1.0, 2}, {first, 2}}});
  }
  // Wide at first: equal positions would be one vertex.
  HexSoup soup;
  for (int layer = 0; layer < 2; ++layer) {
    for (const std::array<Corner, 4>& quad : quads) {
      std::array<Vec3, 8> corners;
      for (std::size_t c = 0; c < 8; ++c) {
        corners[c] = Vec3(quad[c % 4][0], layer + (c < 4 ? 0 : 1), quad[c % 4][1]);
      }
      soup.add(corners);
    }
  }
  ControlMesh mesh = soup.take();
  bend_lobes(
      mesh, width_mm, [](const Vec3& p) { return std::max(0.0, p.x()) / kCells; },
      [](const Vec3& p) { return p.z() == kAbove; });
  return mesh;
}

ControlMesh folding_box_mesh() {
  ControlMesh mesh = box_mesh(4, 4, 4);
  for (Vec3& p : mesh.positions) {
    if ((p - Vec3::Constant(20)).norm() < 1e-9) p += Vec3(80, 0, 0);
  }
  return mesh;
}

ControlMesh fan_mesh(int sectors, int m, int layers, double degrees) {
  const double half_step = degrees * std::numbers::pi / 180 / (2 * sectors);
  const double radius = 10.0 * m;
  const auto rim = [&](int i) -> Vec3 {  // Even: on a spoke; odd: the far corner of a sector.
    const double reach = i % 2 == 0 ? radius : radius / std::max(std::cos(half_step), 0.7);
    return {reach * std::cos(i * half_step), reach * std::sin(i * half_step), 0};
  };
  HexSoup soup;
  for (int layer = 0; layer < layers; ++layer) {
    for (int s = 0; s < sectors; ++s) {
      const Vec3 a = rim(2 * s), b = rim(2 * s + 1), c = rim(2 * s + 2);
      const auto at = [&](int i, int j, int k) -> Vec3 {
        const double u = double(i) / m, v = double(j) / m;
        return u * (1 - v) * a + u * v * b + (1 - u) * v * c + Vec3(0, 0, 10.0 * k);
      };
      for (int j = 0; j < m; ++j) {
        for (int i = 0; i < m; ++i) {
          const int k = layer;
          soup.add({at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
                    at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
        }
      }
    }
  }
  return soup.take();
}

ControlMesh star_mesh(const std::vector<Vec3>& sphere, const std::vector<std::array<int, 3>>& triangles) {
  HexSoup soup;
  for (const auto& [i, j, k] : triangles) {
    const Vec3 a = 10 * sphere[i].normalized();
    Vec3 b = 10 * sphere[j].normalized(), c = 10 * sphere[k].normalized();
    if (a.cross(b).dot(c) < 0) std::swap(b, c);
    const Vec3 ab = 13 * (a + b).normalized(), bc = 13 * (b + c).normalized(), ac = 13 * (a + c).normalized();
    const Vec3 abc = 15 * (a + b + c).normalized();
    soup.add({Vec3::Zero(), a, ab, b, c, ac, abc, bc});
  }
  return soup.take();
}

std::vector<std::array<int, 3>> hull_triangles(const std::vector<Vec3>& points) {
  std::vector<std::array<int, 3>> triangles;
  const int n = static_cast<int>(points.size());
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      for (int k = j + 1; k < n; ++k) {
        const Vec3 normal = (points[j] - points[i]).cross(points[k] - points[i]);
        int above = 0, below = 0;
        for (const Vec3& p : points) {
          const double height = normal.dot(p - points[i]);
          above += height > 1e-9;
          below += height < -1e-9;
        }
        if (above == 0 || below == 0) triangles.push_back({i, j, k});
      }
    }
  }
  return triangles;
}

ControlMesh refined_mesh(const ControlMesh& mesh) {
  const BruteMesh coarse = to_brute_mesh(mesh);
  const BruteMesh fine = refine(coarse, build_topology(coarse.cells, coarse.vertex_count())).mesh;
  ControlMesh result;
  for (std::uint32_t v = 0; v < fine.vertex_count(); ++v) result.positions.push_back(fine.position(v));
  for (const BruteCell& cell : fine.cells) {
    result.cell_kinds.push_back(CellKind::kHex);
    result.cell_vertices.insert(result.cell_vertices.end(), cell.v.begin(), cell.v.end());
  }
  for (const auto& edge : fine.sharp_edges) result.sharp_edges.push_back(edge);
  result.sharp_vertices.assign(fine.sharp_vertices.begin(), fine.sharp_vertices.end());
  return result;
}

void append_mesh(ControlMesh& mesh, const ControlMesh& other, const Vec3& offset) {
  const auto first = static_cast<std::uint32_t>(mesh.vertex_count());
  for (const Vec3& p : other.positions) mesh.positions.push_back(p + offset);
  mesh.channel_values.insert(mesh.channel_values.end(), other.channel_values.begin(), other.channel_values.end());
  mesh.cell_kinds.insert(mesh.cell_kinds.end(), other.cell_kinds.begin(), other.cell_kinds.end());
  for (const std::uint32_t v : other.cell_vertices) mesh.cell_vertices.push_back(first + v);
  for (const auto& [a, b] : other.sharp_edges) mesh.sharp_edges.push_back({first + a, first + b});
  for (const std::uint32_t v : other.sharp_vertices) mesh.sharp_vertices.push_back(first + v);
}

void jitter(ControlMesh& mesh, double amplitude_mm, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-amplitude_mm, amplitude_mm);
  for (Vec3& p : mesh.positions) p += Vec3(shift(random), shift(random), shift(random));
}

void add_random_channels(ControlMesh& mesh, int channels, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0, 1);
  for (int c = 0; c < channels; ++c) mesh.channel_names.push_back("channel" + std::to_string(c));
  for (std::size_t i = 0; i < mesh.vertex_count() * channels; ++i) mesh.channel_values.push_back(value(random));
}

void grade_by_coordinates(ControlMesh& mesh) {
  mesh.channel_names = {"x", "y", "z"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) {
    for (int d = 0; d < 3; ++d) mesh.channel_values.push_back(static_cast<float>(p[d]));
  }
}

void sharpen(ControlMesh& mesh, const std::function<bool(const Vec3&, const Vec3&)>& keep) {
  const BruteMesh brute = to_brute_mesh(mesh);
  const BruteTopology topology = build_topology(brute.cells, brute.vertex_count());
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    const auto& edge = topology.edges[e];
    if (!topology.edge_on_boundary(e) || brute.sharp_edges.contains(edge)) continue;
    if (keep(mesh.positions[edge[0]], mesh.positions[edge[1]])) mesh.sharp_edges.push_back(edge);
  }
}

void sharpen_by_cells(ControlMesh& mesh, std::size_t cells) {
  const BruteMesh brute = to_brute_mesh(mesh);
  const BruteTopology topology = build_topology(brute.cells, brute.vertex_count());
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    if (topology.edge_on_boundary(e) && topology.edge_cells[e].size() == cells)
      mesh.sharp_edges.push_back(topology.edges[e]);
  }
}

ControlMesh sharp_fan(int cells, double degrees, std::uint32_t seed) {
  ControlMesh mesh = fan_mesh(cells, 2, 3, degrees);
  jitter(mesh, 0.5, seed);
  const auto on_axis = [](const Vec3& p) { return std::hypot(p.x(), p.y()) < 1.5; };
  sharpen(mesh, [&](const Vec3& a, const Vec3& b) { return on_axis(a) && on_axis(b); });
  mesh.allow_folds = true;
  return mesh;
}

ControlMesh crossed_valleys() {
  ControlMesh mesh = box_mesh(6, 6, 2, 4);
  sharpen(mesh, [](const Vec3& a, const Vec3& b) {
    return a.z() == 8 && b.z() == 8 && ((a.x() == 12 && b.x() == 12) || (a.y() == 12 && b.y() == 12));
  });
  for (Vec3& p : mesh.positions) p.z() += 0.6 * (std::abs(p.x() - 12) + std::abs(p.y() - 12));
  mesh.allow_folds = true;
  return mesh;
}

ControlMesh band_along(const std::vector<double>& radii_mm) {
  ControlMesh mesh;
  mesh.channel_names = {"turn"};
  for (std::size_t k = 0; k < radii_mm.size(); ++k) {
    const double turn = static_cast<double>(k) / kBandCellsPerTurn, angle = 2 * std::numbers::pi * turn;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double radius = radii_mm[k] + 0.5 * i;
        mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), j);
        mesh.channel_values.push_back(static_cast<float>(turn));
      }
    }
  }
  const auto at = [](std::size_t k, std::size_t i, std::size_t j) {
    return static_cast<std::uint32_t>((k * 3 + i) * 3 + j);
  };
  for (std::size_t k = 0; k + 1 < radii_mm.size(); ++k) {
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t j = 0; j < 2; ++j) {
        mesh.cell_kinds.push_back(CellKind::kHex);
        for (const std::size_t up : {j, j + 1}) {
          mesh.cell_vertices.insert(mesh.cell_vertices.end(),
                                    {at(k, i, up), at(k, i + 1, up), at(k + 1, i + 1, up), at(k + 1, i, up)});
        }
      }
    }
  }
  return mesh;
}

ControlMesh spiral(double gap_mm) {
  std::vector<double> radii_mm;
  for (int k = 0; k <= 2 * kBandCellsPerTurn; ++k) radii_mm.push_back(4 + (1 + gap_mm) * k / kBandCellsPerTurn);
  return band_along(radii_mm);
}

ControlMesh nested_shells(int count) {
  ControlMesh mesh;
  for (int n = 0; n < count; ++n) {
    ControlMesh shell = box_mesh(1, 12, 4, 1);
    for (Vec3& p : shell.positions) {
      const double radius = 5 * (n + 1 + p.x()) + 2 * std::sin(std::numbers::pi / 4 * p.z());
      const double angle = std::numbers::pi / 8 * p.y();
      p = Vec3(radius * std::cos(angle), radius * std::sin(angle), 5 * p.z());
    }
    append_mesh(mesh, shell, Vec3::Zero());
  }
  return mesh;
}

}  // namespace ccslice::oracle
