// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/build_levels.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "core/base/error.h"
#include "core/mesh/cell_kind.h"
#include "core/subdivision/refine.h"

namespace ccslice {
namespace {

constexpr int kMaxRefinements = 4;  // Two always suffice; more means a broken invariant.

// While they are prepared limit cells were measured to take up to 2.2 kB, operators, channels and boundary faces apart,
// and cells that share no faces up to 0.5 kB more for each. Where two refinements are needed, the limit cells are many
// to each cell that is left behind, and take up to 1.1 kB.
constexpr std::uint64_t kLimitCellBytes = 2560, kTwiceRefinedCellBytes = 1216, kBoundaryFaceBytes = 512;
constexpr std::uint64_t kLeastBytes = 64 << 10;  // What the smallest mesh takes.

class LevelBuilder {
 public:
  LevelBuilder(const ControlMesh& mesh, const SplitMesh& split, const PrepareOptions& options, BuildingMemory& memory,
               LimitSolid::Data& data)
      : mesh_(mesh), split_(split), cancel_(options.cancel), memory_(memory), data_(data) {}

  std::deque<Level> run(CellComplex complex) {
    memory_.reserve_control_cells();
    add_control_level(std::move(complex));
    std::vector<CellId> cells = levels_.front().complex.cells().to_vector();
    std::size_t limit_cells = 0;  // So far.
    for (std::vector<CellId> bad = classify(cells); !bad.empty(); bad = classify(cells)) {
      if (levels_.size() > kMaxRefinements) throw Error(ErrorCode::kInternal, "refinement doesn't end");
      limit_cells += cells.size() - bad.size();
      const std::size_t children = child_count(bad);
      const bool twice = levels_.size() > 1;
      memory_.reserve_cells(limit_cells + (twice ? 0 : children), twice ? children : 0);
      cells = add_refined_level(bad);
    }
    return std::move(levels_);
  }

 private:
  std::size_t child_count(const std::vector<CellId>& cells) const;
  void add_control_level(CellComplex complex);
  void name_copies(Level& level) const;
  std::vector<CellId> classify(const std::vector<CellId>& cells);
  std::vector<CellId> add_refined_level(const std::vector<CellId>& bad);
  void name_refined_places(const Refinement& refined, Level& level);
  void hand_down_interfaces(const Refinement& refined, Level& level) const;

