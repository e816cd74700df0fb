// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_regions.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "core/base/contains.h"
#include "core/mesh/offenders.h"
#include "core/mesh/region_values.h"

namespace ccslice {

namespace {

/// Faces of the boundary, and those between cells of different regions.
bool separates(const ControlMesh& mesh, const CellComplex& complex, FaceId face) {
  if (complex.face_on_boundary(face)) return true;
  const auto [a, b] = half_faces_of(face);
  return region_of(mesh, complex.half_face_cell(a)) != region_of(mesh, complex.half_face_cell(b));
}

bool differ(const ControlMesh& mesh, std::span<const CellId> cells) {
  return std::ranges::any_of(cells, [&](CellId c) { return region_of(mesh, c) != region_of(mesh, cells.front()); });
}

class Splitter {
 public:
  Splitter(const ControlMesh& mesh, const CellComplex& complex, const CancellationToken& cancel)
      : mesh_(mesh), complex_(complex), cancel_(cancel), split_{mesh, {}, {}} {}

  SplitMesh run() {
    split_.origins.resize(mesh_.vertex_count());
    std::iota(split_.origins.begin(), split_.origins.end(), 0u);
    clear_region_values(split_.mesh);
    find_cell_begins();
    mark_junctions();
    split_vertices();
    copy_sharp_edges();
    copy_sharp_vertices();
    find_interfaces();
    return std::move(split_);
  }

 private:
  void find_cell_begins();
  void mark_junctions();
  void split_vertices();
  void split_vertex(VertexId vertex);
  void number_fans(VertexId vertex, std::span<const CellId> cells);
  bool is_half_ball(VertexId vertex, std::span<const CellId> fan) const;
  std::uint32_t add_copy(VertexId vertex);
  void set_channels(std::uint32_t copy, VertexId vertex, std::uint8_t region);
  std::span<std::uint32_t> copies_in(CellId cell);
  std::uint32_t copy_in(CellId cell, VertexId vertex);
  void keep_corner(VertexId vertex, std::span<const CellId> cells);
  void copy_sharp_edges();
  void copy_sharp_vertices();
  void find_interfaces();

