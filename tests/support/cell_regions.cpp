// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/cell_regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/models/models.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

using Face = std::vector<std::uint32_t>;
using Edge = std::array<std::uint32_t, 2>;

/// Corners of a cell's faces, VTK order.
std::vector<std::vector<int>> face_corners(CellKind kind) {
  switch (kind) {
    case CellKind::kHex: return {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    case CellKind::kTet: return {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    case CellKind::kWedge: break;
  }
  return {{0, 1, 2}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
}

Edge edge_of(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The faces between regions and those of the boundary, with the regions on their sides (-1: outside).
struct Separating {
  Face ring;
  std::set<int> regions;
};

std::vector<Separating> separating_faces(const ControlMesh& mesh) {
  std::map<Face, std::pair<Face, std::vector<int>>> sides;
  std::size_t begin = 0;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    for (const std::vector<int>& corners : face_corners(mesh.cell_kinds[c])) {
      Face ring;
      for (const int corner : corners) ring.push_back(mesh.cell_vertices[begin + static_cast<std::size_t>(corner)]);
      Face key = ring;
      std::ranges::sort(key);
      sides[key].first = ring;
      sides[key].second.push_back(mesh.cell_regions[c]);
    }
    begin += static_cast<std::size_t>(corner_count(mesh.cell_kinds[c]));
  }
  std::vector<Separating> faces;
  for (auto& [key, side] : sides) {
    if (side.second.size() == 1) side.second.push_back(-1);
    if (side.second[0] != side.second[1]) faces.push_back({side.first, {side.second.begin(), side.second.end()}});
  }
  return faces;
}

/// Each cube cut into six tetrahedra round a diagonal, or into two wedges.
ControlMesh cut_cubes(const ControlMesh& cubes, CellKind kind) {
  using Pieces = std::vector<std::vector<std::size_t>>;
  const Pieces tets = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  const Pieces wedges = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
  ControlMesh cut = cubes;
  cut.cell_kinds.clear();
  cut.cell_vertices.clear();
  for (std::size_t c = 0; c < cubes.cell_count(); ++c) {
    for (const auto& piece : kind == CellKind::kTet ? tets : wedges) {
      cut.cell_kinds.push_back(kind);
      for (const std::size_t corner : piece) cut.cell_vertices.push_back(cubes.cell_vertices[8 * c + corner]);
    }
  }
  return cut;
}

/// What a vertex has in a region.
void add_channels(const ControlMesh& mesh, std::uint32_t vertex, int region, ControlMesh& part) {
  const std::size_t channels = mesh.channel_names.size();
  auto first = mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(vertex * channels);
  for (std::size_t i = 0; i < mesh.region_value_vertices.size(); ++i) {
    if (mesh.region_value_vertices[i] != vertex || mesh.region_value_regions[i] != region) continue;
    first = mesh.region_values.begin() + static_cast<std::ptrdiff_t>(i * channels);
  }
  part.channel_values.insert(part.channel_values.end(), first, first + static_cast<std::ptrdiff_t>(channels));
}

}  // namespace

ControlMesh with_regions(ControlMesh mesh, int count, const RegionAt& region_at) {
  mesh.cell_region_names.clear();
  mesh.cell_regions.clear();
  for (int r = 0; r < count; ++r) mesh.cell_region_names.push_back("r" + std::to_string(r));
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    const auto corners = static_cast<std::size_t>(corner_count(kind));
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < corners; ++i) sum += mesh.positions[mesh.cell_vertices[begin + i]];
    mesh.cell_regions.push_back(static_cast<std::uint8_t>(region_at(sum / static_cast<double>(corners))));
    begin += corners;
  }
  return mesh;
}

ControlMesh with_jumping_channels(ControlMesh mesh, const std::vector<std::string>& names,
                                  const RegionValuesAt& values_at) {
  std::map<std::uint32_t, std::set<std::uint8_t>> regions_of;
  std::size_t begin = 0;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[c]));
    for (std::size_t i = 0; i < corners; ++i) regions_of[mesh.cell_vertices[begin + i]].insert(mesh.cell_regions[c]);
    begin += corners;
  }
  mesh.channel_names = names;
  mesh.channel_values.clear();
  for (const auto& [vertex, regions] : regions_of) {
    for (const std::uint8_t region : regions) {
      const std::vector<float> values = values_at(vertex, region);
      std::vector<float>& all = region == *regions.begin() ? mesh.channel_values : mesh.region_values;
      all.insert(all.end(), values.begin(), values.end());
      if (region == *regions.begin()) continue;
      mesh.region_value_vertices.push_back(vertex);
      mesh.region_value_regions.push_back(region);
    }
  }
  return mesh;
}