  const ControlMesh& mesh_;
  const SplitMesh& split_;
  const CancellationToken& cancel_;
  BuildingMemory& memory_;
  LimitSolid::Data& data_;
  std::deque<Level> levels_;
  std::uint32_t next_vertex_root_ = 0;
  std::uint32_t next_edge_root_ = 0;
};

/// How many children these cells of the last level have.
std::size_t LevelBuilder::child_count(const std::vector<CellId>& cells) const {
  std::size_t count = 0;
  for (const CellId c : cells) {
    count += static_cast<std::size_t>(corner_count(levels_.back().complex.kind(c)));
  }
  return count;
}

void LevelBuilder::add_control_level(CellComplex complex) {
  Level level{std::move(complex), 0, {}, {}, {}, {}, {}};
  const std::size_t channels = mesh_.channel_count();
  data_.dimension = 3 + channels;
  data_.points.reserve(mesh_.vertex_count() * data_.dimension);
  level.vertex_keys.reserve(mesh_.vertex_count());
  level.edge_roots.reserve(level.complex.edge_count());
  for (const VertexId v : level.complex.vertices()) {
    const Vec3& p = mesh_.positions[v];
    data_.points.insert(data_.points.end(), {p.x(), p.y(), p.z()});
    for (std::size_t c = 0; c < channels; ++c) data_.points.push_back(mesh_.channel_values[v * channels + c]);
    level.vertex_keys.push_back({SurfaceKey::Kind::kVertex, v, 0, 0});
  }
  for (const EdgeId e : level.complex.edges()) level.edge_roots.push_back({e, 0, kSurfaceOne});
  next_vertex_root_ = level.complex.vertex_count();
  next_edge_root_ = level.complex.edge_count();
  if (!split_.origins.empty()) name_copies(level);
  levels_.push_back(std::move(level));
}

/// Copies of a vertex, or of an edge, are one place on the surface.
void LevelBuilder::name_copies(Level& level) const {
  const auto original = [&](VertexId v) { return split_.origins[v]; };
  for (const VertexId v : level.complex.vertices()) level.vertex_keys[v].id = original(v);
  std::map<std::array<std::uint32_t, 2>, EdgeId> first_copies;
  for (const EdgeId e : level.complex.edges()) {
    if (!level.complex.edge_on_boundary(e)) continue;
    const auto [a, b] = level.complex.edge_vertices(e);
    const bool turned = original(a) > original(b);
    FaceSide& root = level.edge_roots[e];
    root.edge = first_copies.try_emplace({std::min(original(a), original(b)), std::max(original(a), original(b))}, e)
                    .first->second;
    if (turned) std::swap(root.t_begin, root.t_end);
  }
  level.beyond.assign(level.complex.face_count(), kNoCellRegion);
  for (const auto& [cell, side, beyond] : split_.interfaces) {
    level.beyond[face_of(level.complex.cell_half_faces(cell)[side])] = beyond;
  }
}

std::vector<CellId> LevelBuilder::classify(const std::vector<CellId>& cells) {
  Level& level = levels_.back();
  level.classes.resize(level.complex.cell_count());
  level.first_child.assign(level.complex.cell_count(), CellId{kNone});
  Classifier classifier(level.complex);
  PeriodicPoll poll(cancel_);
  std::vector<CellId> bad;
  for (const CellId c : cells) {
    poll();
    level.classes[c] = classifier.classify(c);
    if (!level.classes[c]) bad.push_back(c);
  }
  return bad;
}

std::vector<CellId> LevelBuilder::add_refined_level(const std::vector<CellId>& bad) {
  Level& parent = levels_.back();
  Refinement refined = refine(parent.complex, bad, cancel_);
  std::vector<CellId> children;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    parent.first_child[bad[i]] = refined.first_child[i];
    const auto count = static_cast<std::uint32_t>(corner_count(parent.complex.kind(bad[i])));
    for (std::uint32_t k = 0; k < count; ++k) children.emplace_back(refined.first_child[i] + k);
  }
  const std::size_t base = data_.points.size();
  data_.points.resize(base + refined.stencils.rows() * data_.dimension);
  refined.stencils.apply(0, refined.stencils.rows(), data_.points.data() + parent.point_base * data_.dimension,
                         data_.dimension, data_.points.data() + base);
  Level level{std::move(refined.complex), static_cast<std::uint32_t>(base / data_.dimension), {}, {}, {}, {}, {}};
  name_refined_places(refined, level);
  if (!parent.beyond.empty()) hand_down_interfaces(refined, level);
  levels_.push_back(std::move(level));
  return children;
}

void LevelBuilder::name_refined_places(const Refinement& refined, Level& level) {
  const Level& parent = levels_.back();
  const auto middle = [&](EdgeId edge) {
    const FaceSide& root = parent.edge_roots[edge];
    return static_cast<std::uint32_t>((std::uint64_t{root.t_begin} + root.t_end) / 2);
  };
  for (const VertexId v : level.complex.vertices()) {
    const std::uint32_t origin = refined.origin[v];
    if (v < refined.edge_points_begin) {
      level.vertex_keys.push_back(parent.vertex_keys[origin]);
    } else if (v < refined.face_points_begin) {
      level.vertex_keys.push_back({SurfaceKey::Kind::kEdge, parent.edge_roots[origin].edge, middle(EdgeId{origin}), 0});
    } else {
      level.vertex_keys.push_back({SurfaceKey::Kind::kVertex, next_vertex_root_ + v, 0, 0});
    }
  }
  for (const EdgeId e : level.complex.edges()) {
    const auto [a, b] = level.complex.edge_vertices(e);
    if (a < refined.edge_points_begin && b < refined.face_points_begin) {
      const EdgeId whole{refined.origin[b]};
      const FaceSide& root = parent.edge_roots[whole];
      const bool from_begin = parent.complex.edge_vertices(whole)[0] == refined.origin[a];
      level.edge_roots.push_back({root.edge, from_begin ? root.t_begin : root.t_end, middle(whole)});
    } else {
      level.edge_roots.push_back({next_edge_root_ + e, 0, kSurfaceOne});
    }
  }
  next_vertex_root_ += level.complex.vertex_count();
  next_edge_root_ += level.complex.edge_count();
}

/// A child of a face has the face's point.
void LevelBuilder::hand_down_interfaces(const Refinement& refined, Level& level) const {
  const Level& parent = levels_.back();
  level.beyond.assign(level.complex.face_count(), kNoCellRegion);
  for (const FaceId f : level.complex.faces()) {
    for (const VertexId v : level.complex.face_vertices(f)) {
      const bool is_face_point = v >= refined.face_points_begin && v < refined.cell_points_begin;
      if (is_face_point && level.complex.face_on_boundary(f)) level.beyond[f] = parent.beyond[refined.origin[v]];
    }
  }
}

}  // namespace

void BuildingMemory::reserve_control_cells() {
  std::size_t once = 0, twice = 0;
  for (const CellKind kind : mesh_.cell_kinds) {
    constexpr std::size_t kChildren = 8;  // Of a hexahedron.
    if (kind == CellKind::kHex) {
      ++once;
    } else {
      twice += kChildren * static_cast<std::size_t>(corner_count(kind));
    }
  }
  reserve_cells(once, twice);
}

void BuildingMemory::reserve_cells(std::size_t cells, std::size_t twice_refined_cells) {
  cells_ = cells;
  twice_refined_cells_ = twice_refined_cells;
  reserve();
}

void BuildingMemory::reserve_faces(std::size_t faces) {
  faces_ = faces;
  reserve();
}

void BuildingMemory::reserve_operators(std::size_t bytes) {
  if (bytes <= operator_bytes_) return;
  operator_bytes_ = 2 * bytes;
  reserve();
}

/// Refined cells with their share of the levels above.
void BuildingMemory::reserve() {
  if (!options_.reserve) return;
  const std::uint64_t points = mesh_.vertex_count() + limit_cells();
  const std::uint64_t values = mesh_.channel_count() * 2 * points;  // While copied.
  const std::uint64_t bytes = kLeastBytes + kLimitCellBytes * cells_ + kTwiceRefinedCellBytes * twice_refined_cells_ +
                              kBoundaryFaceBytes * faces_ + sizeof(double) * values + operator_bytes_;
  told_bytes_ = std::max(told_bytes_, bytes);
  options_.reserve(told_bytes_);
}

std::deque<Level> build_levels(const ControlMesh& mesh, const SplitMesh& split, CellComplex complex,
                               const PrepareOptions& options, BuildingMemory& memory, LimitSolid::Data& data) {
  return LevelBuilder(mesh, split, options, memory, data).run(std::move(complex));
}

}  // namespace ccslice