  const ControlMesh& mesh_;
  const CellComplex& complex_;
  const CancellationToken& cancel_;
  SplitMesh split_;
  std::vector<std::size_t> cell_begins_;      // In cell_vertices.
  std::vector<std::uint8_t> sharp_;           // By edge: junctions, and what the mesh has sharp.
  std::vector<std::uint32_t> sharp_corners_;  // Copies that stay where they are.
  std::vector<std::uint32_t> fan_of_;         // Of the cells at one vertex: number of the fan, the lowest cell's index.
  std::vector<CellId> fan_;
  Offenders pinched_;
};

void Splitter::find_cell_begins() {
  std::size_t begin = 0;
  cell_begins_.reserve(mesh_.cell_count());
  for (const CellKind kind : mesh_.cell_kinds) {
    cell_begins_.push_back(begin);
    begin += static_cast<std::size_t>(corner_count(kind));
  }
}

void Splitter::mark_junctions() {
  sharp_.resize(complex_.edge_count());
  PeriodicPoll poll(cancel_);
  for (const EdgeId e : complex_.edges()) {
    poll();
    const auto is_one = [&](FaceId f) { return separates(mesh_, complex_, f); };
    sharp_[e] = complex_.edge_sharp(e) || std::ranges::count_if(complex_.edge_faces(e), is_one) > 2;
  }
}

void Splitter::split_vertices() {
  PeriodicPoll poll(cancel_);
  for (const VertexId v : complex_.vertices()) {
    poll();
    if (differ(mesh_, complex_.vertex_cells(v))) split_vertex(v);
  }
  pinched_.throw_if_any(ErrorCode::kMeshNonManifoldRegion,
                        "the cells of one region meet otherwise than in faces, or go all the way round others, at",
                        kVertices, "make regions of solid pieces, or give some of their cells to another region",
                        "cell_regions");
}

/// Cells of a fan are joined by faces at the vertex within their region.
void Splitter::number_fans(VertexId vertex, std::span<const CellId> cells) {
  fan_of_.resize(cells.size());
  std::iota(fan_of_.begin(), fan_of_.end(), 0u);
  const auto index_of = [&](CellId c) { return static_cast<std::size_t>(std::ranges::find(cells, c) - cells.begin()); };
  for (bool joined = true; joined;) {
    joined = false;
    for (const FaceId f : complex_.vertex_faces(vertex)) {
      if (separates(mesh_, complex_, f)) continue;
      const auto [a, b] = half_faces_of(f);
      std::uint32_t& fan_a = fan_of_[index_of(complex_.half_face_cell(a))];
      std::uint32_t& fan_b = fan_of_[index_of(complex_.half_face_cell(b))];
      if (fan_a == fan_b) continue;
      fan_a = fan_b = std::min(fan_a, fan_b);
      joined = true;
    }
  }
}

/// The link of the fan is a disc: its Euler characteristic is 1, and round each edge its cells are one fan again.
bool Splitter::is_half_ball(VertexId vertex, std::span<const CellId> fan) const {
  const auto is_in = [&](CellId c) { return contains(fan, c); };
  std::ptrdiff_t edges = 0, faces = 0;
  for (const EdgeId e : complex_.vertex_edges(vertex)) {
    const auto cells = std::ranges::count_if(complex_.edge_cells(e), is_in);
    if (cells == 0) continue;
    ++edges;
    const auto inner = std::ranges::count_if(complex_.edge_faces(e), [&](FaceId f) {
      const auto [a, b] = half_faces_of(f);
      return !separates(mesh_, complex_, f) && is_in(complex_.half_face_cell(a)) && is_in(complex_.half_face_cell(b));
    });
    if (cells - inner > 1) return false;
  }
  for (const FaceId f : complex_.vertex_faces(vertex)) {
    const auto [a, b] = half_faces_of(f);
    faces += is_in(complex_.half_face_cell(a)) || (!complex_.face_on_boundary(f) && is_in(complex_.half_face_cell(b)));
  }
  return edges - faces + static_cast<std::ptrdiff_t>(fan.size()) == 1;
}

std::uint32_t Splitter::add_copy(VertexId vertex) {
  ControlMesh& mesh = split_.mesh;
  const auto copy = static_cast<std::uint32_t>(mesh.vertex_count());
  mesh.positions.push_back(Vec3(mesh.positions[vertex]));
  mesh.channel_values.resize(mesh.channel_values.size() + mesh.channel_count());
  split_.origins.push_back(vertex);
  return copy;
}

void Splitter::set_channels(std::uint32_t copy, VertexId vertex, std::uint8_t region) {
  const auto values = values_in_region(mesh_, vertex, region);
  std::ranges::copy(values, split_.mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(copy * values.size()));
}

void Splitter::split_vertex(VertexId vertex) {
  const auto cells = complex_.vertex_cells(vertex);
  number_fans(vertex, cells);
  for (std::uint32_t first = 0; first < cells.size(); ++first) {
    if (fan_of_[first] != first) continue;
    fan_.clear();
    for (std::size_t i = first; i < cells.size(); ++i) {
      if (fan_of_[i] == first) fan_.push_back(cells[i]);
    }
    if (!is_half_ball(vertex, fan_)) {
      pinched_.add(vertex);
      return;
    }
    const std::uint32_t copy = first == 0 ? std::uint32_t{vertex} : add_copy(vertex);
    set_channels(copy, vertex, region_of(mesh_, fan_.front()));
    if (first == 0) continue;
    for (const CellId c : fan_) {
      *std::ranges::find(copies_in(c), std::uint32_t{vertex}) = copy;
    }
  }
  keep_corner(vertex, cells);
}

/// The corners of a cell in the split mesh.
std::span<std::uint32_t> Splitter::copies_in(CellId cell) {
  const auto count = static_cast<std::size_t>(corner_count(complex_.kind(cell)));
  return std::span(split_.mesh.cell_vertices).subspan(cell_begins_[cell], count);
}

std::uint32_t Splitter::copy_in(CellId cell, VertexId vertex) {
  return *std::ranges::find_if(copies_in(cell), [&](std::uint32_t v) { return split_.origins[v] == vertex; });
}

/// A sharp edge that ends here, or a curve of two, is the same in all regions that have all of it.
void Splitter::keep_corner(VertexId vertex, std::span<const CellId> cells) {
  std::set<std::uint32_t> copies;
  for (const CellId c : cells) copies.insert(copy_in(c, vertex));
  std::size_t sharp = 0;
  bool shared = true;
  for (const EdgeId e : complex_.vertex_edges(vertex)) {
    if (!sharp_[e]) continue;
    ++sharp;
    std::set<std::uint32_t> here;
    for (const CellId c : complex_.edge_cells(e)) here.insert(copy_in(c, vertex));
    shared = shared && here.size() == copies.size();
  }
  if (sharp <= 2 && shared) return;
  sharp_corners_.insert(sharp_corners_.end(), copies.begin(), copies.end());
}

void Splitter::copy_sharp_edges() {
  split_.mesh.sharp_edges.clear();
  for (const EdgeId e : complex_.edges()) {
    if (!sharp_[e]) continue;
    const auto [a, b] = complex_.edge_vertices(e);
    std::set<std::array<std::uint32_t, 2>> copies;
    for (const CellId c : complex_.edge_cells(e)) copies.insert({copy_in(c, a), copy_in(c, b)});
    split_.mesh.sharp_edges.insert(split_.mesh.sharp_edges.end(), copies.begin(), copies.end());
  }
}

void Splitter::copy_sharp_vertices() {
  std::set<std::uint32_t> sharp(sharp_corners_.begin(), sharp_corners_.end());
  for (const std::uint32_t v : mesh_.sharp_vertices) {
    for (const CellId c : complex_.vertex_cells(VertexId{v})) sharp.insert(copy_in(c, VertexId{v}));
  }
  split_.mesh.sharp_vertices.assign(sharp.begin(), sharp.end());
}

void Splitter::find_interfaces() {
  for (const CellId c : complex_.cells()) {
    const auto half_faces = complex_.cell_half_faces(c);
    for (std::uint8_t side = 0; side < half_faces.size(); ++side) {
      const FaceId face = face_of(half_faces[side]);
      if (complex_.face_on_boundary(face) || !separates(mesh_, complex_, face)) continue;
      const CellId other = complex_.half_face_cell(opposite(half_faces[side]));
      split_.interfaces.push_back({c, side, region_of(mesh_, other)});
    }
  }
}

}  // namespace

bool has_several_regions(const ControlMesh& mesh) {
  return std::ranges::any_of(mesh.cell_regions, [&](std::uint8_t r) { return r != mesh.cell_regions.front(); });
}

bool edge_on_interface(const ControlMesh& mesh, const CellComplex& complex, EdgeId edge) {
  return differ(mesh, complex.edge_cells(edge));
}

bool vertex_on_interface(const ControlMesh& mesh, const CellComplex& complex, VertexId vertex) {
  return differ(mesh, complex.vertex_cells(vertex));
}

SplitMesh split_cell_regions(const ControlMesh& mesh, const CellComplex& complex, const CancellationToken& cancel) {
  return Splitter(mesh, complex, cancel).run();
}

void take_from_copies(const SplitMesh& split, const ControlMesh& copies, ControlMesh& mesh) {
  std::copy_n(copies.positions.begin(), mesh.positions.size(), mesh.positions.begin());
  std::copy_n(copies.channel_values.begin(), mesh.channel_values.size(), mesh.channel_values.begin());
  if (region_value_count(mesh) == 0) return;
  const std::size_t channels = mesh.channel_count();
  std::size_t begin = 0;
  for (std::size_t cell = 0; cell < copies.cell_count(); ++cell) {
    const auto count = static_cast<std::size_t>(corner_count(copies.cell_kinds[cell]));
    for (const std::uint32_t copy : std::span(copies.cell_vertices).subspan(begin, count)) {
      const auto row = region_value_row(mesh, split.origins[copy], mesh.cell_regions[cell]);
      if (!row) continue;
      std::ranges::copy(std::span(copies.channel_values).subspan(copy * channels, channels),
                        mesh.region_values.begin() + static_cast<std::ptrdiff_t>(*row * channels));
    }
    begin += count;
  }
}

}  // namespace ccslice