ControlMesh region_as_mesh(const ControlMesh& mesh, int region) {
  std::map<Edge, int> face_count;
  std::map<Edge, std::set<int>> edge_regions;
  std::map<std::uint32_t, std::set<int>> vertex_regions;
  for (const Separating& face : separating_faces(mesh)) {
    for (std::size_t i = 0; i < face.ring.size(); ++i) {
      const Edge edge = edge_of(face.ring[i], face.ring[(i + 1) % face.ring.size()]);
      ++face_count[edge];
      edge_regions[edge].insert(face.regions.begin(), face.regions.end());
      vertex_regions[face.ring[i]].insert(face.regions.begin(), face.regions.end());
    }
  }
  std::set<Edge> sharp;
  for (const auto& [edge, count] : face_count) {
    if (count > 2) sharp.insert(edge);
  }
  for (const auto& [a, b] : mesh.sharp_edges) sharp.insert(edge_of(a, b));
  std::map<std::uint32_t, std::vector<Edge>> sharp_at;
  for (const Edge& edge : sharp) {
    for (const std::uint32_t v : edge) sharp_at[v].push_back(edge);
  }
  const auto solid_regions = [](std::set<int> regions) {
    regions.erase(-1);
    return regions;
  };

  ControlMesh part;
  part.channel_names = mesh.channel_names;
  std::map<std::uint32_t, std::uint32_t> number;
  std::size_t begin = 0;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[c]));
    if (mesh.cell_regions[c] == region) {
      part.cell_kinds.push_back(mesh.cell_kinds[c]);
      for (std::size_t i = 0; i < corners; ++i) {
        const std::uint32_t v = mesh.cell_vertices[begin + i];
        const auto [known, is_new] = number.try_emplace(v, static_cast<std::uint32_t>(part.positions.size()));
        if (is_new) {
          part.positions.push_back(mesh.positions[v]);
          add_channels(mesh, v, region, part);
        }
        part.cell_vertices.push_back(known->second);
      }
    }
    begin += corners;
  }
  for (const Edge& edge : sharp) {
    if (edge_regions[edge].contains(region)) part.sharp_edges.push_back({number.at(edge[0]), number.at(edge[1])});
  }
  const std::set<std::uint32_t> tagged(mesh.sharp_vertices.begin(), mesh.sharp_vertices.end());
  for (const auto& [v, regions] : vertex_regions) {
    if (!regions.contains(region)) continue;
    bool corner = tagged.contains(v);
    if (solid_regions(regions).size() > 1 && !sharp_at[v].empty()) {
      corner = corner || sharp_at[v].size() > 2;
      for (const Edge& edge : sharp_at[v]) {
        corner = corner || solid_regions(edge_regions[edge]) != solid_regions(regions);
      }
    }
    if (corner) part.sharp_vertices.push_back(number.at(v));
  }
  return part;
}

const std::vector<RegionMesh>& region_meshes() {
  static const std::vector<RegionMesh> kMeshes = [] {
    std::vector<RegionMesh> meshes;
    const auto jittered = [](ControlMesh mesh, double amplitude_mm) {
      jitter(mesh, amplitude_mm, 7);
      add_random_channels(mesh, 1, 3);
      return mesh;
    };
    const auto slabs = [](const Vec3& p) { return std::clamp(static_cast<int>(p.x() / 20), 0, 2); };
    meshes.push_back({"three_slabs", with_regions(jittered(box_mesh(6, 2, 2), 1.5), 3, slabs)});
    meshes.push_back({"three_at_a_line", with_regions(jittered(box_mesh(4, 3, 4), 1.5), 3, [](const Vec3& p) {
                        return p.z() < 20 ? 0 : p.x() < 20 ? 1 : 2;
                      })});
    meshes.push_back({"four_at_a_line", with_regions(jittered(box_mesh(4, 4, 2), 1.5), 4, [](const Vec3& p) {
                        return (p.x() < 20 ? 0 : 1) + (p.y() < 20 ? 0 : 2);
                      })});
    meshes.push_back({"eight_at_a_point", with_regions(jittered(box_mesh(4, 4, 4), 1.5), 8, [](const Vec3& p) {
                        return (p.x() < 20 ? 0 : 1) + (p.y() < 20 ? 0 : 2) + (p.z() < 20 ? 0 : 4);
                      })});
    meshes.push_back({"core_inside", with_regions(jittered(box_mesh(5, 5, 5), 1.5), 2, [](const Vec3& p) {
                        return (p - Vec3(25, 25, 25)).cwiseAbs().maxCoeff() < 14 ? 0 : 1;
                      })});
    meshes.push_back({"region_of_two_pieces", with_regions(jittered(box_mesh(6, 2, 2), 1.5), 2, [](const Vec3& p) {
                        return p.x() > 20 && p.x() < 40 ? 0 : 1;
                      })});
    const auto halves = [](const Vec3& p) { return p.x() < 20 ? 0 : 1; };
    meshes.push_back({"tets", with_regions(jittered(cut_cubes(box_mesh(4, 2, 2), CellKind::kTet), 1), 2, halves)});
    meshes.push_back({"wedges", with_regions(jittered(cut_cubes(box_mesh(4, 2, 2), CellKind::kWedge), 1), 2, halves)});
    meshes.push_back({"core_through_a_cylinder", with_regions(jittered(fan_mesh(6, 3, 3), 0.5), 2, [](const Vec3& p) {
                        return p.head<2>().norm() < 20 ? 0 : 1;
                      })});
    ControlMesh sharp = jittered(box_mesh(6, 2, 2), 1);
    sharpen_by_cells(sharp, 1);
    meshes.push_back({"sharp_slabs", with_regions(sharp, 3, slabs)});
    meshes.push_back(
        {"halves_of_a_ring", with_regions(make_ring(), 2, [](const Vec3& p) { return p.x() < 0 ? 0 : 1; })});
    return meshes;
  }();
  return kMeshes;
}

}  // namespace ccslice::oracle
